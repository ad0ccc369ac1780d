// histogram: depth splits from where a view's samples are: k-means, and those that minimise a norm of the error exactly.
//
// Based on: [Lauritzen 2010, "Partitioning Variants" and "Future Work"]. A slice [a, b] has at depth z the error
// sqrt(area of the plain fit of [a, b]) / w_i(z), times the weight of z's bin; the norm takes it over all samples.
//   max         dynamic programme in O(n k): a slice inside another costs no more (proved), so the best begin only moves on
//   mean, meanSquare  O(n^2 k) with an exact cut-off; O(n k log n) where the costs are a Monge array, which is checked
// Costs are those of the bins as they were given: latency widens what maps cover, not what decides where they begin.
// Differences from the slides: k-means clusters the logarithms of depth (of the bins), from their quantiles.
// Shader part: none.
// Test: tests/histogram_test.cpp
#pragma once

#include "gnomon/footprint.h"
#include "gnomon/region.h"
#include "gnomon/types.h"

namespace GNOMON_EXPORT gnomon {

// Over all samples of the view: the largest error, the mean, the mean of the squares.
enum class SampleNorm : std::uint8_t { max, mean, meanSquare };

inline constexpr int kMaxBins = 256;
inline constexpr int kMaxFitAxes = 12;

// The bins that hold samples, nearest first, and what a map over any run of them would cost.
struct SampleBins {
  int count = 0;
  double near[kMaxBins], far[kMaxBins];  // view depths
  double worst[kMaxBins];  // weight / w_i at the near end
  double samples[kMaxBins + 1], sum[kMaxBins + 1], squares[kMaxBins + 1];  // before each bin: of samples, of weight / w_i, of its square
  double pixelSlope = 0.0, pixelBase = 0.0;  // w_i is base + slope z
  // How far a bin's part of the region reaches on the light plane, along and across each axis that a fit may take: [-s, s, -t, t].
  float reach[kMaxBins][4][kMaxFitAxes];
  float onward[kMaxBins][4][kMaxFitAxes];  // of the bin and of what lies between it and the next one
  // Of a whole perspective view: sqrt(area) depends on the ratio of depths alone. Per unit of depth, for each number of bins spanned.
  bool isWhole = false;
  int place[kMaxBins], joined = 1;  // in the histogram, whose bins were joined by so many
  double side[kMaxBins + 1];
  bool isMonge = false, isSquareMonge = false;  // the costs of mean and of meanSquare are
};

// Bins of the region of a frame with samples; without a histogram every logarithm of a depth that may be shadowed counts alike (where
// an orthographic view begins at depth 0 or behind, every depth). Finer histograms are joined to kMaxBins.
void makeBins(const Frame& frame, const Region& region, const LightSpace& light, SampleBins& bins) noexcept;

// The norm of the error of slices that begin at these bins (first[0] = 0), in world units over pixel widths: times
// 1 / sqrt(texels of a map), in texel edges per pixel. The root of meanSquare's mean.
[[nodiscard]] double sampledError(const SampleBins& bins, SampleNorm norm, const int* first, int count) noexcept;

// Where at most `most` slices begin, that minimise the norm over all slices of whole bins. errors: of the best 1, 2, .. slices, or null.
// Returns their number: the fewest whose error is at most `target`, or the best.
int splitOptimally(const SampleBins& bins, SampleNorm norm, int most, double target, int* first, double* errors) noexcept;

// Where the clusters that Lloyd's iteration ends with begin. Returns their number.
int splitByMeans(const SampleBins& bins, int most, int* first) noexcept;

}  // namespace gnomon
