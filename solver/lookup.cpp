#include "gnomon/lookup.h"

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

double viewDepth(const GnomonBlock& block, const glm::dvec3& world) noexcept {
  const glm::dvec4 plane(block.viewPlane);
  return glm::dot(glm::dvec3(plane), world) + plane.w;
}

glm::dvec3 atlasPosition(const GnomonBlock& block, int partition, const glm::dvec3& world) noexcept {
  const glm::dvec4 atlas = glm::dmat4(block.partitions[partition].atlasFromWorld) * glm::dvec4(world, 1.0);
  return glm::dvec3(atlas) / atlas.w;
}

}  // namespace gnomon
