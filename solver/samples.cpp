#include "gnomon/samples.h"

#include <bit>

#include "gnomon/camera.h"
#include "gnomon/footprint.h"
#include "gnomon/region.h"
#include "numeric.h"

namespace gnomon {
namespace {

bool isReversed(const Camera& camera) noexcept { return camera.depth == DepthConvention::reversedZeroToOne; }

int rowCount(const DepthImage& image) noexcept { return image.depths ? image.height : 0; }

const float* rowAt(const DepthImage& image, int y) noexcept { return image.depths + y * (image.stride != 0 ? image.stride : image.width); }

// Samples have depths in [0, 1), reversed ones in (0, 1]. NaN fails.
bool isSample(float depth, bool reversed) noexcept { return reversed ? depth > 0.0f && depth <= 1.0f : depth >= 0.0f && depth < 1.0f; }

// Least and greatest of the samples seen so far. Lanes of their own let a compiler keep them in vectors without reordering anything.
constexpr int kLanes = 16;
struct Extremes {
  float least[kLanes], greatest[kLanes];
};
constexpr float kAbove = 2.0f, kBelow = 0.0f;  // of none
constexpr auto kAboveBits = std::bit_cast<std::int32_t>(kAbove), kOneBits = std::bit_cast<std::int32_t>(1.0f);

// Sifts out NaN and the background; where what is left tells of other values that are no depth, a second pass sifts out those too.
template <bool kReversed, bool kSifted>
void findExtremes(const float* depths, int count, Extremes& so) noexcept {
  Extremes all = so;
  const auto add = [&](float depth, int lane) {
    // The background is told by integers, which rise as floats do where these are not negative: fewer operations wait for the same unit.
    const auto bits = std::bit_cast<std::int32_t>(depth);
    const bool isFine = !kSifted || isSample(depth, kReversed);
    float low = kReversed ? std::bit_cast<float>(bits | (bits <= 0 ? kAboveBits : 0)) : depth,
          high = kReversed || bits < kOneBits ? depth : kBelow;
    if (!isFine) low = kAbove, high = kBelow;
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
  for (int y = 0; y < rowCount(image); ++y) findExtremes<kReversed, kSifted>(rowAt(image, y), image.width, all);
  least = *std::min_element(all.least, all.least + kLanes);
  greatest = *std::max_element(all.greatest, all.greatest + kLanes);
  if (!kSifted && (least < 0.0f || greatest > 1.0f) && least != kAbove) findExtremes<kReversed, true>(image, least, greatest);
}

// Finds the bin of a depth value: a table by the leading bits of its distance from the far end says where to begin, comparisons with the
// edges decide. Bins of equal ratio in view depth take about one comparison each.
class BinFinder {
 public:
  // sign * starts: where bins 1, 2, .. begin, rising from the eye.
  BinFinder(const float* starts, std::size_t count, bool isReversed) noexcept
      : m_starts(starts), m_count(static_cast<std::uint32_t>(count)), m_isReversed(isReversed) {
    if (count == 0) return;
    m_first = bitsOf(starts[0]);
    const std::uint32_t last = std::min(bitsOf(starts[count - 1]), m_first);
    while ((m_first - last) >> m_shift >= kCells) ++m_shift;
    m_cells = ((m_first - last) >> m_shift) + 1;
    std::fill_n(m_before, m_cells + 1, 0u);
    for (std::size_t i = 0; i < count; ++i) ++m_before[std::min(cellOf(starts[i]), m_cells - 1) + 1];
    for (std::uint32_t c = 0; c < m_cells; ++c) m_before[c + 1] += m_before[c];
  }

  std::uint32_t operator()(float depth) const noexcept {
    if (m_count == 0) return 0;
    std::uint32_t bin = m_before[std::min(cellOf(depth), m_cells)];
    while (bin < m_count && (m_isReversed ? depth <= m_starts[bin] : depth >= m_starts[bin])) ++bin;
    return bin;
  }

 private:
  static constexpr std::uint32_t kCells = 4096;

  // Falls as view depth grows; of what is behind the far end, 0.
  std::uint32_t bitsOf(float depth) const noexcept {
    const float left = m_isReversed ? depth : 1.0f - depth;
    return left > 0.0f ? std::bit_cast<std::uint32_t>(left) : 0u;
  }
  std::uint32_t cellOf(float depth) const noexcept {
    const std::uint32_t bits = bitsOf(depth);
    return bits >= m_first ? 0u : (m_first - bits) >> m_shift;
  }

  const float* m_starts;
  std::uint32_t m_count, m_first = 0, m_shift = 16, m_cells = 1;
  bool m_isReversed;
  std::uint32_t m_before[kCells + 1];  // starts in earlier cells
};

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
  const int bins = static_cast<int>(edges.size()) - 1;
  for (int i = 0; i <= bins; ++i)
    edges[static_cast<std::size_t>(i)] = static_cast<float>(windowDepth(camera, depthBetween(near, far, i, bins, true)));
}

void sampleHistogram(const Camera& camera, const DepthImage& image, std::span<const float> edges,
                     std::span<std::uint32_t> counts) noexcept {
  std::fill(counts.begin(), counts.end(), 0u);
  const std::size_t bins = std::min(counts.size(), std::max<std::size_t>(edges.size(), 1) - 1);
  if (bins == 0) return;
  const bool reversed = isReversed(camera);
  const BinFinder find(edges.data() + 1, bins - 1, reversed);
  for (int y = 0; y < rowCount(image); ++y) {
    const float* row = rowAt(image, y);
    for (int x = 0; x < image.width; ++x)
      if (isSample(row[x], reversed)) ++counts[find(row[x])];
  }
}

Status lightForSamples(const Frame& frame, glm::dmat3& lsFromView) noexcept {
  double value = 0.0;
  if (const Status status = validate(frame.camera, value); status != Status::ok) return status;
  const glm::dvec3 direction = unit(frame.light.directionWs);
  if (!isFinite(frame.light.directionWs) || direction == glm::dvec3(0.0)) return Status::lightDirection;
  const glm::dmat3 worldFromView = viewAxes(frame.camera.forwardWs, frame.camera.upWs);
  const glm::dvec3 x = boundsAxis(direction, worldFromView[0]), y = glm::cross(x, direction);
  lsFromView = glm::transpose(glm::dmat3(x, y, direction)) * worldFromView;
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
  constexpr std::size_t kMost = 256;  // intervals at once
  if (bounds.size() > kMost) sampleBounds(camera, image, lsFromView, bounds.subspan(kMost));
  bounds = bounds.first(std::min(bounds.size(), kMost));
  const std::size_t count = bounds.size();
  const SampleView view = sampleView(camera, image.width, image.height, lsFromView);
  const bool reversed = isReversed(camera), isPerspective = camera.projection == Projection::perspective;
  // The ends of all intervals cut depth into cells; those between an interval's own ends are its samples.
  constexpr float kInf = std::numeric_limits<float>::infinity();
  constexpr float kMax = std::numeric_limits<float>::max();  // an infinite far plane's last depth values lie beyond it
  float first[kMost], end[kMost], starts[2 * kMost];
  for (std::size_t i = 0; i < count; ++i) {
    const auto room = [&](double z) { return std::max(depthQuantum(camera, z), viewQuantum(camera, z)); };
    // Nothing lies before the near plane; a perspective depth has no meaning at the eye and behind it.
    const auto windowAt = [&](double z) {
      return static_cast<float>(windowDepth(camera, isPerspective ? std::max(z, camera.near / 2.0) : z));
    };
    first[i] = windowAt(bounds[i].near - room(bounds[i].near));
    end[i] = std::nextafter(windowAt(bounds[i].far + room(bounds[i].far)), reversed ? -kInf : kInf);
    starts[2 * i] = first[i];
    starts[2 * i + 1] = end[i];
  }
  const auto isBefore = [&](float a, float b) { return reversed ? a > b : a < b; };
  std::sort(starts, starts + 2 * count, isBefore);
  const auto cells = static_cast<std::size_t>(std::unique(starts, starts + 2 * count) - starts);
  struct Extent {
    float most[4];  // of -x, -y, x, y
  };
  Extent extents[2 * kMost + 1];  // cell c begins at start c - 1
  std::fill_n(&extents[0].most[0], 4 * (cells + 1), -kInf);
  const BinFinder find(starts, cells, reversed);
  constexpr int kRun = 256;  // pixels at a time: their positions by vectors, then where they go
  float lsX[kRun], lsY[kRun];
  for (int y = 0; y < rowCount(image); ++y)
    for (int start = 0; start < image.width; start += kRun) {
      const int run = std::min(kRun, image.width - start);
      const float* row = rowAt(image, y) + start;
      const float up = static_cast<float>(y) + 0.5f;
      for (int x = 0; x < run; ++x) {
        const float z = std::min(viewDepthOf(view, row[x]), kMax), right = static_cast<float>(start + x) + 0.5f;
        const float atX = view.corner.x + view.pixels.x * right + view.pixels.z * up,
                    atY = view.corner.y + view.pixels.y * right + view.pixels.w * up;
        lsX[x] = std::clamp(isPerspective ? (atX + view.forward.x) * z : atX + view.forward.x * z, -kMax, kMax);
        lsY[x] = std::clamp(isPerspective ? (atY + view.forward.y) * z : atY + view.forward.y * z, -kMax, kMax);
      }
      for (int x = 0; x < run; ++x) {
        if (!isSample(row[x], reversed)) continue;
        float* most = extents[find(row[x])].most;
        const float at[4] = {-lsX[x], -lsY[x], lsX[x], lsY[x]};
        for (int k = 0; k < 4; ++k) most[k] = at[k] > most[k] ? at[k] : most[k];
      }
    }
  for (std::size_t i = 0; i < count; ++i) {
    Extent all{{-kInf, -kInf, -kInf, -kInf}};
    const float *from = std::lower_bound(starts, starts + cells, first[i], isBefore),
                *to = std::lower_bound(starts, starts + cells, end[i], isBefore);
    for (const float* cell = from; cell < to; ++cell)
      for (int k = 0; k < 4; ++k) all.most[k] = std::max(all.most[k], extents[cell - starts + 1].most[k]);
    const bool isNone = all.most[0] == -kInf;
    bounds[i].least = isNone ? glm::dvec2(kMax) : glm::dvec2(-all.most[0], -all.most[1]);
    bounds[i].most = isNone ? glm::dvec2(-kMax) : glm::dvec2(all.most[2], all.most[3]);
    if (isNone) bounds[i].far = -kInfinity;
  }
}

std::size_t keepBounds(std::span<SampleBounds> bounds) noexcept {
  return static_cast<std::size_t>(std::remove_if(bounds.begin(), bounds.end(), [](const SampleBounds& b) { return !(b.near <= b.far); }) -
                                  bounds.begin());
}

Status takeSamples(const Frame& frame, const DepthImage& image, SampleStore& store, Samples& samples) noexcept {
  glm::dmat3 lsFromView;
  if (const Status status = lightForSamples(frame, lsFromView); status != Status::ok) return status;
  const Camera& camera = frame.camera;
  sampleRange(camera, image, samples.near, samples.far);
  samples.histogram = {};
  samples.bounds = {};
  samples.rightWs = viewAxes(camera.forwardWs, camera.upWs)[0];
  if (!(samples.near <= samples.far)) return Status::ok;
  const bool isRatio = samples.near > 0.0;
  if (isRatio) {
    float edges[kSampleBins + 1];
    windowEdges(camera, samples.near, samples.far, edges);
    sampleHistogram(camera, image, edges, store.histogram);
    samples.histogram = store.histogram;
  }
  for (int i = 0; i < kSampleBins; ++i) {
    const auto edge = [&](int k) { return depthBetween(samples.near, samples.far, k, kSampleBins, isRatio); };
    store.bounds[i] = {edge(i), edge(i + 1), glm::dvec2(0.0), glm::dvec2(0.0)};
  }
  sampleBounds(camera, image, lsFromView, store.bounds);
  samples.bounds = std::span(store.bounds).first(keepBounds(store.bounds));
  return Status::ok;
}

}  // namespace gnomon
