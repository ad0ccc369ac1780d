#include "gnomon/sdsm.h"

#include "gnomon/atlas.h"
#include "gnomon/cast.h"
#include "gnomon/fit.h"
#include "gnomon/frame.h"
#include "gnomon/samples.h"
#include "numeric.h"

namespace gnomon {
namespace {

// The interior planes of `count` slices, or fewer. target, error: of optimal ones, in world units over pixel widths.
int findPlanes(const Frame& frame, const Region& region, const SdsmSettings& settings, const SampleBins& bins, int count, double target,
               double* planes, double& error) noexcept {
  const double near = region.spans[0].near, far = region.spans[region.spanCount - 1].far;
  if (settings.scheme == SdsmScheme::adaptive) {
    Splits splits;
    double refused = 0.0;
    (void)split(region, {}, count, splits, refused);
    for (int i = 1; i < splits.count; ++i) planes[i - 1] = splits.slices[i].near;
    return splits.count - 1;
  }
  if (settings.scheme == SdsmScheme::kmeans || settings.scheme == SdsmScheme::optimal) {
    int first[kMaxPartitions];
    double errors[kMaxPartitions] = {};  // k-means leaves them
    const int made = settings.scheme == SdsmScheme::kmeans ? splitByMeans(bins, count, first)
                                                           : splitOptimally(bins, settings.norm, count, target, first, errors);
    error = made > 0 ? errors[made - 1] : 0.0;
    const Samples& samples = *frame.samples;
    for (int i = 1, span = 0; i < made; ++i) {
      double& plane = planes[i - 1];
      plane = samples.histogram.empty() ? bins.near[first[i]] : binEdge(samples, bins.place[first[i]] * bins.joined);
      // Behind a gap the span begins a little before its first bin: all of it is the slice's.
      while (span + 1 < region.spanCount && region.spans[span + 1].near <= plane) ++span;
      if (region.spans[span].near > bins.far[first[i] - 1]) plane = region.spans[span].near;
    }
    return std::max(made - 1, 0);
  }
  const bool isRatio = region.camera.projection == Projection::perspective;
  for (int i = 1; i < count; ++i) planes[i - 1] = depthBetween(near, far, i, count, isRatio);
  return count - 1;
}

// The planes of the frame before, while they are near enough to the new ones.
void holdPlanes(const Region& region, double hysteresis, SdsmState& state, double* planes, int count) noexcept {
  const double near = region.spans[0].near, far = region.spans[region.spanCount - 1].far;
  const bool isRatio = region.camera.projection == Projection::perspective;
  const auto apart = [&](double a, double b) { return isRatio ? std::abs(std::log(a / b)) : std::abs(a - b); };
  const double most = hysteresis * apart(far, near) / (count + 1);
  bool isHeld = hysteresis > 0.0 && state.splitCount == count;
  for (int i = 0; i < count && isHeld; ++i) isHeld = apart(state.splits[i], planes[i]) <= most;
  if (isHeld) {
    std::copy_n(state.splits, count, planes);
    return;
  }
  std::copy_n(planes, count, state.splits);
  state.splitCount = count;
}

// The rectangles of the frame before, while they hold the new footprints and are not much larger than the least around them.
void holdRectangles(const Frame& frame, const Region& region, const LightSpace& light, const Splits& splits, FitMode mode,
                    double hysteresis, SdsmState& state, LightRectangle* rectangles) noexcept {
  Footprint footprints[kMaxPartitions];
  makeFootprints(region, light, splits, frame.margin, needsViewDepth(region, splits), false, footprints, nullptr);
  const glm::dvec2 eye(light.lsFromWorld * glm::dvec4(region.eyeWs, 0.0));
  const auto along = [](const glm::dvec2& axis, const glm::dvec2& p) { return glm::dvec2(glm::dot(axis, p), cross2(axis, p)); };
  if (state.mapCount != splits.count) std::fill_n(state.maps, kMaxPartitions, LightRectangle{});
  state.mapCount = splits.count;
  for (int i = 0; i < splits.count; ++i) {
    MapFit fit;
    fitSlice(region, footprints[i], mode, region.pixelSlope * splits.slices[i].near + region.pixelBase, fit);
    LightRectangle& held = state.maps[i];
    const double most = (1.0 + hysteresis) * (1.0 + hysteresis) * fit.size.x * fit.size.y;
    bool isHeld = held.size.x > 0.0 && held.size.x * held.size.y <= most;
    for (int v = 0; v < footprints[i].count && isHeld; ++v) {
      const glm::dvec2 at = along(held.axis, footprints[i].hull[v] + eye) - held.least;
      isHeld = at.x >= 0.0 && at.y >= 0.0 && at.x <= held.size.x && at.y <= held.size.y;
    }
    const glm::dvec2 axis(fit.s);
    if (!isHeld) held = {axis, fit.least + along(axis, eye) - fit.size * (hysteresis / 4.0), fit.size * (1.0 + hysteresis / 2.0)};
    rectangles[i] = {held.axis, held.least - along(held.axis, eye), held.size};
  }
}

}  // namespace

Status sdsmSetup(const Frame& frame, SdsmSetup& setup) noexcept {
  Frame whole = frame;
  whole.samples = nullptr;
  Region region;
  LightSpace light;
  int index = -1;
  double value = 0.0;
  if (const Status status = validate(whole, value); status != Status::ok) return status;
  if (const Status status = makeRegion(whole, region, index, value); status != Status::ok) return status;
  if (const Status status = makeLightSpace(whole.light, region, FitMode::doubled, light); status != Status::ok) return status;
  glm::dmat3 lsFromView;  // maps lie along the bounds
  if (const Status status = lightForSamples(whole, lsFromView); status != Status::ok) return status;
  light.lsFromView = glm::dmat4(lsFromView);
  light.lsFromWorld = glm::dmat4(lsFromView * glm::transpose(region.worldFromView));
  const Camera& camera = region.camera;
  const bool isPerspective = camera.projection == Projection::perspective;
  const double x = std::max(camera.left, camera.right), y = std::max(camera.down, camera.up);
  Splits all;
  all.count = 1;
  all.slices[0] = {region.near, region.far};
  Footprint footprint;
  makeFootprints(region, light, all, {}, true, false, &footprint, nullptr);
  MapFit fit;
  fitSlice(region, footprint, FitMode::slice, region.pixelSlope * region.near + region.pixelBase, fit);
  constexpr double kRounding = 1.5 / 1048576.0;  // of bounds and of the matrix: float32 products of a few factors
  const glm::dvec3 eyeMinusOrigin = frame.worldSpace ? region.eyeWs : glm::dvec3(0.0);
  const double away = kRounding * std::sqrt(glm::dot(eyeMinusOrigin, eyeMinusOrigin)), room = kRounding * footprint.reach + away;
  fit.depthNear -= room;
  fit.depthFar += room;
  extendToCasters(frame.scene.casters, region, light, fit);
  glm::dmat4 clipFromWorld;
  cropMatrix(frame, light, eyeMinusOrigin, fit, clipFromWorld);
  light.lsFromWorld[3] -= light.lsFromWorld * glm::dvec4(eyeMinusOrigin, 0.0);  // of positions; bounds stay relative to the eye
  const glm::dmat4 clip = glm::transpose(clipFromWorld), ls = glm::transpose(light.lsFromWorld);
  const double margin = frame.margin.filter + frame.margin.normalOffset;
  constexpr double kDepthRounding = 2.0 / 8388608.0;  // as depthQuantum has it
  setup = {
      .lsX = glm::vec4(ls[0]),
      .lsY = glm::vec4(ls[1]),
      .clipZ = glm::vec4(clip[2]),
      .rays = glm::vec4(glm::dvec4(isPerspective ? std::sqrt(x * x + y * y + 1.0) : 1.0, kRounding, region.pixelSlope, region.pixelBase)),
      .depth = glm::vec4(glm::dvec4(region.near, region.far, kDepthRounding, (frame.samples ? frame.samples->latency : 0.0) + away)),
      .style = glm::vec4(glm::dvec4(frame.shadowMap.style == ClipStyle::direct3d ? -1.0 : 1.0,
                                    frame.shadowMap.style == ClipStyle::vulkan ? -1.0 : 1.0, margin,
                                    frame.shadowMap.depth == DepthConvention::negativeOneToOne ? 1.0 : 0.0))};
  return Status::ok;
}

Status solveSdsm(const Frame& frame, const SdsmSettings& settings, SdsmState& state, Solution& solution) noexcept {
  Region region;
  LightSpace light;
  const bool isHeld = settings.hysteresis > 0.0;
  const FitMode fit = settings.quantise ? FitMode::doubled : FitMode::tight;
  SplitSettings splitting;
  splitting.count = settings.count;
  if (beginSolve(frame, splitting, FitMode::doubled, region, light, solution) != Status::ok) return solution.status;
  if (!frame.samples) return refuse(solution, Status::samplesMissing);
  solution.refusedValue = settings.hysteresis;
  if (!(settings.hysteresis >= 0.0 && settings.hysteresis <= 1.0)) return refuse(solution, Status::sdsmHysteresis);
  solution.refusedValue = 0.0;
  if (!settings.bounds) region.bounds = {};

  SdsmState next = state;
  if (next.directionWs != light.directionWs) next = {.directionWs = light.directionWs};
  SampleBins bins;
  const bool isOptimal = settings.scheme == SdsmScheme::optimal;
  if (region.spanCount > 0 && (isOptimal || settings.scheme == SdsmScheme::kmeans)) makeBins(frame, region, light, bins);
  const int most = settings.automatic || settings.count == 0 ? frame.budget.partitions : settings.count;
  const bool isCounting = settings.automatic && !isOptimal;
  // Where maps share a total, the more there are the fewer texels each has: the target is for the most.
  const double target = settings.automatic ? frame.budget.targetError * std::sqrt(texelsPerMap(frame.budget, most)) : 0.0;
  double error = 0.0;
  SdsmState made;
  for (int count = isCounting ? 1 : most;; ++count) {
    clear(solution);
    made = next;  // each count is held against the frame before, not against another count
    Splits splits;
    if (region.spanCount > 0) {
      double planes[kMaxPartitions], refused = 0.0;
      const int planeCount = findPlanes(frame, region, settings, bins, count, target, planes, error);
      holdPlanes(region, settings.hysteresis, made, planes, planeCount);
      splitting.scheme = SplitScheme::explicitDepths;
      splitting.depths = {planes, static_cast<std::size_t>(planeCount)};
      if (const Status status = split(region, splitting, count, splits, refused); status != Status::ok) return refuse(solution, status);
    }
    MapSettings making{.fit = fit, .warp = {}};
    LightRectangle rectangles[kMaxPartitions];
    if (isHeld) {
      holdRectangles(frame, region, light, splits, fit, settings.hysteresis, made, rectangles);
      making.rectangles = rectangles;
    }
    if (const Status status = makeMaps(frame, region, light, splits, making, solution); status != Status::ok)
      return refuse(solution, status);
    if (!isCounting || solution.maxError <= frame.budget.targetError || count == most) break;
  }
  if (settings.automatic && (isOptimal ? error > target : solution.maxError > frame.budget.targetError))
    solution.warnings |= static_cast<std::uint32_t>(Warning::targetMissed);
  state = made;
  return Status::ok;
}

}  // namespace gnomon
