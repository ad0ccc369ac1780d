#include "gnomon/cast.h"

#include "numeric.h"

namespace gnomon {
namespace {

constexpr int kMaxSides = 12;  // of the swept prism; more hull edges than that are replaced by their bounding rectangle

}  // namespace

int makeCaps(const Region& region, const LightSpace& light, glm::dvec4* capsWs) noexcept {
  int count = 0;
  for (int i = 0; i < region.volume.planeCount; ++i) {
    const Plane& plane = region.volume.planes[i];
    const bool isDepth = plane.normal.x == 0.0 && plane.normal.y == 0.0;  // near or far: a slice's own are tighter
    if (isDepth || !(glm::dot(plane.normal, light.directionVs) < 0.0)) continue;
    const double scale = 1.0 / std::sqrt(glm::dot(plane.normal, plane.normal));
    const glm::dvec3 normalWs = region.worldFromView * plane.normal * scale;
    capsWs[count++] = glm::dvec4(normalWs, plane.offset * scale - glm::dot(normalWs, region.eyeWs));
  }
  return count;
}

int makeCullPlanes(const Region& region, const LightSpace& light, const Footprint& footprint, std::span<const glm::dvec4> capsWs,
                   double grow, glm::dvec4* planesWs) noexcept {
  int count = 0;
  const auto add = [&](const glm::dvec3& normalWs, double offset) {  // unit normal, offset from the eye
    if (count < kMaxCullPlanes) planesWs[count++] = glm::dvec4(normalWs, offset + grow - glm::dot(normalWs, region.eyeWs));
  };
  const glm::dmat4& ls = light.lsFromWorld;
  const glm::dvec3 x(ls[0][0], ls[1][0], ls[2][0]), y(ls[0][1], ls[1][1], ls[2][1]);
  const auto addSide = [&](const glm::dvec2& inward, double offset) { add(x * inward.x + y * inward.y, offset); };

  // Sides: planes through the light along the silhouette.
  if (footprint.count >= 3 && footprint.count <= kMaxSides) {
    for (int i = 0; i < footprint.count; ++i) {
      const glm::dvec2 p = footprint.hull[i], edge = footprint.hull[i + 1 < footprint.count ? i + 1 : 0] - p;
      const double squared = glm::dot(edge, edge);
      if (!(squared > 0.0)) continue;
      const glm::dvec2 inward = glm::dvec2(-edge.y, edge.x) * (1.0 / std::sqrt(squared));  // the hull runs counter-clockwise
      addSide(inward, -glm::dot(inward, p));
    }
  } else {
    glm::dvec2 least(kInfinity), greatest(-kInfinity);
    for (int i = 0; i < footprint.count; ++i) {
      least = glm::min(least, footprint.hull[i]);
      greatest = glm::max(greatest, footprint.hull[i]);
    }
    addSide({1.0, 0.0}, -least.x);
    addSide({-1.0, 0.0}, greatest.x);
    addSide({0.0, 1.0}, -least.y);
    addSide({0.0, -1.0}, greatest.y);
  }
  // Caps: faces that light leaves the region by stay where they are when it is swept towards the light.
  add(-light.directionWs, footprint.depthFar);
  const double along = light.directionVs.z;
  if (along < 0.0) add(region.worldFromView[2], -footprint.padded.near);
  if (along > 0.0) add(-region.worldFromView[2], footprint.padded.far);
  for (const glm::dvec4& cap : capsWs)
    if (count < kMaxCullPlanes) planesWs[count++] = glm::dvec4(glm::dvec3(cap), cap.w + grow);
  return count;
}

void extendToCasters(std::span<const Box> casters, const Region& region, const LightSpace& light, MapFit& fit) noexcept {
  if (casters.empty()) return;
  const glm::dmat4 rows = glm::transpose(light.lsFromWorld);
  const auto across = [&](const glm::dvec3& row) -> Plane { return {glm::dvec3(rows[0]) * row.x + glm::dvec3(rows[1]) * row.y, row.z}; };
  const glm::dvec2 most = fit.least + fit.size;
  const Plane sides[4] = {across(fit.s - fit.w * fit.least.x), across(fit.w * most.x - fit.s), across(fit.t - fit.w * fit.least.y),
                          across(fit.w * most.y - fit.t)};
  Cell cell;
  for (const Box& box : casters) {
    boxCell(box.minWs - region.eyeWs, box.maxWs - region.eyeWs, glm::dmat3(1.0), cell);
    bool isOver = true;
    for (const Plane& side : sides) isOver = isOver && cutCell(cell, side, std::abs(side.offset)) != Cut::outside;
    if (!isOver) continue;
    double nearest = kInfinity;
    for (int i = 0; i < cell.vertexCount; ++i) nearest = std::min(nearest, glm::dot(light.directionWs, cell.vertices[i]));
    if (nearest < fit.depthNear) fit.depthNear = nearest - (fit.depthFar - nearest) * 1e-6;  // strictly inside after rounding to float32
  }
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
