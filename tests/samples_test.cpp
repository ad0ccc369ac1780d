#include <algorithm>
#include <limits>

#include "support.h"

#include "allocations.h"

namespace gnomon::test {
namespace {

constexpr DepthConvention kDepths[] = {DepthConvention::negativeOneToOne, DepthConvention::zeroToOne, DepthConvention::reversedZeroToOne};

// gl_FragCoord.z from the projection matrices of the APIs' manuals, in double.
double windowOf(const Camera& camera, double z) {
  const double n = camera.near, f = camera.far;
  double d = camera.projection == Projection::orthographic ? (z - n) / (f - n)
             : std::isfinite(f)                            ? f * (z - n) / (z * (f - n))
                                                           : 1.0 - n / z;
  return camera.depth == DepthConvention::reversedZeroToOne ? 1.0 - d : d;
}

struct Picture {
  Camera camera;
  int width = 0, height = 0;
  std::vector<float> depths;
  DepthImage image() const { return {depths.data(), width, height}; }  // rows without gaps need no stride
};

// Depths of all sizes with the background, NaN and values that are no depth between them.
Picture randomPicture(Random& random, int width, int height, DepthConvention depth, int view) {
  Picture picture{usualFrame().camera, width, height, {}};
  if (view == 1) picture.camera.far = kInfinity, picture.camera.shadowDistance = 100.0;
  if (view == 2) picture.camera = orthographic({0, 0, 0}, {0, 0, -1}, {0, 1, 0}, 20.0, 1.5, -15.0, 80.0);
  if (view == 3) picture.camera.left *= 0.3, picture.camera.up *= 1.4, picture.camera.down *= -0.1;
  picture.camera.depth = depth;
  const float background = depth == DepthConvention::reversedZeroToOne ? 0.0f : 1.0f;
  const float none[] = {background, background, std::numeric_limits<float>::quiet_NaN(),
                        -0.5f,      1.5f,       std::numeric_limits<float>::infinity()};
  for (int i = 0; i < width * height; ++i) {
    const double z = view == 2 ? random.uniform(-14.0, 79.0) : random.logUniform(0.2, 90.0);
    picture.depths.push_back(random.index(3) == 0 && width > 1 ? none[random.index(6)] : static_cast<float>(windowOf(picture.camera, z)));
  }
  return picture;
}

bool isSample(const Picture& picture, float d) {
  return picture.camera.depth == DepthConvention::reversedZeroToOne ? d > 0.0f && d <= 1.0f : d >= 0.0f && d < 1.0f;
}

// The view depth whose window depth a value is, by bisection of the formula above.
double viewOf(const Camera& camera, float d) {
  double low = camera.projection == Projection::orthographic ? camera.near : camera.near * 0.5, high = 1e7;
  const double sign = camera.depth == DepthConvention::reversedZeroToOne ? -1.0 : 1.0;
  for (int i = 0; i < 200; ++i) {
    const double middle = (low + high) / 2.0;
    (sign * windowOf(camera, middle) < sign * static_cast<double>(d) ? low : high) = middle;
  }
  return (low + high) / 2.0;
}

constexpr glm::ivec2 kSizes[] = {{1, 1}, {17, 9}, {64, 64}, {333, 7}};

TEST(Samples, RangeIsThatOfTheSamples) {
  Random random(71);
  for (const DepthConvention depth : kDepths)
    for (int view = 0; view < 4; ++view)
      for (const glm::ivec2 size : kSizes) {
        const Picture picture = randomPicture(random, size.x, size.y, depth, view);
        double near = kInfinity, far = -kInfinity;
        for (const float d : picture.depths)
          if (isSample(picture, d)) {
            near = std::min(near, viewOf(picture.camera, d));
            far = std::max(far, viewOf(picture.camera, d));
          }
        double foundNear, foundFar;
        sampleRange(picture.camera, picture.image(), foundNear, foundFar);
        EXPECT_NEAR(foundNear, near, 1e-7 * std::abs(near));
        EXPECT_NEAR(foundFar, far, 1e-7 * std::abs(far));
        // Rows with gaps between them, top row first.
        std::vector<float> loose(static_cast<std::size_t>((size.x + 5) * size.y), 0.5f);
        for (int y = 0; y < size.y; ++y)
          std::copy_n(picture.depths.data() + y * size.x, size.x, loose.data() + (size.y - 1 - y) * (size.x + 5));
        double again, againFar;
        sampleRange(picture.camera, {loose.data() + (size.y - 1) * (size.x + 5), size.x, size.y, -(size.x + 5)}, again, againFar);
        EXPECT_EQ(again, foundNear);
        EXPECT_EQ(againFar, foundFar);
      }
}

// An empty view has no samples: what Samples says as it stands, and a solve answers with no partitions.
TEST(Samples, NothingIsNoError) {
  for (const DepthConvention depth : kDepths) {
    Frame frame = usualFrame();
    frame.camera.depth = depth;
    const float background = depth == DepthConvention::reversedZeroToOne ? 0.0f : 1.0f;
    for (const float value : {background, std::numeric_limits<float>::quiet_NaN(), 2.0f, -1.0f}) {
      const std::vector<float> depths(77, value);
      Samples samples;
      sampleRange(frame.camera, {depths.data(), 11, 7, 11}, samples.near, samples.far);
      EXPECT_EQ(samples.near, kInfinity);
      EXPECT_EQ(samples.far, -kInfinity);
      frame.samples = &samples;
      Solution solution;
      SdsmState state;
      EXPECT_EQ(solveSdsm(frame, {}, state, solution), Status::ok);
      EXPECT_EQ(solution.partitionCount, 0);
      EXPECT_EQ(solution.block.info.x, 0u);
      EXPECT_EQ(solve(frame)->partitionCount, 0);
    }
    // No image at all.
    const DepthImage none{nullptr, 11, 7};
    Samples samples;
    sampleRange(frame.camera, none, samples.near, samples.far);
    EXPECT_EQ(samples.near, kInfinity);
    EXPECT_EQ(samples.far, -kInfinity);
    const float edges[] = {0.25f, 0.5f, 0.75f};
    std::uint32_t counts[] = {9u, 9u};
    sampleHistogram(frame.camera, none, edges, counts);
    EXPECT_EQ(counts[0] + counts[1], 0u);
    SampleBounds bounds[] = {{1.0, 10.0, {}, {}}};
    sampleBounds(frame.camera, none, glm::dmat3(1.0), bounds);
    EXPECT_EQ(keepBounds(bounds), 0u);
  }
}

TEST(Samples, HistogramCountsEverySampleOnce) {
  Random random(72);
  for (const DepthConvention depth : kDepths)
    for (const int view : {0, 1, 3})
      for (const std::size_t bins : {std::size_t{1}, std::size_t{2}, std::size_t{100}, std::size_t{256}}) {
        const Picture picture = randomPicture(random, 61, 33, depth, view);
        std::vector<float> edges(bins + 1);
        std::vector<std::uint32_t> counts(bins, 99u), expected(bins, 0u);
        windowEdges(picture.camera, 0.3, 60.0, edges);
        for (std::size_t i = 0; i <= bins; ++i)
          EXPECT_NEAR(viewOf(picture.camera, edges[i]) / (0.3 * std::pow(200.0, static_cast<double>(i) / static_cast<double>(bins))), 1.0,
                      view == 1 ? 2e-4 : 1e-4);
        sampleHistogram(picture.camera, picture.image(), edges, counts);
        const float sign = depth == DepthConvention::reversedZeroToOne ? -1.0f : 1.0f;
        for (const float d : picture.depths) {
          if (!isSample(picture, d)) continue;
          std::size_t bin = 0;
          for (std::size_t i = 1; i < bins; ++i) bin += sign * d >= sign * edges[i];
          ++expected[bin];
        }
        EXPECT_EQ(counts, expected);
      }
}

// Bounds are those of the samples' positions, from the tangents of the view, in double.
TEST(Samples, BoundsHoldTheSamples) {
  Random random(73);
  for (const DepthConvention depth : kDepths)
    for (int view = 0; view < 4; ++view) {
      const Picture picture = randomPicture(random, 97, 31, depth, view);
      Frame frame = usualFrame();
      frame.camera = picture.camera;
      frame.light.directionWs = random.direction();
      glm::dmat3 lsFromView;
      ASSERT_EQ(lightForSamples(frame, lsFromView), Status::ok);
      SampleBounds bounds[] = {{0.25, 2.0, {}, {}}, {2.0, 7.0, {}, {}}, {20.0, 91.0, {}, {}}, {200.0, 300.0, {}, {}}};
      if (view == 2) bounds[0] = {-14.0, -2.0, {}, {}}, bounds[1] = {-2.0, 7.0, {}, {}};  // an orthographic view reaches behind its eye
      if (view == 3) bounds[0].near = depth == DepthConvention::zeroToOne ? 0.0 : -1.0;  // nothing is there, and that is no error
      sampleBounds(frame.camera, picture.image(), lsFromView, bounds);
      for (int i = 0; i < 3; ++i) {
        glm::dvec2 least(kInfinity), most(-kInfinity);
        double reach = 0.0;
        for (int p = 0; p < picture.width * picture.height; ++p) {
          const float d = picture.depths[static_cast<std::size_t>(p)];
          if (!isSample(picture, d)) continue;
          const double z = viewOf(frame.camera, d);
          if (!(z >= bounds[i].near && z <= bounds[i].far)) continue;
          const glm::dvec3 fromEye =
              viewPoint(frame.camera, (p % picture.width + 0.5) / picture.width, (p / picture.width + 0.5) / picture.height, z);
          // The camera's right, seen along the light.
          const glm::dvec3 l = glm::normalize(frame.light.directionWs), right = Axes(frame.camera).right;
          const glm::dvec3 x = glm::normalize(right - l * glm::dot(l, right)), y = glm::cross(x, l);
          const glm::dvec2 ls(glm::dot(x, fromEye), glm::dot(y, fromEye));
          least = glm::min(least, ls);
          most = glm::max(most, ls);
          reach = std::max(reach, glm::length(fromEye));
        }
        for (int axis = 0; axis < 2; ++axis) {
          EXPECT_NEAR(bounds[i].least[axis], least[axis], 4e-6 * reach) << view << " " << i;
          EXPECT_NEAR(bounds[i].most[axis], most[axis], 4e-6 * reach) << view << " " << i;
        }
      }
      EXPECT_EQ(keepBounds(bounds), 3u);  // nothing is as far as the last
    }
}

// Nothing along the light says where the plane's axes lie: they are still across it and each other.
TEST(Samples, LightAlongTheCamerasRight) {
  Frame frame = usualFrame();
  const Axes axes(frame.camera);
  for (const double off : {0.0, 1e-12, 1e-3}) {
    frame.light.directionWs = axes.right + axes.up * off;
    glm::dmat3 lsFromView;
    ASSERT_EQ(lightForSamples(frame, lsFromView), Status::ok);
    const glm::dmat3 square = lsFromView * glm::transpose(lsFromView);
    for (int c = 0; c < 3; ++c)
      for (int r = 0; r < 3; ++r) EXPECT_NEAR(square[c][r], c == r ? 1.0 : 0.0, 1e-14);
    EXPECT_NEAR(glm::dot(glm::transpose(lsFromView)[2], glm::normalize(glm::dvec3(1.0, off, 0.0))), 1.0, 1e-14);
  }
}

TEST(Samples, LightSpaceIsRefusedAsInASolve) {
  Frame frame = usualFrame();
  glm::dmat3 lsFromView;
  frame.light.directionWs = {0, 0, 0};
  EXPECT_EQ(lightForSamples(frame, lsFromView), Status::lightDirection);
  frame.light.directionWs = {0, std::nan(""), 0};
  EXPECT_EQ(lightForSamples(frame, lsFromView), Status::lightDirection);
  frame = usualFrame();
  frame.camera.near = 0.0;
  EXPECT_EQ(lightForSamples(frame, lsFromView), Status::cameraNear);
}

TEST(Samples, AllocatesNothing) {
  Random random(74);
  const Picture picture = randomPicture(random, 61, 33, DepthConvention::zeroToOne, 0);
  std::vector<float> edges(65);
  std::vector<std::uint32_t> counts(64);
  SampleBounds bounds[] = {{0.25, 2.0, {}, {}}};
  double near, far;
  const auto before = allocationCount();
  sampleRange(picture.camera, picture.image(), near, far);
  windowEdges(picture.camera, near, far, edges);
  sampleHistogram(picture.camera, picture.image(), edges, counts);
  sampleBounds(picture.camera, picture.image(), glm::dmat3(1.0), bounds);
  EXPECT_EQ(allocationCount(), before);
}

// All at once: each pixel's depth lies in the range, counts in the histogram, and its place on the light plane in the bounds of its depth.
TEST(Samples, TakenAtOnce) {
  Random random(74);
  auto store = std::make_unique<SampleStore>();
  for (int view = 0; view < 4; ++view)
    for (const DepthConvention depth : kDepths) {
      const Picture picture = randomPicture(random, 40, 30, depth, view);
      Frame frame = usualFrame();
      frame.camera = picture.camera;
      Samples samples;
      samples.latency = 0.5;
      ASSERT_EQ(takeSamples(frame, picture.image(), *store, samples), Status::ok);
      EXPECT_EQ(samples.latency, 0.5);
      glm::dmat3 lsFromView;
      ASSERT_EQ(lightForSamples(frame, lsFromView), Status::ok);
      std::uint32_t sampled = 0, counted = 0;
      for (int i = 0; i < picture.width * picture.height; ++i) {
        const float value = picture.depths[static_cast<std::size_t>(i)];
        if (!isSample(picture, value)) continue;
        ++sampled;
        const Camera& camera = picture.camera;
        const double z = viewOf(camera, value), w = camera.projection == Projection::perspective ? z : 1.0, slack = 1e-5 * std::abs(z);
        EXPECT_GE(z, samples.near - slack);
        EXPECT_LE(z, samples.far + slack);
        const double x = w * ((i % picture.width + 0.5) / picture.width * (camera.left + camera.right) - camera.left),
                     y = w * ((i / picture.width + 0.5) / picture.height * (camera.down + camera.up) - camera.down);
        const glm::dvec2 at(lsFromView * glm::dvec3(x, y, z));
        bool isHeld = false;
        for (const SampleBounds& part : samples.bounds)
          isHeld |= z >= part.near - slack && z <= part.far + slack && glm::all(glm::greaterThan(at, part.least - 1e-4 * (1.0 + w))) &&
                    glm::all(glm::lessThan(at, part.most + 1e-4 * (1.0 + w)));
        EXPECT_TRUE(isHeld) << z;
      }
      for (const std::uint32_t count : samples.histogram) counted += count;
      if (view == 2) {
        EXPECT_TRUE(samples.histogram.empty());  // depths on both sides of the eye have no ratios
      } else {
        EXPECT_GE(counted, sampled);
        EXPECT_EQ(samples.histogram.size(), static_cast<std::size_t>(kSampleBins));
      }
    }
  // Nothing but background; a light without a direction.
  const std::vector<float> empty(12, 1.0f);
  Frame frame = usualFrame();
  Samples samples;
  EXPECT_EQ(takeSamples(frame, {empty.data(), 4, 3, 4}, *store, samples), Status::ok);
  EXPECT_GT(samples.near, samples.far);
  EXPECT_TRUE(samples.bounds.empty());
  frame.light.directionWs = glm::dvec3(0.0);
  EXPECT_EQ(takeSamples(frame, {empty.data(), 4, 3, 4}, *store, samples), Status::lightDirection);
}

}  // namespace
}  // namespace gnomon::test
