#include "gnomon/maps.h"

#include "gnomon/atlas.h"
#include "gnomon/camera.h"
#include "gnomon/cast.h"
#include "gnomon/error.h"
#include "gnomon/frame.h"
#include "numeric.h"

namespace gnomon {
namespace {

// The least view depth of the region inside a slice: a pixel is narrowest there.
double nearestIn(const Region& region, const DepthSpan& slice) noexcept {
  for (int i = 0; i < region.spanCount; ++i)
    if (region.spans[i].far >= slice.near) return std::clamp(region.spans[i].near, slice.near, slice.far);
  return slice.near;
}

// The axis of a wedge's warps: the bisector of its sides, as the light sees it; along the axis it is cut by where it has no sides.
glm::dvec2 wedgeAxis(const Wedge& wedge, const LightSpace& light) noexcept {
  const auto seen = [&](const Plane& plane) { return glm::dvec2(light.lsFromView * glm::dvec4(plane.normal, 0.0)); };
  const auto turned = [](const glm::dvec2& v) { return v == glm::dvec2(0.0) ? v : glm::dvec2(v.y, -v.x) / std::sqrt(glm::dot(v, v)); };
  glm::dvec2 axis = turned(seen(wedge.left)) - turned(seen(wedge.right));  // along the sides, away from the apex
  if (axis == glm::dvec2(0.0)) axis = seen(wedge.axis);
  const double squared = glm::dot(axis, axis);
  return squared > 0.0 ? axis / std::sqrt(squared) : axis;
}

// A wedge's half-spaces in the world, unit normals. Returns their number.
int writePlanes(const Region& region, const Wedge& wedge, glm::dvec4* planesWs) noexcept {
  int count = 0;
  const auto add = [&](const glm::dvec3& normal, double offset) {
    const glm::dvec3 normalWs = region.worldFromView * normal;
    const double scale = 1.0 / std::sqrt(glm::dot(normalWs, normalWs));
    planesWs[count++] = glm::dvec4(normalWs, offset - glm::dot(normalWs, region.eyeWs)) * scale;
  };
  for (const Plane& side : {wedge.left, wedge.right})
    if (side.normal != glm::dvec3(0.0)) add(side.normal, side.offset);
  if (wedge.start > -kInfinity) add(wedge.axis.normal, wedge.axis.offset - wedge.start);
  if (wedge.end < kInfinity) add(-wedge.axis.normal, wedge.end - wedge.axis.offset);
  return count;
}

// Room on every side, in world units.
void giveRoom(double motion, MapFit& fit) noexcept {
  const glm::dvec2 room = motion * unitsPerWorld(fit);
  fit.least -= room;
  fit.size += 2.0 * room;
  fit.depthNear -= motion;
  fit.depthFar += motion;
}

}  // namespace

Status beginSolve(const Frame& frame, const SplitSettings& splitting, FitMode fit, Region& region, LightSpace& light,
                  Solution& solution) noexcept {
  clear(solution);
  double& value = solution.refusedValue;
  if (const Status status = validate(frame, value); status != Status::ok) return refuse(solution, status);
  if (const Status status = validate(splitting, frame.budget, value, solution.refusedIndex); status != Status::ok)
    return refuse(solution, status);
  if (const Status status = makeRegion(frame, region, solution.refusedIndex, value); status != Status::ok) return refuse(solution, status);
  value = firstBad(frame.light.directionWs, 0.0);
  if (const Status status = makeLightSpace(frame.light, region, fit, light); status != Status::ok) return refuse(solution, status);
  solution.originWs = frame.worldSpace ? glm::dvec3(0.0) : region.eyeWs;
  return Status::ok;
}

WarpHint hintOf(const MapFits& maps, int slice, int trials) noexcept {
  const Served& served = maps.served[slice];
  double narrowest = kInfinity, widest = 0.0;
  for (int i = 0; i < served.count; ++i) {
    narrowest = std::min(narrowest, served.pixels[i]);
    widest = std::max(widest, served.pixels[i]);
  }
  WarpHint hint{maps.shapes[slice], trials};
  if (widest > narrowest) hint.shape.kappa /= std::log(widest / narrowest);
  return hint;
}

void fitMaps(const Frame& frame, const Region& region, const LightSpace& light, const Splits& splits, const MapSettings& settings,
             bool byViewDepth, MapFits& maps) noexcept {
  maps.byViewDepth = byViewDepth;
  maps.hasServed = splits.isWedged || (settings.warp.warp != Warp::none && region.bounds.empty());
  const bool mayCopy = region.bounds.empty() && !settings.rectangles && (settings.fit == FitMode::tight || settings.fit == FitMode::slice);
  makeFootprints(region, light, splits, frame.margin, byViewDepth, mayCopy, maps.footprints, maps.hasServed ? maps.served : nullptr,
                 region.bounds.empty() ? settings.whole : nullptr);
  for (int i = 0; i < splits.count; ++i) maps.pixels[i] = region.pixelSlope * nearestIn(region, splits.slices[i]) + region.pixelBase;
  if (splits.isWedged)  // a wedge's nearest point decides, not the region's
    for (int i = 0; i < splits.count; ++i)
      if (const Served& served = maps.served[i]; served.count > 0)
        maps.pixels[i] = *std::min_element(served.pixels, served.pixels + served.count);
  refitMaps(region, light, splits, settings, maps);
}

void refitMaps(const Region& region, const LightSpace& light, const Splits& splits, const MapSettings& settings, MapFits& maps) noexcept {
  // Bounds of samples cut the rectangles; what a warp is certified over would lie outside of them, so maps are not warped there.
  const WarpSettings warp = region.bounds.empty() ? settings.warp : WarpSettings{};
  const bool isWarping = maps.hasServed && warp.warp != Warp::none;
  double rest[kMaxPartitions + 1] = {};  // what the maps from each on need at least
  for (int i = splits.count; i-- > 0 && settings.gain < kInfinity;) rest[i] = rest[i + 1] + maps.fits[i].needed / settings.gain;
  maps.neededTexels = 0.0;
  for (int i = 0; i < splits.count; ++i) {
    if (maps.neededTexels + rest[i] > settings.most) {
      maps.neededTexels += rest[i];
      return;
    }
    MapFit& fit = maps.fits[i];
    if (const int like = maps.footprints[i].like; like != i) {
      copyFit(maps.fits[like], maps.footprints[i], fit);
      if (isWarping) maps.shapes[i] = maps.shapes[like];
    } else {
      fitSlice(region, maps.footprints[i], settings.fit, maps.pixels[i], fit);
      if (settings.rectangles) {
        const auto& [along, least, size] = settings.rectangles[i];
        fit.s = glm::dvec3(along, 0.0);
        fit.t = {-along.y, along.x, 0.0};
        fit.least = least;
        fit.size = size;
        fit.needed = size.x * size.y / (maps.pixels[i] * maps.pixels[i]);
        if (settings.fit == FitMode::tight) fit.aspect = size.x / size.y;
      }
      if (isWarping) {
        const glm::dvec2 view(light.lsFromView[2]);
        const double length = std::sqrt(glm::dot(view, view));
        const glm::dvec2 axis = splits.isWedged ? wedgeAxis(splits.wedges[i], light) : length > 0.0 ? view / length : glm::dvec2(0.0);
        WarpHint before;
        const WarpHint* hint = settings.hints ? &settings.hints[i] : nullptr;
        if (!hint && settings.chained > 0 && i > 0 && (maps.fits[i - 1].isWarped || i > 1)) {
          before = hintOf(maps, maps.footprints[i - 1].like, settings.chained);
          hint = &before;
        }
        maps.shapes[i] = warpFit(warp, light, maps.footprints[i], maps.served[i], axis, fit, hint);
      }
    }
    maps.neededTexels += fit.needed;
  }
}

bool shareTexels(const Frame& frame, const Splits& splits, const MapFits& maps, double* shares) noexcept {
  double sum = 0.0;
  for (int i = 0, m = 0; i < splits.count; ++i) {
    shares[i] = 0.0;
    if (maps.footprints[i].count == 0) continue;
    MapFit fit = maps.fits[i];
    shares[i] = fit.needed;
    if (const double motion = frame.margin.motion[m++]; motion > 0.0) {
      const double before = fit.size.x * fit.size.y;
      giveRoom(motion, fit);
      if (before > 0.0) shares[i] *= fit.size.x * fit.size.y / before;
    }
    sum += shares[i];
  }
  if (!(sum > 0.0 && sum < kInfinity)) return false;
  for (int i = 0; i < splits.count; ++i) shares[i] /= sum;
  return true;
}

Status makeMaps(const Frame& frame, const Region& region, const LightSpace& light, const Splits& splits, const MapSettings& settings,
                Solution& solution) noexcept {
  MapFits maps;
  fitMaps(frame, region, light, splits, settings, needsViewDepth(region, splits), maps);
  return placeMaps(frame, region, light, splits, settings, maps, solution);
}

Status placeMaps(const Frame& frame, const Region& region, const LightSpace& light, const Splits& splits, const MapSettings& settings,
                 MapFits& maps, Solution& solution) noexcept {
  solution.limitTexels = frame.samples ? 0.0 : limitTexels(region, light);  // what is sampled may need less
  if (splits.count == 0) {
    clearBlock(solution.block);
    return Status::ok;
  }
  double shares[kMaxPartitions];
  const bool isShared = settings.shares == Shares::error && shareTexels(frame, splits, maps, shares);
  for (int i = 0, m = 0; i < splits.count; ++i)
    if (maps.footprints[i].count > 0)
      if (const double motion = frame.margin.motion[m++]; motion > 0.0) giveRoom(motion, maps.fits[i]);
  Atlas atlas;
  if (const Status status = packAtlas(frame, maps.fits, isShared ? shares : nullptr, splits.count, atlas); status != Status::ok)
    return status;

  std::uint32_t warnings = region.warnings;
  if (atlas.reduced) warnings |= static_cast<std::uint32_t>(Warning::atlasReduced);
  if (maps.byViewDepth) warnings |= static_cast<std::uint32_t>(Warning::viewDepthSelection);
  const glm::dvec3 eyeMinusOrigin = region.eyeWs - solution.originWs;
  glm::dmat4 clipFromWorld[kMaxPartitions];
  CullShape cullShape;
  makeCaps(region, light, cullShape);
  Splits made;
  made.isWedged = splits.isWedged;
  if (splits.rows.count > 0) made.rows = splits.rows;
  // Stage after stage, so that maps wait for their own roots and divisions, not for one another's.
  int sliceOf[kMaxPartitions] = {};
  for (int i = 0; i < splits.count; ++i) {
    made.rows.cells[i] = maps.footprints[i].count == 0 ? -1 : made.count;
    if (maps.footprints[i].count == 0) continue;
    const int m = made.count++;
    sliceOf[m] = i;
    Partition& map = solution.partitions[m];
    MapFit& fit = maps.fits[i];
    made.slices[m] = splits.slices[i];
    if (splits.isWedged) made.wedges[m] = splits.wedges[i];
    map.near = splits.slices[i].near;
    map.far = splits.slices[i].far;
    map.viewport = atlas.viewports[i];
    map.layer = frame.shadowMap.layout == MapLayout::layers ? m : 0;
    if (const Status status = growToViewport(frame, region, light, maps.footprints[i], settings.fit, map.viewport, fit, warnings);
        status != Status::ok)
      return status;
    extendToCasters(frame.scene.casters, region, light, fit);
    cropMatrix(frame, light, eyeMinusOrigin, fit, clipFromWorld[m]);
  }
  for (int m = 0; m < made.count; ++m) {
    const int i = sliceOf[m];
    Partition& map = solution.partitions[m];
    map.clipFromWorld = glm::mat4(clipFromWorld[m]);
    map.error = maps.fits[i].isWarped ? certify(map.clipFromWorld, map.viewport, light, eyeMinusOrigin, maps.served[i])
                                      : certify(plainTexelSize(map.clipFromWorld, map.viewport), maps.pixels[i]);
    solution.maxError = std::max({solution.maxError, map.error.s, map.error.t});
    solution.neededTexels += map.error.s * map.error.t * map.viewport.z * map.viewport.w;
  }
  for (int m = 0; m < made.count; ++m) {
    const int i = sliceOf[m];
    Partition& map = solution.partitions[m];
    const MapFit& fit = maps.fits[i];
    const Footprint& footprint = maps.footprints[i];
    map.warp = fit.isWarped ? settings.warp.warp : Warp::none;
    map.planeCount = splits.isWedged ? writePlanes(region, splits.wedges[i], map.planes) : 0;
    const double texel = std::max(fit.stretch.x * fit.size.x / map.viewport.z, fit.stretch.y * fit.size.y / map.viewport.w);
    const double grow = texel * (1.0 + frame.margin.filter + frame.margin.normalOffset) + region.unevenness + frame.margin.motion[m];
    if (footprint.like == i) makeSides(region, light, footprint, cullShape);
    map.cullPlaneCount = makeCullPlanes(cullShape, footprint, grow, map.cullPlanes);
  }
  if (made.count == 0) {
    clearBlock(solution.block);
    return Status::ok;
  }
  solution.partitionCount = made.count;
  solution.depthClamp = frame.scene.casters.empty();
  solution.atlas = atlas.size;
  solution.layers = frame.shadowMap.layout == MapLayout::layers ? made.count : atlas.layers;
  solution.warnings = warnings;
  solution.storageFactor = solution.neededTexels / (frame.image.width * frame.image.height);
  const bool isFinite = writeBlock(frame, region, light, made, maps.byViewDepth, clipFromWorld, solution) &&
                        std::isfinite(solution.maxError) && std::isfinite(solution.storageFactor) && std::isfinite(solution.limitTexels);
  if (isFinite) return Status::ok;
  for (auto& partition : solution.block.partitions) partition = {};  // an answer of fewer maps, or none, leaves the others as they are
  return Status::floatRange;
}

}  // namespace gnomon
