#include "support.h"

#include "gnomon/error.h"

namespace gnomon::test {
namespace {

TEST(Error, InfiniteWhereTheMapHasNoArea) {
  const TexelError flat = texelSize(glm::mat4(0.0f), {0, 0, 16, 16}, {0, -1, 0});
  EXPECT_EQ(flat.s, kInfinity);
  EXPECT_EQ(flat.extent, kInfinity);
}

// A map of 8 x 4 world units over 16 x 16 texels, light straight down: edges 0.5 and 0.25, longest stretch 0.5.
TEST(Error, PlainMap) {
  glm::mat4 clip(0.0f);
  clip[0][0] = 2.0f / 8.0f;
  clip[2][1] = 2.0f / 4.0f;
  clip[1][2] = -0.01f;
  clip[3][3] = 1.0f;
  const TexelError texel = texelSize(clip, {0, 0, 16, 16}, {0, -1, 0});
  EXPECT_NEAR(texel.s, 0.5, 1e-12);
  EXPECT_NEAR(texel.t, 0.25, 1e-12);
  EXPECT_NEAR(texel.extent, 0.5, 1e-12);
}

// Sheared by 45 degrees: s = x, t = x + z in texels of 1. Inverse Jacobian columns: edge s (1, -1), edge t (0, 1).
// Largest singular value of [[1, 0], [-1, 1]]: the golden ratio.
TEST(Error, ShearedMap) {
  glm::mat4 clip(0.0f);
  clip[0][0] = 2.0f / 16.0f;
  clip[0][1] = 2.0f / 16.0f;
  clip[2][1] = 2.0f / 16.0f;
  clip[3][3] = 1.0f;
  const TexelError texel = texelSize(clip, {0, 0, 16, 16}, {0, -1, 0});
  EXPECT_NEAR(texel.s, std::sqrt(2.0), 1e-12);
  EXPECT_NEAR(texel.t, 1.0, 1e-12);
  EXPECT_NEAR(texel.extent, (1.0 + std::sqrt(5.0)) / 2.0, 1e-12);
}

TEST(Error, AgreesWithDifferencesOfEmittedMatrices) {
  Random random(51);
  for (int i = 0; i < 300; ++i) {
    Frame frame = usualFrame();
    frame.camera.forwardWs = random.direction();
    frame.light.directionWs = random.direction();
    const auto solution = solve(frame, {.split = {}, .fit = static_cast<FitMode>(i % 3)});
    for (int k = 0; k < solution->partitionCount; ++k) {
      const Partition& map = solution->partitions[k];
      const TexelError texel = texelSize(map.clipFromWorld, map.viewport, glm::normalize(frame.light.directionWs));
      const glm::dvec2 measured = measuredTexel(map, viewPoint(frame.camera, 0.3, 0.6, map.far), frame.light.directionWs, map.far);
      EXPECT_NEAR(texel.s / measured.x, 1.0, 1e-6);
      EXPECT_NEAR(texel.t / measured.y, 1.0, 1e-6);
      EXPECT_GE(texel.extent, std::max(texel.s, texel.t) * (1.0 - 1e-12));
    }
  }
}

TEST(Error, CertificateIsPerPixelAndInflatedByAMillionth) {
  const TexelError certified = certify({3.0, 2.0, 4.0}, 0.5);
  EXPECT_NEAR(certified.s, 6.0 * (1.0 + 1e-6), 1e-12);
  EXPECT_NEAR(certified.t, 4.0 * (1.0 + 1e-6), 1e-12);
  EXPECT_NEAR(certified.extent, 8.0 * (1.0 + 1e-6), 1e-12);
}

// The overhead light of [Lloyd 2006, appendix C]: S_optimum = ln(f/n) / (2 tan theta), for any aspect 1.
TEST(Error, LimitOverheadIsLloydsOptimum) {
  Frame frame;
  frame.camera = perspective({0, 0, 0}, {0, 0, -1}, {0, 1, 0}, kPi / 3.0, 1.0, 1.0, 1000.0);
  frame.light.directionWs = {0, -1, 0};
  frame.image = {1080, 1080};
  EXPECT_NEAR(limitTexels(frame) / (1080.0 * 1080.0), std::log(1000.0) / (2.0 * std::tan(kPi / 6.0)), 1e-9);
}

// No solution needs fewer texels than the limit.
TEST(Error, NothingBeatsTheLimit) {
  Random random(52);
  for (int i = 0; i < 500; ++i) {
    Frame frame = usualFrame();
    frame.camera = perspective({0, 0, 0}, random.direction(), random.direction(), random.uniform(0.2, 2.5), random.uniform(0.4, 2.5), 1.0,
                               random.logUniform(1.5, 1e4));
    frame.light.directionWs = random.direction();
    frame.budget.partitions = 1 + random.index(16);
    const auto solution = solve(frame);
    EXPECT_GT(solution->limitTexels, 0.0);
    EXPECT_GE(solution->neededTexels, solution->limitTexels);
  }
}

}  // namespace
}  // namespace gnomon::test
