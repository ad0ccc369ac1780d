#include "gnomon/maps.h"

#include "gnomon/atlas.h"
#include "gnomon/camera.h"
#include "gnomon/cast.h"
#include "gnomon/error.h"
#include "numeric.h"

namespace gnomon {
namespace {

// The least view depth of the region inside a slice: a pixel is narrowest there.
double nearestIn(const Region& region, const DepthSpan& slice) noexcept {
  for (int i = 0; i < region.spanCount; ++i)
    if (region.spans[i].far >= slice.near) return std::clamp(region.spans[i].near, slice.near, slice.far);
  return slice.near;
}

// Room on every side, in world units.
void giveRoom(double motion, MapFit& fit) noexcept {
  fit.least -= motion;
  fit.size += 2.0 * motion;
  fit.depthNear -= motion;
  fit.depthFar += motion;
}

}  // namespace

Status makeMaps(const Frame& frame, const Region& region, const LightSpace& light, const Splits& splits, FitMode mode,
                Solution& solution) noexcept {
  solution.limitTexels = limitTexels(frame);
  if (splits.count == 0) {
    clearBlock(solution.block);
    return Status::ok;
  }
  const bool byViewDepth = needsViewDepth(region, splits);
  Footprint footprints[kMaxPartitions];
  MapFit fits[kMaxPartitions];
  double pixels[kMaxPartitions];
  makeFootprints(region, light, splits, frame.margin, byViewDepth, footprints);
  for (int i = 0; i < splits.count; ++i) {
    pixels[i] = pixelWidth(frame.camera, frame.image, nearestIn(region, splits.slices[i]));
    fits[i] = fitSlice(region, footprints[i], mode, pixels[i]);
  }
  for (int i = 0, m = 0; i < splits.count; ++i)
    if (footprints[i].count > 0) giveRoom(frame.margin.motion[m++], fits[i]);
  Atlas atlas;
  if (const Status status = packAtlas(frame, fits, splits.count, atlas); status != Status::ok) return status;

  std::uint32_t warnings = region.warnings;
  if (atlas.reduced) warnings |= static_cast<std::uint32_t>(Warning::atlasReduced);
  if (byViewDepth) warnings |= static_cast<std::uint32_t>(Warning::viewDepthSelection);
  const glm::dvec3 eyeMinusOrigin = region.eyeWs - solution.originWs;
  glm::dmat4 clipFromWorld[kMaxPartitions];
  glm::dvec4 caps[kMaxCellPlanes];
  const std::span<const glm::dvec4> capsWs(caps, static_cast<std::size_t>(makeCaps(region, light, caps)));
  Splits made;
  for (int i = 0; i < splits.count; ++i) {
    if (footprints[i].count == 0) continue;
    const int m = made.count++;
    Partition& map = solution.partitions[m];
    MapFit& fit = fits[i];
    made.slices[m] = splits.slices[i];
    map.near = splits.slices[i].near;
    map.far = splits.slices[i].far;
    map.viewport = atlas.viewports[i];
    map.layer = frame.shadowMap.layout == MapLayout::layers ? m : 0;
    if (const Status status = growToViewport(frame, region, light, footprints[i], mode, map.viewport, fit, warnings); status != Status::ok)
      return status;
    extendToCasters(frame.scene.casters, region, light, fit);
    clipFromWorld[m] = cropMatrix(frame, light, eyeMinusOrigin, fit);
    map.clipFromWorld = glm::mat4(clipFromWorld[m]);
    map.error = certify(texelSize(map.clipFromWorld, map.viewport, light.directionWs), pixels[i]);
    const double texel = std::max(fit.size.x / map.viewport.z, fit.size.y / map.viewport.w);
    const double grow = texel * (1.0 + frame.margin.filter + frame.margin.normalOffset) + region.unevenness + frame.margin.motion[m];
    map.cullPlaneCount = makeCullPlanes(region, light, footprints[i], capsWs, grow, map.cullPlanes);
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
