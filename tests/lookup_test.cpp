#include "support.h"

namespace gnomon::test {
namespace {

// Selection by window depth and by view depth name the partition whose interval holds the depth, in every convention.
TEST(Lookup, SelectsTheIntervalThatHoldsTheDepth) {
  Random random(81);
  for (const DepthConvention depth : {DepthConvention::negativeOneToOne, DepthConvention::zeroToOne, DepthConvention::reversedZeroToOne})
    for (int count = 1; count <= 16; ++count) {
      Frame frame = usualFrame();
      frame.camera.depth = depth;
      frame.budget.partitions = count;
      const auto solution = solve(frame);
      const double n = frame.camera.near, f = frame.camera.far;
      for (int i = 0; i < 200; ++i) {
        const double z = random.logUniform(n, f);
        bool isNearASplit = false;  // closer than float depth can tell
        for (int k = 0; k < count; ++k) isNearASplit |= std::abs(z / solution->partitions[k].near - 1.0) < 1e-3;
        if (isNearASplit) continue;
        const int expected = servedBy(*solution, z, 0.0);
        const double window = depth == DepthConvention::reversedZeroToOne ? n / (f - n) * (f / z - 1.0) : f / (f - n) * (1.0 - n / z);
        EXPECT_EQ(selectByWindowDepth(solution->block, static_cast<float>(window)), expected) << z;
        EXPECT_EQ(selectByViewDepth(solution->block, static_cast<float>(z)), expected) << z;
      }
      EXPECT_EQ(selectByViewDepth(solution->block, static_cast<float>(f * 1.001)), -1);
      EXPECT_EQ(selectByViewDepth(solution->block, static_cast<float>(n * 0.999)), -1);
      EXPECT_EQ(selectByViewDepth(solution->block, -5.0f), -1);
    }
}

// Half-open: a split depth belongs to the map that begins there; the first and last ends belong to theirs.
TEST(Lookup, BoundariesBelongToTheNextMap) {
  const Frame frame = usualFrame();
  const auto solution = solve(frame);
  for (int k = 1; k < 4; ++k) {
    const float start = solution->block.viewStart[0][k];
    EXPECT_EQ(selectByViewDepth(solution->block, start), k);
    EXPECT_EQ(selectByViewDepth(solution->block, std::nextafter(start, 0.0f)), k - 1);
  }
  EXPECT_EQ(selectByViewDepth(solution->block, 0.1f), 0);
  EXPECT_EQ(selectByViewDepth(solution->block, 100.0f), 3);
  EXPECT_EQ(selectByWindowDepth(solution->block, 0.0f), 0);
  EXPECT_EQ(selectByWindowDepth(solution->block, 1.0f), 3);
}

TEST(Lookup, ViewDepthIsAlongTheView) {
  Random random(82);
  for (const bool worldSpace : {false, true}) {
    Frame frame = usualFrame();
    frame.worldSpace = worldSpace;
    const auto solution = solve(frame);
    for (int i = 0; i < 100; ++i) {
      const double z = random.uniform(-50.0, 150.0);
      const glm::dvec3 rel = frame.camera.positionWs + viewPoint(frame.camera, random.uniform(), random.uniform(), z) - solution->originWs;
      EXPECT_NEAR(viewDepth(solution->block, rel), z, 1e-4);
    }
  }
}

}  // namespace
}  // namespace gnomon::test
