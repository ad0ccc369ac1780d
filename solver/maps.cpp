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

void fitMaps(const Frame& frame, const Region& region, const LightSpace& light, const Splits& splits, const MapSettings& settings,
             bool byViewDepth, MapFits& maps) noexcept {
  makeFootprints(region, light, splits, frame.margin, byViewDepth, maps.footprints);
  for (int i = 0; i < splits.count; ++i) maps.pixels[i] = pixelWidth(frame.camera, frame.image, nearestIn(region, splits.slices[i]));
  maps.hasServed = splits.isWedged || settings.warp.warp != Warp::none;
  if (maps.hasServed) gatherServed(region, light, splits, maps.served);
  if (splits.isWedged)  // a wedge's nearest point decides, not the region's
    for (int i = 0; i < splits.count; ++i)
      if (const Served& served = maps.served[i]; served.count > 0)
        maps.pixels[i] = *std::min_element(served.pixels, served.pixels + served.count);
  fitSlices(region, maps.footprints, splits.count, settings.fit, maps.pixels, maps.fits);
  for (int i = 0; settings.rectangles && i < splits.count; ++i) {
    maps.fits[i].least = settings.rectangles[i].least;
    maps.fits[i].size = settings.rectangles[i].size;
  }
  const glm::dvec2 view(light.lsFromView[2]);
  const double length = std::sqrt(glm::dot(view, view));
  maps.neededTexels = 0.0;
  for (int i = 0; i < splits.count; ++i) {
    if (maps.hasServed) {
      const glm::dvec2 axis = splits.isWedged ? wedgeAxis(splits.wedges[i], light) : length > 0.0 ? view / length : glm::dvec2(0.0);
      const bool isKnown = i > 0 && isScaled(maps.footprints[i - 1], maps.footprints[i]);  // one search serves them all
      maps.shapes[i] =
          warpFit(settings.warp, light, maps.footprints[i], maps.served[i], axis, isKnown ? &maps.shapes[i - 1] : nullptr, maps.fits[i]);
    }
    const MapFit& fit = maps.fits[i];
    maps.needed[i] = maps.footprints[i].count == 0 ? 0.0
                     : fit.isWarped                ? neededTexels(maps.served[i], maps.shapes[i])
                                                   : fit.size.x * fit.size.y / (maps.pixels[i] * maps.pixels[i]);
    maps.neededTexels += maps.needed[i];
  }
}

Status makeMaps(const Frame& frame, const Region& region, const LightSpace& light, const Splits& splits, const MapSettings& settings,
                Solution& solution) noexcept {
  solution.limitTexels = limitTexels(frame);
  if (splits.count == 0) {
    clearBlock(solution.block);
    return Status::ok;
  }
  const bool byViewDepth = needsViewDepth(region, splits);
  MapFits maps;
  fitMaps(frame, region, light, splits, settings, byViewDepth, maps);
  for (int i = 0, m = 0; i < splits.count; ++i)
    if (maps.footprints[i].count > 0) giveRoom(frame.margin.motion[m++], maps.fits[i]);
  double shares[kMaxPartitions];
  for (int i = 0; i < splits.count; ++i) shares[i] = maps.needed[i] / maps.neededTexels;
  Atlas atlas;
  const bool isShared = settings.shares == Shares::error && maps.neededTexels > 0.0;
  if (const Status status = packAtlas(frame, maps.fits, isShared ? shares : nullptr, splits.count, atlas); status != Status::ok)
    return status;

  std::uint32_t warnings = region.warnings;
  if (atlas.reduced) warnings |= static_cast<std::uint32_t>(Warning::atlasReduced);
  if (byViewDepth) warnings |= static_cast<std::uint32_t>(Warning::viewDepthSelection);
  const glm::dvec3 eyeMinusOrigin = region.eyeWs - solution.originWs;
  glm::dmat4 clipFromWorld[kMaxPartitions];
  glm::dvec4 caps[kMaxCellPlanes];
  const std::span<const glm::dvec4> capsWs(caps, static_cast<std::size_t>(makeCaps(region, light, caps)));
  Splits made;
  for (int i = 0; i < splits.count; ++i) {
    if (maps.footprints[i].count == 0) continue;
    const int m = made.count++;
    Partition& map = solution.partitions[m];
    MapFit& fit = maps.fits[i];
    made.slices[m] = splits.slices[i];
    made.isWedged = splits.isWedged;
    if (splits.isWedged) made.wedges[m] = splits.wedges[i];
    map.near = splits.slices[i].near;
    map.far = splits.slices[i].far;
    map.viewport = atlas.viewports[i];
    map.layer = frame.shadowMap.layout == MapLayout::layers ? m : 0;
    if (const Status status = growToViewport(frame, region, light, maps.footprints[i], settings.fit, map.viewport, fit, warnings);
        status != Status::ok)
      return status;
    extendToCasters(frame.scene.casters, region, light, fit);
    clipFromWorld[m] = cropMatrix(frame, light, eyeMinusOrigin, fit);
    map.clipFromWorld = glm::mat4(clipFromWorld[m]);
    map.error = fit.isWarped ? certify(map.clipFromWorld, map.viewport, light, eyeMinusOrigin, maps.served[i])
                             : certify(texelSize(map.clipFromWorld, map.viewport, light.directionWs), maps.pixels[i]);
    map.warp = fit.isWarped ? settings.warp.warp : Warp::none;
    map.planeCount = splits.isWedged ? writePlanes(region, splits.wedges[i], map.planes) : 0;
    const double texel = std::max(fit.stretch.x * fit.size.x / map.viewport.z, fit.stretch.y * fit.size.y / map.viewport.w);
    const double grow = texel * (1.0 + frame.margin.filter + frame.margin.normalOffset) + region.unevenness + frame.margin.motion[m];
    map.cullPlaneCount = makeCullPlanes(region, light, maps.footprints[i], capsWs, grow, map.cullPlanes);
    solution.maxError = std::max({solution.maxError, map.error.s, map.error.t});
    solution.neededTexels += map.error.s * map.error.t * map.viewport.z * map.viewport.w;
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
  return writeBlock(frame, region, light, made, byViewDepth, clipFromWorld, solution) ? Status::ok : Status::floatRange;
}

}  // namespace gnomon
