// region: what must be shadowed, as convex cells in view space and as the intervals of view depth they fill.
//
// The view volume up to the shadow distance, cut by the half-spaces and by the receivers' box; several boxes make a cell each. Nothing
// allocates: a cell that would overflow keeps what it had (it covers more) and says so.
// Based on: [Zhang 2006, sec. 3.4] (focusing on what is shadow relevant), [Lauritzen 2010] (only what is
// sampled needs shadow, and depth gaps are real).
// Shader part: none.
// Test: tests/region_test.cpp
#pragma once

#include <glm/mat3x3.hpp>

#include "gnomon/types.h"

namespace GNOMON_EXPORT gnomon {

inline constexpr int kMaxCellVertices = 64;
inline constexpr int kMaxCellEdges = 96;
inline constexpr int kMaxCellPlanes = 32;
inline constexpr int kMaxSpans = 32;

// A half-space normal . p + offset >= 0. The normal need not be unit.
struct Plane {
  glm::dvec3 normal;
  double offset;
};

// A convex polytope: vertices, and edges that know the two faces (planes) they lie between. May be flat. Holds nothing until it is made.
struct Cell {
  struct Edge {
    std::uint8_t from, to;  // vertices
    std::uint8_t left, right;  // planes
  };
  int vertexCount, edgeCount, planeCount;
  bool isExact;  // false once a cut was `kept`, and it holds more than it should, or is all rounding
  double reach;  // the largest coordinate that a cut has met: rounding of what is left scales with it
  glm::dvec3 vertices[kMaxCellVertices];
  Edge edges[kMaxCellEdges];
  Plane planes[kMaxCellPlanes];
};

enum class Cut : std::uint8_t {
  outside,  // nothing is left
  inside,  // the plane cuts nothing
  cut,  // the plane is a new face
  kept,  // not cut: no room, or rounding leaves the cut undecided; the cell still covers what it should
};

// Cuts the cell to a half-space. Vertices within rounding of the plane count as inside.
// magnitude: size of the terms that the plane's offset was computed from, for that rounding.
Cut cutCell(Cell& cell, const Plane& plane, double magnitude) noexcept;

// Copies the used part of a cell.
void copyCell(const Cell& from, Cell& to) noexcept;

// The eight corners of a box given by its least and greatest coordinates along three axes, as a cell.
void boxCell(const glm::dvec3& least, const glm::dvec3& greatest, const glm::dmat3& axes, Cell& cell) noexcept;

// An interval of view depth, closed.
struct DepthSpan {
  double near, far;
};

inline constexpr int kMaxKeptCells = 16;

struct Region {
  glm::dmat3 worldFromView{1.0};  // columns: right, up, forward
  glm::dvec3 eyeWs{0.0};
  Camera camera;  // as given; its sides moved out to enclose a volume given by corners
  double pixelBase = 0.0, pixelSlope = 0.0;  // the width of a pixel, w_i, is base + slope z
  double near = 0.0, far = 0.0;  // view depths of the shadowed volume, before receivers
  std::span<const Box> receivers;  // where there are several; a single one has cut the volume
  double reach = kInfinity;  // farthest point of a volume given by corners from the eye, world units
  std::span<const SampleBounds> bounds;  // where samples lie on the light plane; none: anywhere
  glm::dvec3 boundsRightWs{0.0};  // right of the camera that they were taken from
  double latency = 0.0;  // room for them, world units
  double unevenness = 0.0;  // how far its faces are from flat, world units
  Cell volume;  // view volume, half-spaces and the only receiver; no vertices: empty
  Cell parts[kMaxKeptCells];  // of the first of several receivers, cut once
  int spanCount = 0;  // 0: nothing to shadow
  DepthSpan spans[kMaxSpans];  // disjoint, ascending; closest ones joined where there are more
  std::uint32_t warnings = 0;
};

// Builds the region of a frame whose camera is valid. Errors: corners, receiverBox, casterBox, halfSpace, samples*, floatRange (index,
// value: what was refused).
[[nodiscard]] Status makeRegion(const Frame& frame, Region& region, int& index, double& value) noexcept;

// The i-th of count + 1 view depths from near to far, of equal ratio or equally far apart; ends are exact.
[[nodiscard]] double depthBetween(double near, double far, int i, int count, bool isRatio) noexcept;

// The view depth where bin i of a histogram begins and bin i - 1 ends; ends are exact.
[[nodiscard]] double binEdge(const Samples& samples, int i) noexcept;

// How many cells the region has: one for each of several receiver boxes, or the volume alone.
[[nodiscard]] int cellCount(const Region& region) noexcept;

// The i-th cell, in view space; null where it is empty. Made in storage where the region does not keep it.
[[nodiscard]] const Cell* getCell(const Region& region, int i, Cell& storage) noexcept;

// Checks boxes: finite, min <= max. Returns the index of the first bad one or -1; value: what was wrong.
[[nodiscard]] int badBox(std::span<const Box> boxes, double& value) noexcept;

}  // namespace gnomon
