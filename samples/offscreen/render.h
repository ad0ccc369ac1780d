// render: draws a mesh with the product's shaders: the shadow maps of a solution, then the camera's view with a lookup in them.
//
// It stands for the renderer that takes gnomon in: it knows the block only through the includes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "context.h"
#include "gnomon/types.h"
#include "mesh.h"

namespace gnomon::offscreen {

enum class Filter { none, box3x3, tent };

// How the shadow maps are drawn: all the ways of gnomon_cast.glsl.
enum class CastPath {
  eachMap,  // a pass for each map: viewport and scissor
  fragmentDepth,  // the same, depth clamped by the fragment stage instead of the API
  wholeAtlas,  // one pass over the atlas, an instance for each map, cut by clip distances
  layers,  // one pass over an array texture, a layer for each map from the geometry stage (MapLayout::layers)
};

struct RenderOptions {
  int width = 1280, height = 720;
  Filter filter = Filter::none;
  CastPath castPath = CastPath::eachMap;
  bool selectByViewDepth = false;  // as a pass without a depth buffer would
  bool time = true;  // draw once more, warm, for the times
  bool pictures = true;  // shaded, tinted and maps beside the numbers
};

// Rows top first.
struct RenderOutput {
  int width = 0, height = 0;
  std::vector<float> position;  // height x width x 3: world - origin, 0 where there is nothing
  std::vector<float> normal;  // height x width x 3: geometric, unit, towards the viewer
  std::vector<std::uint8_t> lit;  // height x width: 0 shadowed, 1 lit, 2 nothing (filtered: lit from one half)
  std::vector<std::uint8_t> index;  // height x width: partition, 255 none
  std::vector<std::uint8_t> shaded;  // height x width x 3: the picture, sRGB
  std::vector<std::uint8_t> tinted;  // height x width x 3: partitions tinted, texels' borders drawn
  int mapsWidth = 0, mapsHeight = 0;
  std::vector<std::uint8_t> maps;  // mapsHeight x mapsWidth, grey: every shadow map, near dark; 0 x 0 without maps
  std::size_t shadowTriangles = 0;  // drawn in all maps after culling
  double shadowMs = 0.0, frameMs = 0.0;  // shadow passes; these and the camera's pass, finished
};

// How a depth buffer is reduced on the device: tiles in fragment shaders (OpenGL 3.3), or compute shaders (4.3).
enum class ReduceBy { fragments, workgroups };

// Milliseconds, medians of nine in turn.
struct ReduceTimes {
  double fragments = 0.0, workgroups = 0.0;

  [[nodiscard]] ReduceBy faster() const { return workgroups < fragments ? ReduceBy::workgroups : ReduceBy::fragments; }
};

class Renderer {
 public:
  // version: of the GLSL language, "330 core" or "450". Throws std::runtime_error.
  explicit Renderer(Backend backend = defaultBackend(), const std::string& version = "330 core");
  ~Renderer();

  // Puts a mesh on the device; every render draws the last one.
  void load(const Mesh& mesh);

  // Throws std::runtime_error where the driver refuses or no mesh was loaded.
  [[nodiscard]] RenderOutput render(const Frame& frame, const Solution& solution, const RenderOptions& options = {});

  // The same of sample distribution shadow maps that the device makes of the view's own depth buffer, drawn indirectly: nothing is read back before.
  // solution: becomes what was made, for judging. Its maps are as many as the budget's and lie in one atlas; options.castPath is not read.
  // shadowMs holds the reduction. Throws too where the library refuses.
  [[nodiscard]] RenderOutput renderSampled(const Frame& frame, ReduceBy way, Solution& solution, const RenderOptions& options = {});

  // How long the depth buffer of such a view takes to reduce on this device, each way.
  [[nodiscard]] ReduceTimes timeReductions(const Frame& frame, int width, int height);

  // The depth buffer of the camera's view alone, as its API stores it: bottom row first, width x height.
  [[nodiscard]] std::vector<float> depths(const Frame& frame, int width, int height);

  [[nodiscard]] std::string device() const;  // what draws, as the driver names itself

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace gnomon::offscreen
