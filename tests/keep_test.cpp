// Kept maps: they cover, they hold every caster, they stay where they were drawn, and they are refused where they would not.
#include "gnomon/keep.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "support.h"

namespace gnomon::test {
namespace {

// A walk: a step forward each frame and a slow turn, over a floor that receives.
Frame walkFrame(int step, FitMode fit) {
  Frame frame = usualFrame();
  const double turn = 0.004 * step;
  frame.camera.positionWs = {1000.0 + 0.05 * step, 2.0 + 0.2 * std::sin(0.3 * step), -3.0};
  frame.camera.forwardWs = {std::cos(turn), -0.15, std::sin(turn)};
  frame.shadowMap.layout = fit == FitMode::tight ? MapLayout::layers : MapLayout::atlas;  // tight maps change shape in an atlas
  frame.margin.filter = 1.0;
  frame.margin.motion[2] = 0.5;
  frame.margin.motion[3] = 2.0;
  return frame;
}

TEST(Keep, AStillViewKeepsEveryMap) {
  for (const FitMode fit : {FitMode::tight, FitMode::slice, FitMode::stable})
    for (const bool worldSpace : {false, true}) {
      Frame frame = usualFrame();
      frame.worldSpace = worldSpace;
      DrawnMaps drawn;
      auto solution = solve(frame, {.split = {}, .fit = fit});
      EXPECT_EQ(keepMaps(frame, ~0u, drawn, *solution), 0u);  // nothing was drawn yet
      const Solution first = *solution;
      solution = solve(frame, {.split = {}, .fit = fit});
      EXPECT_EQ(keepMaps(frame, 0b0101u, drawn, *solution), 0b0101u);
      EXPECT_EQ(keepMaps(frame, ~0u, drawn, *solution), 0b1111u);
      for (int i = 0; i < 4; ++i) {
        EXPECT_EQ(solution->partitions[i].clipFromWorld, first.partitions[i].clipFromWorld);
        EXPECT_EQ(solution->block.partitions[i].clipFromWorld, first.partitions[i].clipFromWorld);
        EXPECT_NEAR(solution->partitions[i].error.s, first.partitions[i].error.s, 1e-9 * first.partitions[i].error.s);
      }
      EXPECT_NEAR(solution->maxError, first.maxError, 1e-9 * first.maxError);
      EXPECT_NEAR(solution->storageFactor, first.storageFactor, 1e-9 * first.storageFactor);
    }
}

TEST(Keep, KeptMapsCoverWhatTheyServeWhileTheCameraMoves) {
  for (const FitMode fit : {FitMode::tight, FitMode::slice, FitMode::stable}) {
    DrawnMaps drawn;
    std::array<int, 4> keptFrames{};
    constexpr int kSteps = 120;
    for (int step = 0; step < kSteps; ++step) {
      const Frame frame = walkFrame(step, fit);
      const auto solution = solve(frame, {.split = {}, .fit = fit});
      ASSERT_EQ(solution->status, Status::ok);
      const DrawnMaps before = drawn;
      const std::uint32_t kept = keepMaps(frame, ~0u, drawn, *solution);
      const Coverage coverage = checkAll(frame, *solution, 5, 31);
      ASSERT_EQ(coverage.uncovered, 0) << step;
      ASSERT_LE(coverage.worst, 1.0 + 1e-3) << step;
      for (int i = 0; i < 4; ++i) {
        const bool isKept = (kept >> i & 1u) != 0u;
        keptFrames[static_cast<std::size_t>(i)] += isKept;
        ASSERT_EQ(drawn.maps[i].originWs, isKept ? before.maps[i].originWs : solution->originWs);
        if (!isKept) continue;
        const Partition &then = before.maps[i].partition, &now = solution->partitions[i];
        ASSERT_EQ(now.viewport, then.viewport);
        // A world point keeps its texel, and the block says the same as the matrix.
        const glm::dvec3 ws = frame.camera.positionWs + viewPoint(frame.camera, 0.3, 0.7, 0.5 * (now.near + now.far));
        const glm::dvec4 a = glm::dmat4(then.clipFromWorld) * glm::dvec4(ws - before.maps[i].originWs, 1.0),
                         b = glm::dmat4(now.clipFromWorld) * glm::dvec4(ws - solution->originWs, 1.0);
        ASSERT_LT(std::max(std::abs(a.x - b.x), std::abs(a.y - b.y)) * now.viewport.z / 2.0, 1e-3) << step;  // texels
        const glm::dvec4 uv = atlasPosition(solution->block, i, ws - solution->originWs);
        ASSERT_NEAR(uv.x * solution->atlas.x, now.viewport.x + (0.5 + 0.5 * b.x) * now.viewport.z, 2e-3);
        ASSERT_NEAR(uv.y * solution->atlas.y, now.viewport.y + (0.5 + 0.5 * b.y) * now.viewport.w, 2e-3);
      }
    }
    EXPECT_EQ(keptFrames[0], 0);  // no room was asked for
    EXPECT_GT(keptFrames[2], kSteps / 2) << static_cast<int>(fit);
    EXPECT_LT(keptFrames[2], kSteps - 1);
    EXPECT_GT(keptFrames[3], kSteps / 2) << static_cast<int>(fit);
    EXPECT_LT(keptFrames[3], kSteps - 1);
  }
}

// What a kept map was drawn with holds every caster of every point it now serves: boxes on the rays from the points to the light.
TEST(Keep, KeptMapsHoldTheCastersOfWhatTheyServe) {
  DrawnMaps drawn;
  Random random(3);
  int rays = 0;
  for (int step = 0; step < 60; ++step) {
    const Frame frame = walkFrame(step, FitMode::tight);
    const auto solution = solve(frame);
    const std::uint32_t kept = keepMaps(frame, ~0u, drawn, *solution);
    const glm::dvec3 towardsLight = -glm::normalize(frame.light.directionWs);
    for (int i = 0; i < 4; ++i) {
      if ((kept >> i & 1u) == 0u) continue;
      const Partition& map = solution->partitions[i];
      for (int k = 0; k < 200; ++k) {
        const double x = k % 3 == 0 ? k % 2 : random.uniform(), y = k % 5 == 0 ? k % 2 : random.uniform();
        const glm::dvec3 ws =
            frame.camera.positionWs + viewPoint(frame.camera, x, y, k % 7 == 0 ? map.far : random.uniform(map.near, map.far));
        const glm::dvec3 caster = ws + towardsLight * random.logUniform(1e-3, 1e4);
        ASSERT_TRUE(mayCast(drawn.maps[i].partition, {caster, caster})) << step << " map " << i;
        ++rays;
      }
    }
  }
  EXPECT_GT(rays, 5000);
}

// A thousand keeps in a row, the origin moving each time, leave the map where it was drawn.
TEST(Keep, NothingDrifts) {
  Frame frame = walkFrame(0, FitMode::slice);
  frame.margin.motion[3] = 50.0;
  DrawnMaps drawn;
  auto solution = solve(frame, {.split = {}, .fit = FitMode::slice});
  (void)keepMaps(frame, 0, drawn, *solution);
  const Solution first = *solution;
  const glm::dvec3 ws = frame.camera.positionWs + viewPoint(frame.camera, 0.5, 0.5, 60.0);
  for (int k = 1; k <= 1000; ++k) {
    frame.camera.positionWs += glm::dvec3(0.01, 0.002, -0.013);
    ASSERT_EQ(solvePssm(frame, {.split = {}, .fit = FitMode::slice}, *solution), Status::ok);
    ASSERT_EQ(keepMaps(frame, 0b1000u, drawn, *solution), 0b1000u) << k;
  }
  const glm::dvec4 a = glm::dmat4(first.partitions[3].clipFromWorld) * glm::dvec4(ws - first.originWs, 1.0),
                   b = glm::dmat4(solution->partitions[3].clipFromWorld) * glm::dvec4(ws - solution->originWs, 1.0);
  EXPECT_LT(std::max(std::abs(a.x - b.x), std::abs(a.y - b.y)) * 1024.0, 5e-4);  // texels: one rounding, not a thousand
}

TEST(Keep, RefusesWhatTheTextureDoesNotHold) {
  const Frame frame = walkFrame(0, FitMode::slice);
  const PssmSettings settings{.split = {}, .fit = FitMode::slice};
  const auto keepAfter = [&](const Frame& next, const PssmSettings& nextSettings) {
    DrawnMaps drawn;
    auto solution = solve(frame, settings);
    (void)keepMaps(frame, 0, drawn, *solution);
    solution = solve(next, nextSettings);
    return keepMaps(next, ~0u, drawn, *solution);
  };
  EXPECT_EQ(keepAfter(frame, settings), 0b1111u);
  Frame next = frame;
  next.camera.positionWs.x += 100.0;
  EXPECT_EQ(keepAfter(next, settings), 0u) << "elsewhere";
  next = frame;
  next.camera.forwardWs = -next.camera.forwardWs;
  EXPECT_EQ(keepAfter(next, settings), 0u) << "the other way";
  next = frame;
  next.budget.resolution = 1024;
  EXPECT_EQ(keepAfter(next, settings), 0u) << "another texture";
  next = frame;
  next.shadowMap.style = ClipStyle::vulkan;
  EXPECT_EQ(keepAfter(next, settings), 0u) << "another convention";
  next = frame;
  next.margin.filter = 400.0;
  EXPECT_EQ(keepAfter(next, settings), 0u) << "a filter that reaches out of it";
  next = frame;
  next.camera.far = 200.0;
  EXPECT_EQ(keepAfter(next, settings) & 0b1000u, 0u) << "a slice that reaches on";
  next = frame;
  next.camera.near = -1.0;
  EXPECT_EQ(keepAfter(next, settings), 0u) << "a refusal";
}

}  // namespace
}  // namespace gnomon::test
