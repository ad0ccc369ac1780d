// sdsm: sample distribution shadow maps: slices where the view's samples are, each map cut to its own samples.
//
// Based on: [Lauritzen 2010]; a composition of samples -> region -> histogram -> footprint -> fit -> atlas -> block.
// Differences from the slides: the region is cut by the samples (gnomon/region.h), so bins without any get no map whatever the scheme; a
// map is the least rectangle around what a slice's plain fit and the hull of its bounds have in common; optimal splits are their future
// work.
// Shader part: glsl/gnomon_sdsm.glsl
// Test: tests/sdsm_test.cpp, tests/parity_sdsm_test.cpp
#pragma once

#include "gnomon/histogram.h"
#include "gnomon/maps.h"
#include "gnomon/types.h"

namespace GNOMON_EXPORT gnomon {

enum class SdsmScheme : std::uint8_t {
  logarithmic,  // equal ratios between the nearest and the farthest sample: the slides' recommendation
  kmeans,  // clusters of samples: good on average, at times far off
  adaptive,  // equal ratios that skip gaps
  optimal,  // the least norm of the error over the samples
};

struct SdsmSettings {
  SdsmScheme scheme = SdsmScheme::logarithmic;
  SampleNorm norm = SampleNorm::max;  // that optimal minimises
  bool bounds = true;  // use Samples::bounds, where given
  double hysteresis = 0.0;  // against flicker: splits stay until they are this share of a mean slice off; rectangles while they hold what
      // they must and have at most (1 + this)^2 times the area of the least one; sides taken anew are longer by half of this share [0, 1]
  bool quantise = false;  // against flicker: FitMode::doubled, in square viewports
  int count = 0;  // partitions [1, Budget::partitions]; 0: as many as the budget allows
  bool automatic = false;  // optimal: the fewest whose norm meets Budget::targetError; others: whose maximum does; count is then ignored
};

// What hysteresis remembers from frame to frame; as constructed, nothing. One for each light. Yours to keep.
struct SdsmState {
  glm::dvec3 directionWs{0.0};  // of the light that it is about
  int splitCount = 0;
  double splits[kMaxPartitions] = {};  // interior planes
  int mapCount = 0;
  LightRectangle maps[kMaxPartitions] = {};  // relative to the world's origin; size 0: none
};

// What gnomon_sdsm.glsl needs of a frame; its vec4s are GnomonSdsmSetup's.
struct SdsmSetup {
  glm::vec4 lsX, lsY, clipZ, rays, depth, style;
};

// For partitions made on the GPU. They serve a whole view, perspective or orthographic; scene, budget, light and worldSpace are the
// frame's, its samples are not read (but their latency). Errors: those of every method.
[[nodiscard]] Status sdsmSetup(const Frame& frame, SdsmSetup& setup) noexcept;

// Partitions for one directional light from Frame::samples. No heap, no globals, no exceptions. Errors: those of every method,
// samplesMissing, sdsmHysteresis, splitCount. On any refusal the answer has no partitions, its block reads as lit and the state is as it
// was. Returns solution.status.
Status solveSdsm(const Frame& frame, const SdsmSettings& settings, SdsmState& state, Solution& solution) noexcept;

}  // namespace gnomon
