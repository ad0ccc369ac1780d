// sampled_maps: sample distribution shadow maps made where the depth buffer is [Lauritzen 2010]: its reduction, the block, and which parts of
// the mesh are drawn into which map. Nothing is read back before the frame is drawn.
//
// Two ways to reduce: tiles in fragment shaders (OpenGL 3.3), workgroups in compute shaders (4.3). Which is faster the device says: time both.
// The rest takes 4.3.
// Test: tests/sampled_maps_test.cpp
#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include <glm/vec2.hpp>

#include "gl.h"
#include "render.h"

namespace gnomon::offscreen {

// Triangles that lie together, drawn or culled as one.
struct Chunk {
  Box bounds;
  std::size_t first, count;  // indices
};

class SampledMaps {
 public:
  // Needs a current context, as all that follows. Throws std::runtime_error.
  SampledMaps();
  SampledMaps(const SampledMaps&) = delete;
  SampledMaps& operator=(const SampledMaps&) = delete;
  ~SampledMaps();

  // What make() is about: a view of width x height pixels, whose samples are not known; chunks of the indices that draw() draws. place: a
  // solution of the frame in square viewports of one atlas. Throws std::runtime_error where the library refuses.
  void prepare(const Frame& frame, const Solution& place, int width, int height, std::span<const Chunk> chunks);

  // Extremes of the depth buffer and the bounds of each map's slice.
  void reduce(ReduceBy way, GLuint depths);

  // The block, its planes and the commands of the draw, from what the same way reduced.
  void make(ReduceBy way);

  // Everything into the atlas, with the vertex array that is bound. Instances count from a map's index: an attribute with divisor 1 tells it.
  void draw() const;

  [[nodiscard]] GLuint block() const { return m_buffers[kBlock]; }  // bind it to gnomonUniforms

  // What was made and drawn, for who judges it: waits for the device. solution: the place; keeps its atlas.
  [[nodiscard]] std::size_t read(const Frame& frame, Solution& solution) const;  // triangles drawn

 private:
  enum Buffer { kView, kPlace, kMaxima, kBlock, kPlanes, kBoxes, kCommands, kBufferCount };
  enum Program {
    kFirstExtremes,
    kFirstBounds,
    kNextLevel,
    kGroupExtremes,
    kGroupBounds,
    kFinishTiles,
    kFinishGroups,
    kCull,
    kProgramCount
  };

  // The levels of a reduction by tiles: `parts` reductions side by side, down to a texel for each.
  struct Levels {
    int parts = 0;
    std::vector<GLuint> textures;
    std::vector<glm::ivec2> sizes;
  };
  void makeLevels(int parts, Levels& levels);
  void drawLevels(Program first, const Levels& levels);
  void use(Program program) const;

  GLuint m_programs[kProgramCount] = {}, m_buffers[kBufferCount] = {}, m_frame = 0, m_vertexArray = 0;
  Levels m_extremes, m_bounds;
  int m_width = 0, m_height = 0, m_maps = 0;
  std::size_t m_chunks = 0;
};

}  // namespace gnomon::offscreen
