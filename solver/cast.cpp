#include "gnomon/cast.h"

#include "numeric.h"

namespace gnomon {
namespace {

constexpr int kMaxSides = 12;  // of the swept prism; more hull edges than that are replaced by their bounding rectangle

void addPlane(const Region& region, const glm::dvec3& normalWs, double offset, CullShape& shape) noexcept {
  if (shape.count == kMaxCullPlanes) return;
  shape.planesWs[shape.count] = glm::dvec4(normalWs, -glm::dot(normalWs, region.eyeWs));
  shape.offsets[shape.count++] = offset;
}

}  // namespace

void makeCaps(const Region& region, const LightSpace& light, CullShape& shape) noexcept {
  shape.count = 0;
  addPlane(region, -light.directionWs, 0.0, shape);
  const double along = light.directionVs.z;
  shape.hasEnd = along != 0.0;
  shape.isFar = along > 0.0;
  if (shape.hasEnd) addPlane(region, shape.isFar ? -region.worldFromView[2] : region.worldFromView[2], 0.0, shape);
  for (int i = 0; i < region.volume.planeCount; ++i) {
    const Plane& plane = region.volume.planes[i];
    const bool isDepth = plane.normal.x == 0.0 && plane.normal.y == 0.0;  // near or far: a slice's own are tighter
    if (isDepth || !(glm::dot(plane.normal, light.directionVs) < 0.0)) continue;
    if (shape.count + kMaxSides == kMaxCullPlanes) break;
    const glm::dvec3 inward = unit(plane.normal), size = glm::abs(plane.normal);  // squares of a half-space's may leave double's range
    const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
    addPlane(region, region.worldFromView * inward, plane.offset / plane.normal[axis] * inward[axis], shape);
  }
  shape.capCount = shape.count;
}

void makeSides(const Region& region, const LightSpace& light, const Footprint& footprint, CullShape& shape) noexcept {
  shape.count = shape.capCount;
  const glm::dmat4& ls = light.lsFromWorld;
  const glm::dvec3 x(ls[0][0], ls[1][0], ls[2][0]), y(ls[0][1], ls[1][1], ls[2][1]);
  glm::dvec2 least(kInfinity), greatest(-kInfinity);
  for (int i = 0; i < footprint.count; ++i) {
    least = glm::min(least, footprint.hull[i]);
    greatest = glm::max(greatest, footprint.hull[i]);
  }
  if (footprint.count >= 3 && footprint.count <= kMaxSides) {
    constexpr double kShortest = 1e-6;  // of the extent: the direction of a shorter edge is rounding, and its neighbours bound what it does
    const glm::dvec2 extent = greatest - least;
    const double shortest = kShortest * kShortest * glm::dot(extent, extent);
    for (int i = 0; i < footprint.count; ++i) {
      const glm::dvec2 p = footprint.hull[i], edge = footprint.hull[i + 1 < footprint.count ? i + 1 : 0] - p;
      const double squared = glm::dot(edge, edge);
      if (!(squared > shortest)) continue;
      const glm::dvec2 inward = glm::dvec2(-edge.y, edge.x) * (1.0 / std::sqrt(squared));  // the hull runs counter-clockwise
      addPlane(region, x * inward.x + y * inward.y, -glm::dot(inward, p), shape);
    }
    return;
  }
  addPlane(region, x, -least.x, shape);
  addPlane(region, -x, greatest.x, shape);
  addPlane(region, y, -least.y, shape);
  addPlane(region, -y, greatest.y, shape);
}

int makeCullPlanes(const CullShape& shape, const Footprint& footprint, double grow, glm::dvec4* planesWs) noexcept {
  int i = 0;
  const auto write = [&](double offset) {
    planesWs[i] = shape.planesWs[i];
    planesWs[i++].w += offset + grow;
  };
  // Caps stay where they are when the region is swept towards the light.
  write(footprint.depthFar);
  if (shape.hasEnd) write(shape.isFar ? footprint.padded.far : -footprint.padded.near);
  while (i < shape.capCount) write(shape.offsets[i]);
  while (i < shape.count) write(shape.offsets[i] * footprint.scale + footprint.apart);
  return shape.count;
}

void extendToCasters(std::span<const Box> casters, const Region& region, const LightSpace& light, MapFit& fit) noexcept {
  if (casters.empty()) return;
  const glm::dmat4 rows = glm::transpose(light.lsFromWorld);
  const auto across = [&](const glm::dvec3& row) -> Plane { return {glm::dvec3(rows[0]) * row.x + glm::dvec3(rows[1]) * row.y, row.z}; };
  const glm::dvec2 most = fit.least + fit.size;
  const Plane sides[4] = {across(fit.s - fit.w * fit.least.x), across(fit.w * most.x - fit.s), across(fit.t - fit.w * fit.least.y),
                          across(fit.w * most.y - fit.t)};
  double nearest = fit.depthNear;
  Cell cell;
  for (const Box& box : casters) {
    boxCell(box.minWs - region.eyeWs, box.maxWs - region.eyeWs, glm::dmat3(1.0), cell);
    bool isOver = true;
    for (const Plane& side : sides) isOver = isOver && cutCell(cell, side, std::abs(side.offset)) != Cut::outside;
    if (!isOver) continue;
    for (int i = 0; i < cell.vertexCount; ++i) nearest = std::min(nearest, glm::dot(light.directionWs, cell.vertices[i]));
  }
  if (!(nearest < fit.depthNear)) return;
  constexpr double kInside = 1e-6;  // of the range: strictly inside after rounding to float32
  const double range = fit.depthFar - nearest;
  fit.depthNear = nearest - range * (kInside + fit.depthLost);
  fit.depthFar += range * fit.depthLost;
}

bool mayCast(const Partition& partition, const Box& box) noexcept {
  for (int i = 0; i < partition.cullPlaneCount; ++i) {
    const glm::dvec4& plane = partition.cullPlanes[i];
    const glm::dvec3 normal(plane), farthest = glm::mix(box.minWs, box.maxWs, glm::greaterThan(normal, glm::dvec3(0.0)));
    if (glm::dot(normal, farthest) + plane.w < 0.0) return false;
  }
  return true;
}

}  // namespace gnomon
