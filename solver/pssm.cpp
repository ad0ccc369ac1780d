#include "gnomon/pssm.h"

#include <utility>

#include "gnomon/frame.h"
#include "gnomon/maps.h"
#include "numeric.h"

namespace gnomon {
namespace {

// Splits of the region; for a stable fit of the whole depth range, since only the projection may decide them.
Status splitFor(FitMode mode, Region& region, const SplitSettings& settings, int count, Splits& splits, double& refused) noexcept {
  if (mode != FitMode::stable || region.spanCount == 0) return split(region, settings, count, splits, refused);
  // Another region would be 50 KiB of stack: this one has the whole span for a while.
  const DepthSpan first = std::exchange(region.spans[0], {region.near, region.far});
  const int spanCount = std::exchange(region.spanCount, 1);
  const Status status = split(region, settings, count, splits, refused);
  region.spans[0] = first;
  region.spanCount = spanCount;
  return status;
}

}  // namespace

Status solvePssm(const Frame& frame, const PssmSettings& settings, Solution& solution) noexcept {
  Region region;
  LightSpace light;
  if (beginSolve(frame, settings.split, settings.fit, region, light, solution) != Status::ok) return solution.status;
  double& value = solution.refusedValue;
  if (settings.fit == FitMode::stable && settings.split.automatic) return refuse(solution, Status::stableAutomatic);
  if (settings.fit == FitMode::stable && !frame.cornersWs.empty()) return refuse(solution, Status::stableCorners);

  const SplitSettings& splitting = settings.split;
  const int most = splitting.count > 0 ? splitting.count : frame.budget.partitions;
  for (int count = splitting.automatic ? 1 : most;; ++count) {
    clear(solution);
    Splits splits;
    if (const Status status = splitFor(settings.fit, region, splitting, count, splits, value); status != Status::ok)
      return refuse(solution, status);
    if (const Status status = makeMaps(frame, region, light, splits, {.fit = settings.fit, .warp = {}, .shares = Shares::equal}, solution);
        status != Status::ok)
      return refuse(solution, status);
    if (!splitting.automatic || solution.maxError <= frame.budget.targetError) return Status::ok;
    if (count < frame.budget.partitions && splitting.scheme != SplitScheme::explicitDepths) continue;
    solution.warnings |= static_cast<std::uint32_t>(Warning::targetMissed);
    return Status::ok;
  }
}

}  // namespace gnomon
