#include "support.h"

namespace gnomon::test {
namespace {

Splits splitSpans(std::vector<DepthSpan> spans, const SplitSettings& settings, int count, Projection projection = Projection::perspective) {
  Region region;
  region.camera.projection = projection;
  region.near = spans.front().near;
  region.far = spans.back().far;
  region.spanCount = static_cast<int>(spans.size());
  std::copy(spans.begin(), spans.end(), region.spans);
  Splits splits;
  double refused = 0.0;
  EXPECT_EQ(split(region, settings, count, splits, refused), Status::ok);
  return splits;
}

TEST(Split, RefusesBadSettings) {
  const Budget budget;
  double value = 0.0;
  int index = 0;
  const auto status = [&](const SplitSettings& settings) { return validate(settings, budget, value, index); };
  const std::vector<double> falling{1.0, 3.0, 2.0}, equal{1.0, 1.0}, many{1.0, 2.0, 3.0, 4.0}, nan{1.0, std::nan("")};
  EXPECT_EQ(status({.lambda = -0.1}), Status::splitLambda);
  EXPECT_EQ(status({.lambda = 1.1}), Status::splitLambda);
  EXPECT_EQ(status({.lambda = std::nan("")}), Status::splitLambda);
  EXPECT_EQ(status({.bias = -1.0}), Status::splitBias);
  EXPECT_EQ(status({.bias = kInfinity}), Status::splitBias);
  EXPECT_EQ(status({.count = 5}), Status::splitCount);
  EXPECT_EQ(status({.count = -1}), Status::splitCount);
  EXPECT_EQ(status({.scheme = SplitScheme::explicitDepths, .depths = falling}), Status::splitExplicit);
  EXPECT_EQ(index, 2);
  EXPECT_EQ(value, 2.0);
  EXPECT_EQ(status({.scheme = SplitScheme::explicitDepths, .depths = equal}), Status::splitExplicit);
  EXPECT_EQ(status({.scheme = SplitScheme::explicitDepths, .depths = many}), Status::splitExplicit);
  EXPECT_EQ(index, 3);
  EXPECT_EQ(status({.scheme = SplitScheme::explicitDepths, .depths = nan}), Status::splitExplicit);
  EXPECT_EQ(status({}), Status::ok);
}

TEST(Split, LogarithmicIsEquation4) {
  // n (f/n)^(i/m): 1, 10, 100, 1000.
  const Splits splits = splitSpans({{1.0, 1000.0}}, {}, 3);
  ASSERT_EQ(splits.count, 3);
  EXPECT_EQ(splits.slices[0].near, 1.0);
  EXPECT_NEAR(splits.slices[1].near, 10.0, 1e-12);
  EXPECT_NEAR(splits.slices[2].near, 100.0, 1e-11);
  EXPECT_EQ(splits.slices[2].far, 1000.0);
}

TEST(Split, UniformIsEquation5) {
  const Splits splits = splitSpans({{1.0, 1000.0}}, {.scheme = SplitScheme::uniform}, 4);
  for (int i = 0; i < 4; ++i) EXPECT_NEAR(splits.slices[i].near, 1.0 + 999.0 * i / 4.0, 1e-12);
  EXPECT_EQ(splits.slices[3].far, 1000.0);
}

// OGRE 1.12's PSSMShadowCameraSetup::calculateSplitPoints(4, 0.1, 100, 0.75) answered 0.1, 6.69051, 14.8842, 32.0933, 100.
TEST(Split, PracticalAgreesWithOgre) {
  const Splits splits = splitSpans({{0.1, 100.0}}, {.scheme = SplitScheme::practical, .lambda = 0.75}, 4);
  const double expected[] = {0.1, 6.69051, 14.8842, 32.0933, 100.0};
  for (int i = 0; i < 4; ++i) {
    EXPECT_NEAR(splits.slices[i].near, expected[i], 1e-4);
    EXPECT_NEAR(splits.slices[i].far, expected[i + 1], 1e-4);
  }
}

TEST(Split, PracticalDefaultIsEquation6) {
  const Splits splits = splitSpans({{1.0, 100.0}}, {.scheme = SplitScheme::practical}, 2);
  EXPECT_NEAR(splits.slices[1].near, (10.0 + 50.5) / 2.0, 1e-12);
}

TEST(Split, BiasMovesInteriorPlanesOnly) {
  const Splits splits = splitSpans({{1.0, 100.0}}, {.scheme = SplitScheme::practical, .bias = 3.0}, 2);
  EXPECT_EQ(splits.slices[0].near, 1.0);
  EXPECT_NEAR(splits.slices[1].near, (10.0 + 50.5) / 2.0 + 3.0, 1e-12);
  EXPECT_EQ(splits.slices[1].far, 100.0);
}

TEST(Split, RefusesABiasPastTheEnd) {
  Frame frame = usualFrame();
  const auto solution = solve(frame, {.split = {.scheme = SplitScheme::practical, .bias = 80.0}});
  EXPECT_EQ(solution->status, Status::splitBiasOrder);
  EXPECT_EQ(solution->refusedValue, 80.0);
}

TEST(Split, IncreasesStrictlyWithExactEnds) {
  Random random(3);
  for (int i = 0; i < 5000; ++i) {
    const double near = random.logUniform(1e-6, 1e3), far = near * random.logUniform(1.0001, 1e9);
    const int count = 1 + random.index(16);
    const auto scheme = static_cast<SplitScheme>(random.index(3));
    const Splits splits = splitSpans({{near, far}}, {.scheme = scheme, .lambda = random.uniform()}, count);
    ASSERT_EQ(splits.count, count);
    EXPECT_EQ(splits.slices[0].near, near);
    EXPECT_EQ(splits.slices[count - 1].far, far);
    for (int k = 0; k < count; ++k) {
      EXPECT_LT(splits.slices[k].near, splits.slices[k].far);
      if (k > 0) {
        EXPECT_EQ(splits.slices[k].near, splits.slices[k - 1].far);
      }
    }
  }
}

TEST(Split, ExplicitDepthsAreKeptAndEmptyOnesDropped) {
  const std::vector<double> depths{0.5, 2.0, 30.0, 500.0};
  Budget budget;
  budget.partitions = 5;
  for (const int count : {1, 2, 5}) {  // the depths decide, whatever the count
    const Splits splits = splitSpans({{1.0, 100.0}}, {.scheme = SplitScheme::explicitDepths, .depths = depths}, count);
    ASSERT_EQ(splits.count, 3);
    EXPECT_EQ(splits.slices[0].near, 1.0);
    EXPECT_EQ(splits.slices[0].far, 2.0);
    EXPECT_EQ(splits.slices[1].far, 30.0);
    EXPECT_EQ(splits.slices[2].far, 100.0);
  }
}

TEST(Split, GapsGetNoPartition) {
  // Three maps over [1, 1.5] and [100, 200]: one for the first, two of ratio sqrt 2 for the second.
  const Splits splits = splitSpans({{1.0, 1.5}, {100.0, 200.0}}, {}, 3);
  ASSERT_EQ(splits.count, 3);
  EXPECT_EQ(splits.slices[0].near, 1.0);
  EXPECT_EQ(splits.slices[0].far, 1.5);
  EXPECT_EQ(splits.slices[1].near, 100.0);
  EXPECT_NEAR(splits.slices[1].far, 100.0 * std::sqrt(2.0), 1e-6);
  EXPECT_EQ(splits.slices[2].far, 200.0);
}

TEST(Split, FewerMapsThanSpansJoinTheNearest) {
  // Two maps over 1..2, 3..4 and 1000..2000: the first two belong together.
  const Splits splits = splitSpans({{1.0, 2.0}, {3.0, 4.0}, {1000.0, 2000.0}}, {}, 2);
  ASSERT_EQ(splits.count, 2);
  EXPECT_EQ(splits.slices[0].near, 1.0);
  EXPECT_EQ(splits.slices[0].far, 4.0);
  EXPECT_EQ(splits.slices[1].near, 1000.0);
}

// Depths whose logarithms float64 cannot tell apart: one slice holds both.
TEST(Split, SpansWithinRoundingOfAPoint) {
  const double near = 1000.0, far = std::nextafter(near, 2000.0);
  for (const int count : {1, 2, 4, 16}) {
    const Splits splits = splitSpans({{near, near}, {far, far}}, {}, count);
    ASSERT_EQ(splits.count, 1) << count;
    EXPECT_EQ(splits.slices[0].near, near);
    EXPECT_EQ(splits.slices[0].far, far);
  }
}

// The greatest ratio over random spans is the least possible: no cover with a smaller ratio exists (brute force over a fine grid
// of ratios with the greedy cover written here).
TEST(Split, GreatestRatioIsLeast) {
  Random random(11);
  for (int i = 0; i < 300; ++i) {
    std::vector<DepthSpan> spans;
    double z = random.logUniform(0.01, 10.0);
    for (int k = 0, n = 1 + random.index(6); k < n; ++k) {
      const double far = z * random.logUniform(1.01, 5.0);
      spans.push_back({z, far});
      z = far * random.logUniform(1.01, 20.0);
    }
    const int count = 1 + random.index(8);
    const Splits splits = splitSpans(spans, {}, count);
    double ratio = 0.0;
    for (int k = 0; k < splits.count; ++k) ratio = std::max(ratio, splits.slices[k].far / splits.slices[k].near);
    ASSERT_LE(splits.count, count);
    const double smaller = 1.0 + (ratio - 1.0) * 0.999;
    int needed = 0;
    double reached = 0.0;
    for (const DepthSpan& span : spans)
      while (reached < span.far) {
        reached = std::max(span.near, reached) * smaller;
        ++needed;
      }
    EXPECT_GT(needed, count);
    for (const DepthSpan& span : spans)  // everything is served
      for (const double share : {0.0, 0.3, 1.0}) {
        const double depth = std::min(span.near + (span.far - span.near) * share, span.far);
        bool isServed = false;
        for (int k = 0; k < splits.count; ++k) isServed |= depth >= splits.slices[k].near && depth <= splits.slices[k].far;
        EXPECT_TRUE(isServed);
      }
  }
}

TEST(Split, OrthographicIsUniform) {
  const Splits splits = splitSpans({{-10.0, 30.0}}, {}, 4, Projection::orthographic);
  ASSERT_EQ(splits.count, 4);
  for (int i = 0; i < 4; ++i) EXPECT_NEAR(splits.slices[i].near, -10.0 + 10.0 * i, 1e-12);
}

// A fragment just before a split whose depth value rounds onto it is looked up in the map behind: that one holds it too.
TEST(Split, TheMapThatADepthValueSelectsHoldsItsPoints) {
  int across = 0;
  for (const DepthConvention depth : {DepthConvention::negativeOneToOne, DepthConvention::zeroToOne, DepthConvention::reversedZeroToOne})
    for (const double far : {1e3, 1e4, 3e4})
      for (const int count : {2, 4, 8}) {
        Frame frame;
        frame.camera = perspective({0, 0, 0}, {0, 0, -1}, {0, 1, 0}, 1.0, 1.5, 0.1, far);
        frame.camera.depth = depth;
        frame.light.directionWs = {0.1, -1.0, 0.02};
        frame.budget.partitions = count;
        const auto solution = solve(frame);
        ASSERT_EQ(solution->status, Status::ok);
        ASSERT_EQ(solution->block.info.y & GNOMON_FLAG_VIEW_DEPTH, 0u);
        for (int i = 1; i < solution->partitionCount; ++i)
          for (int n = 0; n < 400; ++n) {
            const double split = solution->partitions[i].near, z = split + (n / 4 - 50) / 25.0 * depthQuantum(frame.camera, split);
            const int selected = selectByWindowDepth(solution->block, static_cast<float>(windowDepth(frame.camera, z)));
            ASSERT_GE(selected, 0);
            across += selected == i && z < split;
            const glm::dvec4 q =
                glm::dmat4(solution->partitions[selected].clipFromWorld) * glm::dvec4(viewPoint(frame.camera, n & 1, n >> 1 & 1, z), 1.0);
            EXPECT_LE(std::max(std::abs(q.x), std::abs(q.y)), 1.0 + 1e-6) << z;
          }
      }
  EXPECT_GT(across, 500);
}

}  // namespace
}  // namespace gnomon::test
