// split: view depths at which one map ends and the next begins.
//
// Based on: [Zhang 2006, sec. 3.3, eq. 4 logarithmic, 5 uniform, 6 and 7 practical].
// Differences from the paper: eq. 7's bias moves interior planes only, so that the ends stay n and f; lambda weighs the
// two schemes (the paper's eq. 6 is lambda = 1/2); depth ranges without receivers get no partition: the fewest, least
// ratios cover what is left, and the paper's formula spaces the planes inside each stretch. An orthographic view has one
// pixel width for all depths, so the argument of eq. 1 to 3 leads to uniform planes and every scheme but explicit gives them.
// Shader part: none.
// Test: tests/split_test.cpp
#pragma once

#include <span>

#include "gnomon/region.h"
#include "gnomon/types.h"

namespace GNOMON_EXPORT gnomon {

enum class SplitScheme : std::uint8_t { uniform, logarithmic, practical, explicitDepths };

struct SplitSettings {
  SplitScheme scheme = SplitScheme::logarithmic;
  double lambda = 0.5;  // practical: weight of the logarithmic planes [0, 1]
  double bias = 0.0;  // practical: added to interior planes, world units [>= 0]
  // explicitDepths: view depths between slices, strictly increasing, fewer than Budget::partitions. They alone decide: a slice between each
  // two, one before and one behind all, less those that hold nothing; neither count nor automatic makes more or fewer.
  std::span<const double> depths = {};
  int count = 0;  // partitions [1, Budget::partitions]; 0: as many as the budget allows
  bool automatic = false;  // the least count whose predicted error meets Budget::targetError; count is then ignored
};

// A part of the light plane swept along the light, in view space: start <= axis(p) < end, left(p) >= 0, right(p) >= 0, where
// plane(p) = dot(normal, p) + offset. A side with a zero normal does not bound.
struct Wedge {
  Plane left, right, axis;
  double start, end;  // may be -kInfinity and kInfinity
};

// Where wedges lie in rows across an axis of the light plane, each row cut into columns of equal width: a shader finds its own without a
// search. The first row and the outer columns have no outer ends, each row ends where the next starts, borders belong to what starts there.
struct Rows {
  struct Row {
    double start;  // along the axis
    double left, columnWidth;  // across it: where the first column would begin, had it an end
    int columns, first;  // wedges first to first + columns - 1, in order of `across`
  };
  int count = 0;  // 0: the wedges are not in rows
  Plane along, across;  // a point's coordinates, view space
  // Row i starts where log(1 + slope (along - from)) is i growth; no rule where slope or growth is 0.
  double from, slope, growth;
  Row rows[kMaxPartitions];
  int cells[kMaxPartitions];  // each wedge's place in the solution, -1: it holds nothing
};

// Depth intervals to serve, in order, disjoint; each ends where the next begins unless receivers leave a gap. Where isWedged, every
// slice spans the region's whole depth and the wedges, disjoint, decide instead.
struct Splits {
  int count = 0;
  bool isWedged = false;
  DepthSpan slices[kMaxPartitions];
  Wedge wedges[kMaxPartitions];
  Rows rows;
};

// Errors: splitLambda, splitBias, splitExplicit, splitCount; value, index: what was refused.
[[nodiscard]] Status validate(const SplitSettings& settings, const Budget& budget, double& value, int& index) noexcept;

// Splits the region's depth spans into at most `count` slices, or as explicit depths do whatever their number; fewer where a slice would
// hold nothing. Errors: splitBiasOrder (the bias moves a plane past far or another plane; refused: that bias).
[[nodiscard]] Status split(const Region& region, const SplitSettings& settings, int count, Splits& splits, double& refused) noexcept;

// True where the camera's depth buffer cannot tell neighbouring slices apart, so that shaders must select by view depth.
[[nodiscard]] bool needsViewDepth(const Region& region, const Splits& splits) noexcept;

// What each map must cover: its slice, padded by what selection may confuse (float32 depth values, or view depths) and, at its near end,
// by the blend band; never beyond the region.
void padSlices(const Region& region, const Splits& splits, const Margin& margin, bool byViewDepth, DepthSpan* padded) noexcept;

}  // namespace gnomon
