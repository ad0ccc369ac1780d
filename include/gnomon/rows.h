// rows: rectangles that do not overlap, in rows and columns, cut from the projection of what must be shadowed on the light plane.
//
// Based on: [Tang 2017, sec. 3.2, eq. 1] with the errata. The projection lies in an isosceles trapezoid along an axis of the light plane;
// rows across the axis grow with its width.
//   paper    eq. 1 as printed, from the near base; refused where the rows allowed do not reach the far end
//   fitted   as many rows, or as many as are allowed, of one ratio of width, that end where the trapezoid ends
//   error    as many rows as are allowed, each with an equal share of the integral of 1 / w along the axis, w the least pixel width at a
//            point of it: what the limit's integrand asks for [papers' errata, the bound]; so rows of a whole view are similar figures
// Differences from the paper: the trapezoid holds the projection of any region, its centre line free: the one that needs the fewest texels
// if rows were endless, each point of the plane weighing 1 / w^2 (by area alone it would often be a rectangle, and so would every row).
// One that narrows away from the viewer turns round. The axis is the projected view direction, or one of the image's sides where that
// needs fewer texels: along the view there is no such direction, and close to it any. Rows and outer columns have no outer ends, so that
// no rounding opens a gap.
// Shader part: none.
// Test: tests/rows_test.cpp
#pragma once

#include "gnomon/footprint.h"
#include "gnomon/split.h"
#include "gnomon/types.h"

namespace GNOMON_EXPORT gnomon {

enum class RowRule : std::uint8_t { paper, fitted, error };

struct RowSettings {
  RowRule rule = RowRule::fitted;
  double zeta = 0.25;  // paper, fitted: the greatest share of a row that may be wasted beside the trapezoid, on each side (0, 0.5)
  double sigma = 0.5;  // paper, fitted: a rectangle may be 1 + sigma times as wide as high (0, infinity)
  int maxRows = kMaxPartitions;  // [1, kMaxPartitions]
  int maxColumns = 2;  // [1, kMaxPartitions]; error: exactly as many
};

// An isosceles trapezoid on the light plane: `base` wide where it begins, wider by 2 tangent for each unit of length.
struct Trapezoid {
  glm::dvec2 axis;  // unit
  double from, length, centre;  // of its coordinates along the axis and across it (counter-clockwise from the axis)
  double base, tangent;  // > 0, >= 0; the paper's n and tan(theta)
};

// Of the trapezoids along an axis that hold a hull, the one that is narrowest at the coordinate `centre`. With the mean of a weight there,
// its area by that weight is the least. Its sides are no shorter than `least` (> 0).
[[nodiscard]] Trapezoid leastTrapezoid(const glm::dvec2* hull, int count, const glm::dvec2& axis, double centre, double least) noexcept;

// A rectangle across the trapezoid: the paper's H_i and W_i.
struct RowSize {
  double height, width;
};

// Rows of eq. 1 from the near base, as many as reach the far end, at most `most` of them. Returns their number.
int paperRows(const Trapezoid& shape, double zeta, int most, RowSize* rows) noexcept;

// At most as many rows of one ratio, that end where the trapezoid ends. Returns their number.
int fittedRows(const Trapezoid& shape, double zeta, int most, RowSize* rows) noexcept;

// N_w: columns that leave none more than 1 + sigma times as wide as high.
[[nodiscard]] int columnCount(const RowSize& row, double sigma, int most) noexcept;

// The paper's rho: the share of a row beside the trapezoid on each side.
[[nodiscard]] double wasteOf(const RowSize& row, double tangent) noexcept;

// What rows of a region are made from, however many.
struct RowPlane {
  Footprint whole;  // the region's, which rows cut
  Trapezoid shape;  // around it
  int count;  // vertices; 0: nothing to shadow
  glm::dvec3 seen[kMaxHull];  // x, y and the pixel width at each, which rises
};

// Finds them, or that there is nothing.
void makeRowPlane(const Region& region, const LightSpace& light, RowPlane& plane) noexcept;

// What was made.
struct RowLayout {
  Trapezoid shape;
  int count = 0;
  RowSize sizes[kMaxPartitions];
  int columns[kMaxPartitions];
  double waste = 0.0;  // greatest rho
};

// Errors: rowsZeta, rowsSigma, rowsMaxRows, rowsMaxColumns; value: what was refused.
[[nodiscard]] Status validate(const RowSettings& settings, double& value) noexcept;

// Splits the region that the plane was made of into at most `most` wedges in rows: where there are too many, columns give way first, then
// rows. None where the region is empty. Errors: rowsReach.
[[nodiscard]] Status splitRows(const Region& region, const LightSpace& light, const RowPlane& plane, const RowSettings& settings, int most,
                               Splits& splits, RowLayout& layout) noexcept;

}  // namespace gnomon
