#include "gnomon/frame.h"

#include "gnomon/camera.h"
#include "numeric.h"

namespace gnomon {

Status validate(const Frame& frame, double& value) noexcept {
  const auto isShare = [](double x) { return x >= 0.0 && x <= 1.0; };
  const auto isAmount = [](double x) { return x >= 0.0 && x < kInfinity; };
  if (const Status status = validate(frame.camera, value); status != Status::ok) return status;
  for (const double side : {frame.image.width, frame.image.height})
    if (value = side; !(side > 0.0 && std::isfinite(side))) return Status::imageSize;
  const Margin& margin = frame.margin;
  if (value = margin.filter; !isAmount(value)) return Status::marginFilter;
  if (value = margin.normalOffset; !isAmount(value)) return Status::marginNormalOffset;
  if (value = margin.blend; !(isShare(value) && value < 1.0)) return Status::marginBlend;
  constexpr int kMostBorder = 1024;
  if (value = margin.border; margin.border < 0 || margin.border > kMostBorder) return Status::marginBorder;
  for (const double motion : margin.motion)
    if (value = motion; !isAmount(value)) return Status::marginMotion;
  const Budget& budget = frame.budget;
  if (value = budget.partitions; budget.partitions < 1 || budget.partitions > kMaxPartitions) return Status::budgetPartitions;
  if (value = budget.resolution; budget.resolution < 1 || budget.resolution > kMaxTextureSide) return Status::budgetResolution;
  if (value = budget.texels; !(budget.texels == 0.0 || (budget.texels >= budget.partitions && std::isfinite(budget.texels))))
    return Status::budgetTexels;
  for (const int side : {budget.atlas.x, budget.atlas.y})
    if (value = side; side < 0 || side > kMaxTextureSide) return Status::budgetAtlas;
  if (value = budget.targetError; !(isAmount(value) && value > 0.0)) return Status::budgetTargetError;
  if (value = frame.bias.slope; !isAmount(value)) return Status::biasSlope;
  if (value = frame.bias.constant; !isAmount(value)) return Status::biasConstant;
  if (value = frame.fade; !isShare(value)) return Status::fade;
  return Status::ok;
}

Status refuse(Solution& solution, Status status) noexcept {
  const int index = solution.refusedIndex;
  const double value = solution.refusedValue;
  clear(solution);
  clearBlock(solution.block);
  solution.refusedIndex = index;
  solution.refusedValue = value;
  return solution.status = status;
}

void clear(Solution& solution) noexcept {
  solution.status = Status::ok;
  solution.refusedIndex = -1;
  solution.refusedValue = 0.0;
  solution.warnings = 0;
  solution.partitionCount = 0;
  solution.atlas = glm::ivec2(0);
  solution.layers = 0;
  solution.depthClamp = false;
  solution.maxError = solution.neededTexels = solution.storageFactor = solution.limitTexels = 0.0;
}

}  // namespace gnomon
