#include "gnomon/lookup.h"

#include <algorithm>

namespace gnomon {
namespace {

// The last partition that has begun; starts never fall. -1 before the first and past the end of one without a neighbour.
int select(const GnomonBlock& block, const vec4* starts, float depth, int endComponent) noexcept {
  int begun = 0;
  for (int i = 0; i < GNOMON_MAX_PARTITIONS; ++i) begun += depth >= starts[i / 4][i % 4];
  if (begun == 0) return -1;
  return depth <= block.partitions[begun - 1].interval[endComponent] ? begun - 1 : -1;
}

}  // namespace

int selectByWindowDepth(const GnomonBlock& block, float windowDepth) noexcept {
  return select(block, block.windowStart, windowDepth * block.depthRule.x, 3);  // [Zhang 2006, eq. 8 corrected]
}

int selectByViewDepth(const GnomonBlock& block, float viewDepth) noexcept { return select(block, block.viewStart, viewDepth, 1); }

int selectByMask(const GnomonBlock& block, const glm::dvec3& world) noexcept {
  const glm::dvec4 p(world, 1.0);
  const auto at = [&](const vec4& plane) { return glm::dot(glm::dvec4(plane), p); };
  for (std::uint32_t i = 0; i < block.info.x; ++i) {
    const GnomonPartition& map = block.partitions[i];
    const double along = at(map.axis);
    const glm::dvec2 range(map.range);
    if (along >= range.x && along < range.y && at(map.left) >= 0.0 && at(map.right) >= 0.0) return static_cast<int>(i);
  }
  return -1;
}

double viewDepth(const GnomonBlock& block, const glm::dvec3& world) noexcept {
  const glm::dvec4 plane(block.viewPlane);
  return glm::dot(glm::dvec3(plane), world) + plane.w;
}

glm::dvec4 atlasPosition(const GnomonBlock& block, int partition, const glm::dvec3& world) noexcept {
  const GnomonPartition& map = block.partitions[partition];
  const glm::dvec4 q = glm::dmat4(map.atlasFromWorld) * glm::dvec4(world, 1.0), bounds(map.uvBounds), atlas(block.atlas);
  const glm::dvec3 p = glm::dvec3(q) / q.w;
  const bool isInside =
      q.w > 0.0 && p.x >= bounds.x - atlas.z && p.y >= bounds.y - atlas.w && p.x <= bounds.z + atlas.z && p.y <= bounds.w + atlas.w;
  return {p.x, p.y, std::clamp(p.z, 0.0, 1.0), isInside ? 1.0 : 0.0};
}

}  // namespace gnomon
