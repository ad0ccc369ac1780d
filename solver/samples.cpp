#include "gnomon/samples.h"

#include "gnomon/camera.h"
#include "gnomon/footprint.h"
#include "numeric.h"

namespace gnomon {
namespace {

bool isReversed(const Camera& camera) noexcept { return camera.depth == DepthConvention::reversedZeroToOne; }

// Samples have depths in [0, 1), reversed ones in (0, 1]. NaN fails.
bool isSample(float depth, bool reversed) noexcept { return reversed ? depth > 0.0f && depth <= 1.0f : depth >= 0.0f && depth < 1.0f; }

// Least and greatest of the samples seen so far. Lanes of their own let a compiler keep them in vectors without reordering anything.
constexpr int kLanes = 16;
struct Extremes {
  float least[kLanes], greatest[kLanes];
};
constexpr float kAbove = 2.0f, kBelow = 0.0f;  // of none

// Sifts out NaN and the background; where what is left tells of other values that are no depth, a second pass sifts out those too.
template <bool kReversed, bool kSifted>
void findExtremes(const float* depths, int count, Extremes& so) noexcept {
  Extremes all = so;
  const auto add = [&](float depth, int lane) {
    const bool isFine = !kSifted || isSample(depth, kReversed);
    const float low = isFine && (!kReversed || depth > 0.0f) ? depth : kAbove,
                high = isFine && (kReversed || depth < 1.0f) ? depth : kBelow;
    all.least[lane] = low < all.least[lane] ? low : all.least[lane];
    all.greatest[lane] = high > all.greatest[lane] ? high : all.greatest[lane];
  };
  int i = 0;
  for (; i + kLanes <= count; i += kLanes)
    for (int lane = 0; lane < kLanes; ++lane) add(depths[i + lane], lane);
  for (; i < count; ++i) add(depths[i], 0);
  so = all;
}

template <bool kReversed, bool kSifted>
void findExtremes(const DepthImage& image, float& least, float& greatest) noexcept {
  Extremes all;
  std::fill_n(all.least, kLanes, kAbove);
  std::fill_n(all.greatest, kLanes, kBelow);
  for (int y = 0; y < image.height; ++y) findExtremes<kReversed, kSifted>(image.depths + y * image.stride, image.width, all);
  least = *std::min_element(all.least, all.least + kLanes);
  greatest = *std::max_element(all.greatest, all.greatest + kLanes);
  if (!kSifted && (least < 0.0f || greatest > 1.0f) && least != kAbove) findExtremes<kReversed, true>(image, least, greatest);
}

// View depth of a depth value, as gnomonSampleDepth.
float viewDepthOf(const SampleView& view, float depth) noexcept {
  const float t = view.law.z < 0.0f ? 1.0f - depth : depth, u = view.law.z < 0.0f ? depth : 1.0f - depth;
  const float z = view.law.x * u + view.law.y * t;  // without cancellation
  return view.law.w > 0.0f ? 1.0f / z : z;
}

}  // namespace

void sampleRange(const Camera& camera, const DepthImage& image, double& near, double& far) noexcept {
  float least = 0.0f, greatest = 0.0f;
  if (isReversed(camera))
    findExtremes<true, false>(image, least, greatest);
  else
    findExtremes<false, false>(image, least, greatest);
  near = kInfinity;
  far = -kInfinity;
  if (!isSample(least, isReversed(camera))) return;
  const double a = viewDepthAt(camera, static_cast<double>(least)), b = viewDepthAt(camera, static_cast<double>(greatest));
  near = std::min(a, b);
  far = std::max(a, b);
}

void windowEdges(const Camera& camera, double near, double far, std::span<float> edges) noexcept {
  const auto bins = static_cast<double>(edges.size() - 1);
  for (std::size_t i = 0; i < edges.size(); ++i) {
    const double z = i + 1 == edges.size() ? far : near * std::pow(far / near, static_cast<double>(i) / bins);
    edges[i] = static_cast<float>(windowDepth(camera, z));
  }
}

void sampleHistogram(const Camera& camera, const DepthImage& image, std::span<const float> edges,
                     std::span<std::uint32_t> counts) noexcept {
  std::fill(counts.begin(), counts.end(), 0u);
  const float sign = isReversed(camera) ? -1.0f : 1.0f;
  for (int y = 0; y < image.height; ++y) {
    const float* row = image.depths + y * image.stride;
    for (int x = 0; x < image.width; ++x) {
      if (!isSample(row[x], isReversed(camera))) continue;
      std::size_t bin = 0;  // begins at or before the sample
      for (std::size_t left = counts.size(); left > 1;) {
        const std::size_t half = left / 2;
        bin += sign * edges[bin + half] <= sign * row[x] ? half : 0;
        left -= half;
      }
      ++counts[bin];
    }
  }
}

Status lightForSamples(const Frame& frame, glm::dmat3& lsFromView) noexcept {
  double value = 0.0;
  if (const Status status = validate(frame.camera, value); status != Status::ok) return status;
  const glm::dvec3 direction = unit(frame.light.directionWs);
  if (!isFinite(frame.light.directionWs) || direction == glm::dvec3(0.0)) return Status::lightDirection;
  const glm::dvec3 x = planeAxis(direction), y = glm::cross(x, direction);
  lsFromView = glm::transpose(glm::dmat3(x, y, direction)) * viewAxes(frame.camera.forwardWs, frame.camera.upWs);
  return Status::ok;
}

SampleView sampleView(const Camera& camera, int width, int height, const glm::dmat3& lsFromView) noexcept {
  const bool isPerspective = camera.projection == Projection::perspective;
  const glm::dvec2 right(lsFromView[0]), up(lsFromView[1]), forward(lsFromView[2]);
  return {.law = glm::vec4(glm::dvec4(isPerspective ? 1.0 / camera.near : camera.near, isPerspective ? 1.0 / camera.far : camera.far,
                                      isReversed(camera) ? -1.0 : 1.0, isPerspective ? 1.0 : 0.0)),
          .corner = glm::vec4(glm::dvec4(-right * camera.left - up * camera.down, 0.0, 0.0)),
          .pixels = glm::vec4(glm::dvec4(right * ((camera.left + camera.right) / width), up * ((camera.down + camera.up) / height))),
          .forward = glm::vec4(glm::dvec4(forward, 0.0, 0.0))};
}

void sampleBounds(const Camera& camera, const DepthImage& image, const glm::dmat3& lsFromView, std::span<SampleBounds> bounds) noexcept {
  const std::size_t count = std::min<std::size_t>(bounds.size(), kMaxPartitions);
  const SampleView view = sampleView(camera, image.width, image.height, lsFromView);
  const bool reversed = isReversed(camera), isPerspective = camera.projection == Projection::perspective;
  float from[kMaxPartitions], to[kMaxPartitions];
  glm::vec2 least[kMaxPartitions], most[kMaxPartitions];
  for (std::size_t i = 0; i < count; ++i) {
    const double near = bounds[i].near - depthQuantum(camera, bounds[i].near), far = bounds[i].far + depthQuantum(camera, bounds[i].far);
    const double a = windowDepth(camera, camera.projection == Projection::perspective ? std::max(near, bounds[i].near / 2.0) : near),
                 b = windowDepth(camera, far);
    from[i] = static_cast<float>(std::min(a, b));
    to[i] = static_cast<float>(std::max(a, b));
    least[i] = glm::vec2(std::numeric_limits<float>::infinity());
    most[i] = -least[i];
  }
  constexpr int kRun = 256;  // pixels at a time, so that what is computed once stays near
  float lsX[kRun], lsY[kRun], depths[kRun];
  for (int y = 0; y < image.height; ++y)
    for (int start = 0; start < image.width; start += kRun) {
      const int run = std::min(kRun, image.width - start);
      const float* row = image.depths + y * image.stride + start;
      for (int x = 0; x < run; ++x) {
        depths[x] = isSample(row[x], reversed) ? row[x] : -1.0f;  // below every interval
        const float z = viewDepthOf(view, depths[x]), right = static_cast<float>(start + x) + 0.5f, up = static_cast<float>(y) + 0.5f;
        const float atX = view.corner.x + view.pixels.x * right + view.pixels.z * up,
                    atY = view.corner.y + view.pixels.y * right + view.pixels.w * up;
        lsX[x] = isPerspective ? (atX + view.forward.x) * z : atX + view.forward.x * z;
        lsY[x] = isPerspective ? (atY + view.forward.y) * z : atY + view.forward.y * z;
      }
      for (std::size_t i = 0; i < count; ++i)
        for (int x = 0; x < run; ++x) {
          const bool isInside = depths[x] >= from[i] && depths[x] <= to[i] && depths[x] >= 0.0f;
          if (!isInside) continue;
          least[i] = glm::min(least[i], glm::vec2(lsX[x], lsY[x]));
          most[i] = glm::max(most[i], glm::vec2(lsX[x], lsY[x]));
        }
    }
  for (std::size_t i = 0; i < count; ++i) {
    constexpr float kMost = std::numeric_limits<float>::max();  // an infinite far plane's last depth values lie beyond it
    bounds[i].least = glm::clamp(least[i], -kMost, kMost);
    bounds[i].most = glm::clamp(most[i], -kMost, kMost);
    if (!(least[i].x <= most[i].x)) bounds[i].far = -kInfinity;
  }
}

std::size_t keepBounds(std::span<SampleBounds> bounds) noexcept {
  return static_cast<std::size_t>(std::remove_if(bounds.begin(), bounds.end(), [](const SampleBounds& b) { return !(b.near <= b.far); }) -
                                  bounds.begin());
}

}  // namespace gnomon
