#include "support.h"

#include "gnomon/lloyd.h"
#include "gnomon/lspsm.h"
#include "gnomon/maps.h"

namespace gnomon::test {
namespace {

// Sums that the solution states are those of its partitions.
TEST(Maps, TotalsAreSums) {
  Random random(71);
  for (int i = 0; i < 100; ++i) {
    Frame frame = usualFrame();
    frame.camera.forwardWs = random.direction();
    frame.light.directionWs = random.direction();
    const auto solution = solve(frame);
    double needed = 0.0, most = 0.0;
    for (int k = 0; k < solution->partitionCount; ++k) {
      const Partition& map = solution->partitions[k];
      needed += map.error.s * map.error.t * map.viewport.z * map.viewport.w;
      most = std::max({most, map.error.s, map.error.t});
    }
    EXPECT_NEAR(solution->neededTexels / needed, 1.0, 1e-12);
    EXPECT_EQ(solution->maxError, most);
    EXPECT_NEAR(solution->storageFactor * 1920.0 * 1080.0 / needed, 1.0, 1e-12);
  }
}

// Stable maps of slices without receivers are left out, and the others stay the same.
TEST(Maps, StableLeavesOutEmptySlicesAndMovesNothing) {
  Frame frame;
  frame.camera = perspective({0, 0, 0}, {0, 0, -1}, {0, 1, 0}, 1.0, 1.5, 1.0, 10000.0);
  frame.light.directionWs = {0.3, -1.0, 0.2};
  const PssmSettings stable{.split = {}, .fit = FitMode::stable};
  const auto all = solve(frame, stable);
  const std::vector<Box> boxes{{{-1, -1, -5}, {1, 1, -3}}, {{-1, -1, -3000}, {1, 1, -2000}}};  // slices 0 and 3 of 1, 10, 100, 1000, 10000
  frame.scene.receivers = boxes;
  const auto some = solve(frame, stable);
  ASSERT_EQ(all->partitionCount, 4);
  ASSERT_EQ(some->partitionCount, 2);
  for (const auto& [a, b] : {std::pair{0, 0}, std::pair{3, 1}}) {
    EXPECT_EQ(all->partitions[a].viewport, some->partitions[b].viewport);
    EXPECT_EQ(all->partitions[a].near, some->partitions[b].near);
    for (int c = 0; c < 3; ++c)
      for (int r = 0; r < 2; ++r) EXPECT_NEAR(all->partitions[a].clipFromWorld[c][r], some->partitions[b].clipFromWorld[c][r], 1e-6);
  }
  EXPECT_EQ(checkAll(frame, *some).uncovered, 0);
}

// The winding documented in gnomon/block.h.
TEST(Maps, DeterminantSigns) {
  for (const DepthConvention depth : {DepthConvention::negativeOneToOne, DepthConvention::zeroToOne, DepthConvention::reversedZeroToOne})
    for (const ClipStyle style : {ClipStyle::openGl, ClipStyle::vulkan, ClipStyle::direct3d})
      for (const FitMode fit : {FitMode::tight, FitMode::slice, FitMode::stable}) {
        Frame frame = usualFrame();
        frame.shadowMap.depth = depth;
        frame.shadowMap.style = style;
        const auto solution = solve(frame, {.split = {}, .fit = fit});
        const bool isPositive = (style == ClipStyle::vulkan) != (depth == DepthConvention::reversedZeroToOne);
        for (int k = 0; k < 4; ++k)
          EXPECT_EQ(glm::determinant(glm::dmat3(glm::dmat4(solution->partitions[k].clipFromWorld))) > 0.0, isPositive);
      }
}

// The lookup matrix lands where the viewport puts what the draw matrix draws, in each API's convention.
TEST(Maps, LookupLandsWhereTheViewportDraws) {
  Random random(72);
  for (const DepthConvention depth : {DepthConvention::negativeOneToOne, DepthConvention::zeroToOne, DepthConvention::reversedZeroToOne})
    for (const ClipStyle style : {ClipStyle::openGl, ClipStyle::vulkan, ClipStyle::direct3d}) {
      Frame frame = usualFrame();
      frame.shadowMap.depth = depth;
      frame.shadowMap.style = style;
      frame.margin.border = 3;
      const auto solution = solve(frame);
      for (int i = 0; i < 500; ++i) {
        const int k = random.index(4);
        const Partition& map = solution->partitions[k];
        const glm::dvec3 rel = viewPoint(frame.camera, random.uniform(), random.uniform(), random.uniform(map.near, map.far));
        const glm::dvec4 q = glm::dmat4(map.clipFromWorld) * glm::dvec4(rel, 1.0);
        const glm::dvec3 ndc = glm::dvec3(q) / q.w;
        const double up = style == ClipStyle::direct3d ? -ndc.y : ndc.y;  // rows are counted from v = 0
        const glm::dvec2 texel(map.viewport.x + (ndc.x * 0.5 + 0.5) * map.viewport.z, map.viewport.y + (up * 0.5 + 0.5) * map.viewport.w);
        const glm::dvec4 atlas = atlasPosition(solution->block, k, rel);
        EXPECT_NEAR(atlas.x * solution->atlas.x, texel.x, 0.01);
        EXPECT_NEAR(atlas.y * solution->atlas.y, texel.y, 0.01);
        EXPECT_NEAR(atlas.z, depth == DepthConvention::negativeOneToOne ? ndc.z * 0.5 + 0.5 : ndc.z, 1e-5);
      }
    }
}

// Stored depth grows away from the light, or falls for a reversed map.
TEST(Maps, DepthRunsAwayFromTheLight) {
  for (const DepthConvention depth : {DepthConvention::negativeOneToOne, DepthConvention::zeroToOne, DepthConvention::reversedZeroToOne}) {
    Frame frame = usualFrame();
    frame.shadowMap.depth = depth;
    const auto solution = solve(frame);
    for (int k = 0; k < 4; ++k) {
      const glm::dvec3 rel = viewPoint(frame.camera, 0.5, 0.5, solution->partitions[k].near),
                       along = glm::normalize(frame.light.directionWs) * solution->partitions[k].near * 0.1;
      const double change = atlasPosition(solution->block, k, rel + along).z - atlasPosition(solution->block, k, rel).z;
      EXPECT_GT(depth == DepthConvention::reversedZeroToOne ? -change : change, 0.0);
    }
  }
}

// A box in many pieces is the same receiver: no map needs much more than for the box whole, whatever had to be simplified.
TEST(Maps, ABoxInPiecesNeedsWhatItNeedsWhole) {
  for (int light = 0; light < 6; ++light) {
    Frame frame;
    frame.camera = perspective({1, 6, 3}, {0.3, -0.2 + 0.03 * light, 1.0}, {0, 1, 0}, 1.0, 16.0 / 9.0, 0.1, 300.0);
    frame.light.directionWs = {0.3 + 0.2 * light, -0.8, 0.2 - 0.3 * light};
    std::array<double, 3> whole{};
    for (const int pieces : {1, 3, 5, 7}) {
      std::vector<Box> boxes;
      const double side = 200.0 / pieces;
      for (int i = 0; i < pieces; ++i)
        for (int j = 0; j < pieces; ++j)
          boxes.push_back({{-100.0 + side * i, 0.0, -10.0 + side * j}, {-100.0 + side * (i + 1), 3.0, -10.0 + side * (j + 1)}});
      frame.scene.receivers = boxes;
      auto solution = std::make_unique<Solution>();
      std::array<double, 3> needed{};
      ASSERT_EQ(solvePssm(frame, {}, *solution), Status::ok);
      needed[0] = solution->neededTexels;
      ASSERT_EQ(solveLloyd(frame, {.warp = {.warp = Warp::lispsm}}, *solution), Status::ok);
      needed[1] = solution->neededTexels;
      ASSERT_EQ(solveLspsm(frame, {}, *solution), Status::ok);
      needed[2] = solution->neededTexels;
      if (pieces == 1) whole = needed;
      constexpr std::array<double, 3> kMore{1.001, 1.2,
                                            1.6};  // what simplifying costs: the hull nothing, widths of pixels some, in rows more
      for (std::size_t m = 0; m < 3; ++m) EXPECT_LE(needed[m], kMore[m] * whole[m]) << light << ' ' << pieces << ' ' << m;
    }
  }
}

// Room for motion is a larger part of a small map: with it in the shares texels have the same area in pixels in every map.
TEST(Maps, SharesKnowRoomForMotion) {
  Frame frame;
  frame.camera = perspective({1.0, 2.0, 3.0}, {0.3, -0.2, 1.0}, {0.0, 1.0, 0.0}, 1.0, 16.0 / 9.0, 0.5, 300.0);
  frame.light.directionWs = {0.3, -0.8, 0.2};
  frame.budget = {.partitions = 4, .resolution = 512};
  auto solution = std::make_unique<Solution>();
  for (const double motion : {0.0, 0.5, 3.0}) {
    for (double& each : frame.margin.motion) each = motion;
    ASSERT_EQ(solveLloyd(frame, {}, *solution), Status::ok);
    ASSERT_EQ(solution->partitionCount, 4);
    const double first = solution->partitions[0].error.s * solution->partitions[0].error.t;
    for (int i = 1; i < 4; ++i)
      EXPECT_NEAR(solution->partitions[i].error.s * solution->partitions[i].error.t, first, 0.02 * first) << motion << ' ' << i;
  }
}

}  // namespace
}  // namespace gnomon::test
