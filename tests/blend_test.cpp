// Blending at seams: the weight, and that no lookup leaves the maps that cover it. The shader: tests/parity_test.cpp.
#include <cmath>
#include <vector>

#include "support.h"

namespace gnomon::test {
namespace {

Frame blendFrame(double blend) {
  Frame frame = usualFrame();
  frame.margin.blend = blend;
  return frame;
}

// The weight by its definition: linear over the last share of a slice that another one follows.
double weightReference(const Frame& frame, const Solution& solution, int index, double z) {
  if (index < 0 || index + 1 >= solution.partitionCount || solution.partitions[index + 1].near != solution.partitions[index].far)
    return 0.0;
  const Partition& map = solution.partitions[index];
  const double band = frame.margin.blend * (map.far - map.near);
  return band > 0.0 ? std::min(std::max(1.0 - (map.far - z) / band, 0.0), 1.0) : 0.0;
}

TEST(Blend, WeighsTheNextMapLinearlyOverTheBand) {
  for (const double blend : {0.0, 0.1, 0.5, 0.99})
    for (const int count : {1, 4, 16}) {
      Frame frame = blendFrame(blend);
      frame.budget.partitions = count;
      const auto solution = solve(frame);
      ASSERT_EQ(solution->partitionCount, count);
      for (int i = -1; i < count; ++i)
        for (int k = 0; k <= 1000; ++k) {
          const auto z = static_cast<float>(0.1 * std::pow(1000.0, k / 1000.0));
          ASSERT_NEAR(blendWeight(solution->block, i, z), weightReference(frame, *solution, i, z), 1e-4) << blend << " " << i << " " << z;
        }
    }
}

TEST(Blend, GapsAndTheLastPartitionAreNotBlended) {
  Frame frame = blendFrame(0.3);
  frame.camera = perspective({0, 0, 0}, {0, 0, -1}, {0, 1, 0}, 1.0, 1.5, 0.5, 500.0);
  const std::vector<Box> boxes{{{-3, -3, -9}, {3, 3, -2}}, {{-90, -90, -400}, {90, 90, -200}}};
  frame.scene.receivers = boxes;
  const auto solution = solve(frame);
  int seams = 0, ends = 0;
  for (int i = 0; i < solution->partitionCount; ++i) {
    const bool isJoined = i + 1 < solution->partitionCount && solution->partitions[i + 1].near == solution->partitions[i].far;
    (isJoined ? seams : ends) += 1;
    const float atEnd = blendWeight(solution->block, i, static_cast<float>(solution->partitions[i].far));
    EXPECT_NEAR(atEnd, isJoined ? 1.0f : 0.0f, 1e-4f) << i;
  }
  EXPECT_GT(seams, 0);
  EXPECT_EQ(ends, 2);  // before the gap, and at the end
}

// Wherever a map has weight it covers the point, whichever depth selects: points over the whole view volume, its edges included.
TEST(Blend, LooksUpOnlyWhereTheMapCovers) {
  int taken = 0;
  for (const FitMode fit : {FitMode::tight, FitMode::slice, FitMode::stable})
    for (const double blend : {0.05, 0.4}) {
      const Frame frame = blendFrame(blend);
      const auto solution = solve(frame, {.split = {}, .fit = fit});
      Random random(7);
      for (int k = 0; k < 20000; ++k) {
        const double z = random.logUniform(0.1, 100.0);
        const double x = k % 4 == 0 ? 0.0 : random.uniform(), y = k % 4 == 1 ? 1.0 : random.uniform();
        const glm::dvec3 world = viewPoint(frame.camera, x, y, z);
        const int index = selectByViewDepth(solution->block, static_cast<float>(z));
        ASSERT_GE(index, 0);
        if (!(blendWeight(solution->block, index, static_cast<float>(viewDepth(solution->block, world))) > 0.0f)) continue;
        ++taken;
        const glm::dvec4 clip = glm::dmat4(solution->partitions[index + 1].clipFromWorld) * glm::dvec4(world, 1.0);
        ASSERT_LE(std::max(std::abs(clip.x), std::abs(clip.y)), 1.0 + 1e-6) << z;
        ASSERT_TRUE(clip.z >= -1e-6 && clip.z <= 1.0 + 1e-6) << z;
      }
    }
  EXPECT_GT(taken, 5000);
}

}  // namespace
}  // namespace gnomon::test
