#include "gnomon/blend.h"

#include "numeric.h"

namespace gnomon {

float blendWeight(const GnomonBlock& block, int index, float viewDepth) noexcept {
  if (index < 0 || index + 1 >= GNOMON_MAX_PARTITIONS) return 0.0f;
  const vec4& band = block.partitions[index].layer;
  return std::clamp((viewDepth - band.y) * band.z, 0.0f, 1.0f);
}

}  // namespace gnomon
