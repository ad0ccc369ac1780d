#include "predicted.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <glm/geometric.hpp>

#include "gnomon/camera.h"
#include "gnomon/error.h"

namespace gnomon::offscreen {
namespace {

constexpr std::uint8_t kNone = 255;

const Partition& mapOf(const Solution& solution, std::uint8_t index) {
  if (index >= solution.partitionCount) throw std::runtime_error("predicted: no such partition");
  return solution.partitions[index];
}

}  // namespace

PredictedError predictedError(const Frame& frame, const Solution& solution, const std::vector<float>& position,
                              const std::vector<std::uint8_t>& index, const std::vector<std::uint8_t>& counted) {
  if (position.size() != 3 * index.size() || counted.size() != index.size())
    throw std::runtime_error("predicted: pictures of different sizes");
  const glm::dvec3 forward = glm::normalize(frame.camera.forwardWs), light = glm::normalize(frame.light.directionWs);
  const glm::dvec3 eye = frame.camera.positionWs - solution.originWs;
  PredictedError result;
  double sum = 0.0;
  std::size_t over = 0;
  for (std::size_t i = 0; i < index.size(); ++i) {
    if (!counted[i] || index[i] == kNone) continue;
    const glm::dvec3 point(position[3 * i], position[3 * i + 1], position[3 * i + 2]);
    const Partition& map = mapOf(solution, index[i]);
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

double texelAcrossEdges(const Frame& frame, const Solution& solution, const RenderOutput& image, const std::vector<std::uint8_t>& truth,
                        const std::vector<std::uint8_t>& counted) {
  const auto width = static_cast<std::size_t>(image.width), height = static_cast<std::size_t>(image.height), size = width * height;
  if (image.position.size() != 3 * size || image.normal.size() != 3 * size || image.index.size() != size || truth.size() != size ||
      counted.size() != size)
    throw std::runtime_error("predicted: pictures of different sizes");
  const Camera& camera = frame.camera;
  const glm::dvec3 forward = glm::normalize(camera.forwardWs), right = glm::normalize(glm::cross(forward, camera.upWs));
  const glm::dvec3 eye = camera.positionWs - solution.originWs;
  const glm::dvec3 steps[2] = {right * ((camera.left + camera.right) / image.width),  // a pixel to the side and up, at depth 1
                               glm::cross(right, forward) * ((camera.down + camera.up) / image.height)};
  double sum = 0.0;
  std::size_t count = 0;
  const auto add = [&](std::size_t i, int across) {
    const auto at = [&](const std::vector<float>& of) { return glm::dvec3(of[3 * i], of[3 * i + 1], of[3 * i + 2]); };
    const Partition& map = mapOf(solution, image.index[i]);
    const glm::dvec3 point = at(image.position), normal = at(image.normal);
    const bool isPerspective = camera.projection == Projection::perspective;
    const double depth = glm::dot(point - eye, forward);
    const glm::dvec3 ray = isPerspective ? (point - eye) / depth : forward;
    const glm::dmat4 clipFromWorld(map.clipFromWorld);
    const glm::dvec4 clip = clipFromWorld * glm::dvec4(point, 1.0);
    const glm::dvec2 perNdc = glm::dvec2(map.viewport.z, map.viewport.w) / 2.0;
    glm::dvec2 texels[2];  // that a pixel to the side and up span on the surface
    for (int axis = 0; axis < 2; ++axis) {
      const glm::dvec3 step = steps[axis] * (isPerspective ? depth : 1.0);
      const glm::dvec3 moved = step - ray * (glm::dot(normal, step) / glm::dot(normal, ray));  // it stays on the surface
      const glm::dvec4 clipMoved = clipFromWorld * glm::dvec4(moved, 0.0);
      texels[axis] = (glm::dvec2(clipMoved) - glm::dvec2(clip) * (clipMoved.w / clip.w)) / clip.w * perNdc;
    }
    const double determinant = std::abs(texels[0].x * texels[1].y - texels[0].y * texels[1].x);
    const glm::dvec2 other = glm::abs(texels[1 - across]);
    if (!(determinant > 0.0 && std::isfinite(determinant))) return;  // a texel is a line there, or the surface is seen edge-on
    sum += (other.x + other.y) / determinant;  // of the parallelogram, by the inverse
    ++count;
  };
  const auto addEdge = [&](std::size_t a, std::size_t b, int across) {
    if (!counted[a] || !counted[b] || truth[a] == truth[b]) return;
    for (const std::size_t i : {a, b})
      if (image.index[i] != kNone) add(i, across);
  };
  for (std::size_t i = 0; i < size; ++i) {
    if ((i + 1) % width != 0) addEdge(i, i + 1, 0);
    if (i + width < size) addEdge(i, i + width, 1);
  }
  return count > 0 ? sum / static_cast<double>(count) : 0.0;
}

}  // namespace gnomon::offscreen
