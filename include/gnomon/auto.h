// auto: the cheapest partitioning that meets a target error within the budget, and why it was chosen.
//
// A composition: region -> (split | face | rows, any count, any warp) -> footprint -> fit -> warp compared by cost -> atlas -> block. Cost
// is the estimated time of a frame: passes, texels and the solve itself, weighed by what a device takes for each. Based on the
// certificate's measure [Lloyd 2006, eq. 12 generalised]: a choice that needs N texels for error 1 meets error e with N / e^2, so no more
// than these are allocated. The count that usual views take is tried first, then its neighbours while they are better; what k warped maps
// of equal ratio leave of the limit [Lloyd 2006, eq. 18] rules out most others before anything is fitted.
// Shader part: glsl/gnomon_lloyd.glsl: gnomonSelectMask finds the partition, whatever was chosen.
// Test: tests/auto_test.cpp
#pragma once

#include "gnomon/types.h"
#include "gnomon/warp.h"

namespace GNOMON_EXPORT gnomon {

enum class AutoLayout : std::uint8_t {
  slices,  // of view depth (gnomon/split.h); of what is sampled, where the frame has samples
  faces,  // the view's sides, in rows (gnomon/face.h)
  rows,  // of the light plane, by error (gnomon/rows.h)
  columns,  // the same in two columns
};

struct AutoChoice {
  AutoLayout layout = AutoLayout::slices;
  int count = 0;  // asked for; 0: no choice
  Warp warp = Warp::none;  // none, lispsm or least
  bool operator==(const AutoChoice&) const = default;
};

// What things take on a device, nanoseconds. The defaults are a round guess at a desktop GPU: ratios matter, not sizes.
struct DeviceProfile {
  double pass = 50000.0;  // drawing one map: what does not depend on its size [>= 0]
  double texel = 0.05;  // clearing, writing and reading a texel [>= 0]
  double fit = 500.0;  // the solver's rectangle or named warp of a slice [>= 0]
  double search = 5000.0;  // its search of the least warp [>= 0]
};

struct AutoSettings {
  bool hasTarget = true;  // Budget::targetError is to be met as cheaply as can be; false: the least error that the budget allows
  DeviceProfile profile = {};
  double hysteresis =
      0.1;  // what the choice of the frame before may cost more than the best, as a share, and move before all are compared [>= 0]
};

// A choice and what it is predicted to come to.
struct AutoCandidate {
  AutoChoice choice;
  int maps = 0;  // not empty
  double neededTexels = 0.0;  // for error 1, as Solution has it
  double texels = 0.0;  // allocated
  double error = 0.0;  // greatest texel edge over a pixel's width; infinite where the margins leave it no texels
  double cost = 0.0;  // nanoseconds
  bool isMet = false;  // the target, within the budget; always without one
};

inline constexpr int kMaxCandidates = 48;

// Why: everything that was compared.
struct AutoReport {
  int count = 0;
  AutoCandidate candidates[kMaxCandidates];
  int chosen = -1, runnerUp = -1;  // of candidates; -1: none
  bool isKept = false;  // the choice of the frame before, with nothing or not enough against it
  // Where the target is missed: the texels it takes with the maps allowed, and the fewest maps found with which the budget's texels for a
  // map do (0: none up to kMaxPartitions).
  double texelsForTarget = 0.0;
  int mapsForTarget = 0;
};

// What is remembered from frame to frame; as constructed, nothing. One for each light. Yours to keep.
struct AutoState {
  AutoChoice choice;
  int partitions = 0;  // that the budget allowed
  double value = 0.0;  // cost when all were compared last; without a target the error
  double overLimit = 0.0;  // texels needed over the least that the view needs, then
  bool isMet = false;  // the target, then
  struct Shape {
    glm::dvec3 axisVs{0.0};  // along which the map is warped, view space; zero: nothing was searched
    double kappaShare = 0.0, sigma = 0.0, tau = 0.0;  // as WarpHint has them
  } shapes[kMaxPartitions];
};

// Errors: autoPass, autoTexel, autoFit, autoSearch, autoHysteresis; value: what was refused.
[[nodiscard]] Status validate(const AutoSettings& settings, double& value) noexcept;

// Partitions for one directional light. No heap, no globals, no exceptions; some 230 KB of stack. Texels are shared so that every map ends
// with the same error; over budget all give way alike. Warning: targetMissed. On any refusal the answer has no partitions, its block reads
// as lit and the state is as it was. Returns solution.status.
Status solveAuto(const Frame& frame, const AutoSettings& settings, AutoState& state, Solution& solution,
                 AutoReport* report = nullptr) noexcept;

}  // namespace gnomon
