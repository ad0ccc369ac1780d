// shapes: closed solids from which the built-in scenes are put together.
//
// Every solid is wound counter-clockwise seen from outside and shares its vertices, so it is watertight. Solids may sink into each
// other, but faces must not lie in one plane and overlap: which of two equal depths wins is chance, and would count as a wrong pixel.
// Shader part: none.
// Test: tests/scene_test.cpp
#pragma once

#include <cstdint>
#include <initializer_list>
#include <span>
#include <string>
#include <vector>

#include <glm/mat4x4.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>

#include "mesh.h"
#include "scene.h"

namespace gnomon::offscreen {

// The same numbers on every machine and in every run (splitmix64), unlike the standard distributions.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state(seed) {}
  double unit();  // in [0, 1)
  double between(double low, double high);
  int below(int count);  // 0 .. count - 1

 private:
  std::uint64_t state;
};

// A number in [0, 1) that belongs to a lattice point.
[[nodiscard]] double latticeNoise(int x, int y, std::uint32_t seed);
// Smooth noise in [0, 1] with features about one unit wide.
[[nodiscard]] double smoothNoise(glm::dvec2 p, std::uint32_t seed);
// Octaves of noise folded at their middle: sharp ridges, in [0, 1].
[[nodiscard]] double ridgedNoise(glm::dvec2 p, int octaves, std::uint32_t seed);

// worldFromLocal of something that stands at a point, turned about the vertical by an angle (radians).
[[nodiscard]] glm::dmat4 standing(const glm::dvec3& atWs, double turn = 0.0);
// worldFromLocal whose local y axis runs from one point towards another.
[[nodiscard]] glm::dmat4 along(const glm::dvec3& fromWs, const glm::dvec3& towardsWs);

class Shapes {
 public:
  explicit Shapes(const std::string& name) { mesh.name = name; }

  // A box with faces along the axes, in world space or in a local one.
  void box(const glm::dvec3& minWs, const glm::dvec3& maxWs);
  void box(const glm::dmat4& worldFromLocal, const glm::dvec3& min, const glm::dvec3& max);
  // A solid of revolution about local y. profile: (radius, height) from the bottom up, radii > 0, heights strictly increasing.
  // The top ring is tilted: its height grows by topSlope along local x and z.
  void lathe(const glm::dmat4& worldFromLocal, std::span<const glm::dvec2> profile, int sides, const glm::dvec2& topSlope = {0.0, 0.0});
  void lathe(const glm::dmat4& worldFromLocal, std::initializer_list<glm::dvec2> profile, int sides,
             const glm::dvec2& topSlope = {0.0, 0.0});
  // A rod of constant radius through the points of a path.
  void rod(std::span<const glm::dvec3> pathWs, double radius, int sides);
  void rod(const glm::dvec3& fromWs, const glm::dvec3& toWs, double radius, int sides);
  // A rope between two points, hanging lower in the middle by sag.
  void rope(const glm::dvec3& fromWs, const glm::dvec3& toWs, double sag, double radius, int segments);
  // A rough ball of 80 triangles.
  void boulder(const glm::dvec3& centreWs, const glm::dvec3& radii, std::uint64_t seed);
  // An open sheet over a (columns + 1) x (rows + 1) lattice, row after row. Seen from its front, columns run right and rows run up.
  void sheet(std::span<const glm::dvec3> pointsWs, int columns, int rows);

  // The mesh, with its bounds.
  [[nodiscard]] Mesh take();

 private:
  std::uint32_t vertex(const glm::dvec3& positionWs);
  void triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c);
  void quad(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d);
  // Rings of `sides` vertices from `first` on, counter-clockwise seen from the end, joined and capped.
  void joinRings(std::uint32_t first, int rings, int sides);

  Mesh mesh;
};

// A camera of the built-in scenes, near and far fitted to what it sees.  farthest: where the depth of what is really seen is known to
// end nearer than what lies in view, because something hides the rest; 0: not known.
[[nodiscard]] gnomon::Camera builtInCamera(const Mesh& mesh, const glm::dvec3& eyeWs, const glm::dvec3& targetWs, double farthest = 0.0);

// One for each built-in scene.
[[nodiscard]] BuiltIn makeColonnade();
[[nodiscard]] BuiltIn makeRelief();
[[nodiscard]] BuiltIn makeCity();
[[nodiscard]] BuiltIn makeHall();

}  // namespace gnomon::offscreen
