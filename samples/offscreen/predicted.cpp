#include "predicted.h"

#include <algorithm>
#include <stdexcept>

#include <glm/geometric.hpp>

#include "gnomon/camera.h"
#include "gnomon/error.h"

namespace gnomon::offscreen {

PredictedError predictedError(const Frame& frame, const Solution& solution, const std::vector<float>& position,
                              const std::vector<std::uint8_t>& index, const std::vector<std::uint8_t>& counted) {
  constexpr std::uint8_t kNone = 255;
  if (position.size() != 3 * index.size() || counted.size() != index.size())
    throw std::runtime_error("predicted: pictures of different sizes");
  const glm::dvec3 forward = glm::normalize(frame.camera.forwardWs), light = glm::normalize(frame.light.directionWs);
  const glm::dvec3 eye = frame.camera.positionWs - solution.originWs;
  PredictedError result;
  double sum = 0.0;
  std::size_t over = 0;
  for (std::size_t i = 0; i < index.size(); ++i) {
    if (!counted[i] || index[i] == kNone) continue;
    if (index[i] >= solution.partitionCount) throw std::runtime_error("predicted: no such partition");
    const glm::dvec3 point(position[3 * i], position[3 * i + 1], position[3 * i + 2]);
    const Partition& map = solution.partitions[index[i]];
    const TexelError texel = texelSize(map.clipFromWorld, map.viewport, light, point);
    const double error = std::max(texel.s, texel.t) / pixelWidth(frame.camera, frame.image, glm::dot(point - eye, forward));
    ++result.served;
    sum += error;
    over += error > 1.0;
  }
  if (result.served == 0) return result;
  result.mean = sum / static_cast<double>(result.served);
  result.overOne = static_cast<double>(over) / static_cast<double>(result.served);
  return result;
}

}  // namespace gnomon::offscreen
