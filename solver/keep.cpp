#include "gnomon/keep.h"

#include "gnomon/block.h"
#include "gnomon/error.h"
#include "gnomon/region.h"
#include "gnomon/split.h"
#include "numeric.h"

namespace gnomon {
namespace {

// The drawn matrix for positions relative to another origin.
glm::dmat4 rebase(const DrawnMaps::Map& map, const glm::dvec3& originWs) noexcept {
  glm::dmat4 clipFromWorld(map.partition.clipFromWorld);
  clipFromWorld[3] = clipFromWorld * glm::dvec4(originWs - map.originWs, 1.0);
  return clipFromWorld;
}

// Whether the map answers for a point. `margin`: texels that a lookup reaches sideways.
bool holds(const DrawnMaps::Map& map, const ShadowMap& shadowMap, double margin, const glm::dvec3& ws, double reach) noexcept {
  for (int i = 0; i < map.partition.cullPlaneCount; ++i) {
    const glm::dvec4& plane = map.partition.cullPlanes[i];
    if (!(glm::dot(glm::dvec3(plane), ws) + plane.w >= 0.0)) return false;
  }
  // Half of what a fit leaves for the rounding of a float32 product: a map always holds the slice that it was drawn for.
  constexpr double kPointRounding = 1.0 / 4194304.0;  // 2^-22
  const glm::dmat4 rows = glm::transpose(glm::dmat4(map.partition.clipFromWorld));
  const glm::dvec4 from(ws - map.originWs, 1.0);
  const double w = glm::dot(rows[3], from);
  for (int axis = 0; axis < 3; ++axis) {
    const glm::dvec3 row(rows[axis]);
    const double rounding = kPointRounding * reach * std::sqrt(glm::dot(row, row));
    const double most = axis < 2 ? 1.0 - 2.0 * margin / map.partition.viewport[2 + axis] : 1.0,
                 least = axis < 2 ? -most : (shadowMap.depth == DepthConvention::negativeOneToOne ? -1.0 : 0.0);
    const double at = glm::dot(rows[axis], from) / w;
    if (!(w > 0.0 && at - rounding >= least && at + rounding <= most)) return false;
  }
  return true;
}

// Whether the map answers for a slice of the region.
bool covers(const DrawnMaps::Map& map, const Frame& frame, const Region& region, const DepthSpan& slab,
            const glm::dvec3& originWs) noexcept {
  const double margin = frame.margin.filter + frame.margin.normalOffset;
  const auto holdsVs = [&](const glm::dvec3& vs) {
    const glm::dvec3 ws = region.worldFromView * vs + region.eyeWs, rel = ws - originWs;
    return holds(map, frame.shadowMap, margin, ws, std::sqrt(glm::dot(rel, rel)));
  };
  Cell storage;
  for (int i = 0; i < cellCount(region); ++i) {
    const Cell* cell = getCell(region, i, storage);
    if (!cell) continue;
    for (int v = 0; v < cell->vertexCount; ++v)
      if (cell->vertices[v].z >= slab.near && cell->vertices[v].z <= slab.far && !holdsVs(cell->vertices[v])) return false;
    for (int e = 0; e < cell->edgeCount; ++e) {
      const glm::dvec3 &p = cell->vertices[cell->edges[e].from], &q = cell->vertices[cell->edges[e].to];
      for (const double z : {slab.near, slab.far})
        if ((p.z < z) != (q.z < z) && !holdsVs(p + (q - p) * ((z - p.z) / (q.z - p.z)))) return false;
    }
  }
  return true;
}

// Puts the drawn map in the place of the solved one.
void take(const DrawnMaps::Map& map, const Frame& frame, int i, Solution& solution) noexcept {
  const glm::dmat4 clipFromWorld = rebase(map, solution.originWs);
  const glm::dvec3 direction = unit(frame.light.directionWs);
  Partition& solved = solution.partitions[i];
  const double perPixel = solved.error.extent / texelSize(solved.clipFromWorld, solved.viewport, direction).extent;
  solved.clipFromWorld = glm::mat4(clipFromWorld);
  const TexelError size = texelSize(solved.clipFromWorld, solved.viewport, direction);
  solved.error = {size.s * perPixel, size.t * perPixel, size.extent * perPixel};
  GnomonPartition& out = solution.block.partitions[i];
  out.clipFromWorld = solved.clipFromWorld;
  out.atlasFromWorld = mat4(atlasMatrix(frame, clipFromWorld, solved.viewport, solution.atlas));
}

// Warps and faces follow the view: only plain maps of whole slices are kept.
bool isPlain(const Partition& map) noexcept { return map.warp == Warp::none && map.planeCount == 0; }

bool isSamePlace(const Partition& a, const Partition& b) noexcept { return a.viewport == b.viewport && a.layer == b.layer; }

}  // namespace

std::uint32_t keepMaps(const Frame& frame, std::uint32_t wanted, DrawnMaps& drawn, Solution& solution) noexcept {
  const int count = solution.partitionCount;
  if (count == 0) return 0;  // nothing is drawn either
  const ShadowMap &now = frame.shadowMap, &then = drawn.shadowMap;
  const bool isSameTexture = drawn.atlas == solution.atlas && drawn.layers == solution.layers && now.depth == then.depth &&
                             now.style == then.style && now.layout == then.layout;
  Region region;
  Splits splits;
  int index = -1;
  double value = 0.0;
  std::uint32_t kept = 0;
  if (isSameTexture && wanted != 0 && makeRegion(frame, region, index, value) == Status::ok) {
    splits.count = count;
    for (int i = 0; i < count; ++i) splits.slices[i] = {solution.partitions[i].near, solution.partitions[i].far};
    const bool byViewDepth = (solution.block.info.y & GNOMON_FLAG_VIEW_DEPTH) != 0u;
    DepthSpan padded[kMaxPartitions];
    padSlices(region, splits, frame.margin, byViewDepth, padded);
    for (int i = 0; i < std::min(count, drawn.count); ++i) {
      const DrawnMaps::Map& map = drawn.maps[i];
      if ((wanted >> i & 1u) == 0u || !isSamePlace(map.partition, solution.partitions[i])) continue;
      if (!isPlain(map.partition) || !isPlain(solution.partitions[i])) continue;
      if (covers(map, frame, region, padded[i], solution.originWs)) kept |= 1u << i;
    }
  }
  drawn.count = count;
  drawn.atlas = solution.atlas;
  drawn.layers = solution.layers;
  drawn.shadowMap = frame.shadowMap;
  solution.maxError = solution.neededTexels = 0.0;
  for (int i = 0; i < count; ++i) {
    Partition& map = solution.partitions[i];
    if ((kept >> i & 1u) != 0u)
      take(drawn.maps[i], frame, i, solution);
    else
      drawn.maps[i] = {map, solution.originWs};
    solution.maxError = std::max({solution.maxError, map.error.s, map.error.t});
    solution.neededTexels += map.error.s * map.error.t * map.viewport.z * map.viewport.w;
  }
  solution.storageFactor = solution.neededTexels / (frame.image.width * frame.image.height);
  return kept;
}

}  // namespace gnomon
