// Which partition serves a depth: the shaders against the C++ functions and against intervals in double.
#include <cmath>
#include <cstdlib>
#include <limits>

#include "parity.h"

namespace gnomon::test {
namespace {

TEST_P(Parity, Selection) {
  Gpu gpu(GetParam());
  constexpr float kInf = std::numeric_limits<float>::infinity();
  std::size_t all = 0, served = 0, gaps = 0, undecided = 0;
  for (const Setting& setting : allSettings(gapped_)) {
    SCOPED_TRACE(setting.name);
    const Frame& frame = setting.frame;
    const Camera& camera = frame.camera;
    const auto solution = solve(frame, setting.settings);
    ASSERT_EQ(solution->status, Status::ok);
    const GnomonBlock& block = solution->block;
    const double near = camera.near, far = std::min(camera.far, camera.shadowDistance);
    Random random(91);
    std::vector<glm::vec4> points;  // x: view depth, w: window depth
    const auto add = [&](double z) {
      points.emplace_back(static_cast<float>(z), 0.0f, 0.0f, static_cast<float>(windowReference(camera, z)));
    };
    for (int i = 0; i < 700; ++i)
      add(camera.projection == Projection::perspective ? random.logUniform(near * 0.5, far * 2.0) : random.uniform(near - 5.0, far + 5.0));
    for (int i = 0; i < 100; ++i)
      points.emplace_back(static_cast<float>(random.uniform(near, far)), 0.0f, 0.0f, static_cast<float>(random.uniform()));
    for (int i = 0; i < solution->partitionCount; ++i) {
      const Partition& map = solution->partitions[i];
      for (const double z : {map.near, map.far}) {  // either side of the ends, to the last float step that may decide and past it
        const float view = static_cast<float>(z), window = static_cast<float>(windowReference(camera, z));
        for (int steps = -8; steps <= 8; ++steps)
          points.emplace_back(static_cast<float>(view + steps * floatStep(view)), 0.0f, 0.0f,
                              static_cast<float>(window + steps * floatStep(window)));
      }
      const float view = block.viewStart[i / 4][i % 4], window = block.windowStart[i / 4][i % 4] * block.depthRule.x;
      for (const float away : {-kInf, view, kInf})  // what the block holds, and one float either side
        points.emplace_back(std::nextafter(view, away), 0.0f, 0.0f, std::nextafter(window, away == view ? window : away));
      const float viewEnd = block.partitions[i].interval.y, windowEnd = block.partitions[i].interval.w * block.depthRule.x;
      for (const float away : {-kInf, viewEnd, kInf})
        points.emplace_back(std::nextafter(viewEnd, away), 0.0f, 0.0f, std::nextafter(windowEnd, away == viewEnd ? windowEnd : away));
    }
    for (const float odd : {0.0f, -0.0f, 1.0f, 2.0f, -1.0f, 3e38f, -3e38f, kInf, -kInf, std::nanf("")})
      points.emplace_back(odd, 0.0f, 0.0f, odd);
    const auto results =
        gpu.run("  result = vec4(gnomonSelectWindow(gnomon, point.w), gnomonSelectView(gnomon, point.x), 0.0, 0.0);\n", block, points);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const float view = points[i].x, window = points[i].w;
      const int byWindow = static_cast<int>(results[i].x), byView = static_cast<int>(results[i].y);
      EXPECT_EQ(byWindow, selectByWindowDepth(block, window)) << window;
      EXPECT_EQ(byView, selectByViewDepth(block, view)) << view;
      if (!std::isfinite(view)) {
        EXPECT_EQ(byWindow, -1) << window;
        EXPECT_EQ(byView, -1) << view;
        continue;
      }
      const int expectedWindow = servedAtWindow(frame, *solution, window), expectedView = servedAtView(frame, *solution, view);
      all += 2;
      undecided += (expectedWindow == kMayDiffer) + (expectedView == kMayDiffer);
      served += (expectedWindow >= 0) + (expectedView >= 0);
      if (expectedWindow != kMayDiffer) {
        EXPECT_EQ(byWindow, expectedWindow) << "window depth " << window;
      }
      if (expectedView != kMayDiffer) {
        EXPECT_EQ(byView, expectedView) << "view depth " << view;
      }
      gaps += expectedView == -1 && view > solution->partitions[0].far && view < solution->partitions[solution->partitionCount - 1].near;
    }
  }
  EXPECT_GT(all, 60000u);
  EXPECT_GT(served, all / 2);
  EXPECT_GT(gaps, 500u);
  EXPECT_LT(undecided, all / 5);
}

// Shaders that hold fewer maps, of solves with as many and with more: each map that is held serves and is looked up as it should be, and
// one that is not serves nothing, rather than an index past the array.
TEST_P(Parity, FewerPartitions) {
  Frame frame = usualFrame();
  for (const int held : {1, 3, 4, 8, 13}) {
    Gpu gpu(GetParam(), held);
    for (const int count : {held, std::min(held + 3, kMaxPartitions)}) {
      SCOPED_TRACE(std::to_string(count) + " maps, " + std::to_string(held) + " held");
      frame.budget.partitions = count;
      const auto solution = solve(frame);
      ASSERT_EQ(solution->partitionCount, count);
      Random random(102);
      std::vector<glm::vec4> depths;
      for (int i = 0; i < 500; ++i) {
        const double z = random.logUniform(0.05, 200.0);
        depths.emplace_back(static_cast<float>(z), 0.0f, 0.0f, static_cast<float>(windowReference(frame.camera, z)));
      }
      const auto selected = gpu.run("  result = vec4(gnomonSelectWindow(gnomon, point.w), gnomonSelectView(gnomon, point.x), 0.0, 0.0);\n",
                                    solution->block, depths);
      const auto kept = [&](int index) { return index < held ? index : -1; };
      for (std::size_t i = 0; i < depths.size(); ++i) {
        const int byWindow = servedAtWindow(frame, *solution, depths[i].w), byView = servedAtView(frame, *solution, depths[i].x);
        if (byWindow != kMayDiffer) {
          EXPECT_EQ(static_cast<int>(selected[i].x), kept(byWindow));
        }
        if (byView != kMayDiffer) {
          EXPECT_EQ(static_cast<int>(selected[i].y), kept(byView));
        }
      }
      std::vector<glm::vec4> points = pointsInMaps(random, frame, *solution, 500);
      std::erase_if(points, [&](const glm::vec4& point) { return point.w >= static_cast<float>(held); });
      ASSERT_FALSE(points.empty());
      const auto lookups = gpu.run("  result = gnomonAtlas(gnomon, index, world);\n", solution->block, points);
      for (std::size_t i = 0; i < points.size(); ++i) {
        const glm::dvec3 reference = texelReference(frame, solution->partitions[static_cast<int>(points[i].w)], glm::dvec3(points[i]));
        for (int c = 0; c < 2; ++c) EXPECT_NEAR(lookups[i][c] * static_cast<double>(solution->atlas[c]), reference[c], 1.0 / 256.0);
        EXPECT_NEAR(lookups[i].z, reference.z, 2e-6);
        EXPECT_EQ(lookups[i].w, 1.0f);
      }
    }
  }
}

// gnomonSelect takes the window depth, unless the block says that it cannot tell the splits apart.
TEST_P(Parity, SelectFollowsTheFlag) {
  Gpu gpu(GetParam());
  for (const bool isFar : {false, true}) {
    Frame frame = usualFrame();
    if (isFar) frame.camera.near = 1e-3, frame.camera.far = 1e5;
    frame.budget.partitions = 16;
    PssmSettings settings;
    settings.split.scheme = SplitScheme::uniform;
    const auto solution = solve(frame, settings);
    ASSERT_EQ(solution->status, Status::ok);
    ASSERT_EQ((solution->block.info.y & GNOMON_FLAG_VIEW_DEPTH) != 0u, isFar);
    Random random(96);
    std::vector<glm::vec4> points;
    std::vector<double> depths;
    for (int i = 0; i < 2000; ++i) {
      const double z = random.uniform(frame.camera.near, frame.camera.far * 1.1);
      depths.push_back(z);
      // A window depth that has nothing to do with the point tells which one decided.
      points.emplace_back(glm::vec3(viewPoint(frame.camera, random.uniform(), random.uniform(), z)),
                          static_cast<float>(windowReference(frame.camera, random.uniform(frame.camera.near, frame.camera.far))));
    }
    const auto results = gpu.run("  result = vec4(gnomonSelect(gnomon, point.w, world), gnomonViewDepth(gnomon, world), 0.0, 0.0);\n",
                                 solution->block, points);
    int different = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      EXPECT_NEAR(results[i].y, depths[i], 1e-6 * glm::length(glm::dvec3(points[i])));
      const int byWindow = selectByWindowDepth(solution->block, points[i].w), byView = selectByViewDepth(solution->block, results[i].y);
      different += byWindow != byView;
      EXPECT_EQ(static_cast<int>(results[i].x), isFar ? byView : byWindow);
    }
    EXPECT_GT(different, 1000);
  }
}

// The driver that a run asks for is the one that answers.
TEST_P(Parity, RunsWhereItSays) {
  const Gpu gpu(GetParam());
  if (const char* const driver = std::getenv("GALLIUM_DRIVER")) {
    EXPECT_NE(gpu.ask(GL_RENDERER).find(driver), std::string::npos) << gpu.ask(GL_RENDERER);
  }
  EXPECT_EQ(gpu.ask(GL_VERSION).rfind("OpenGL ES 3", 0) == 0, GetParam().profile == offscreen::Profile::es) << gpu.ask(GL_VERSION);
}

// Four positions from the vertex stage, one picked: the same place as select and look up, wherever a slice serves.
TEST_P(Parity, PickIsSelectAndLookUp) {
  Gpu gpu(GetParam());
  Random random(341);
  for (const DepthConvention depth : {DepthConvention::negativeOneToOne, DepthConvention::reversedZeroToOne})
    for (const int count : {1, 3, 4}) {
      Frame frame = usualFrame();
      frame.camera.depth = depth;
      frame.budget.partitions = count;
      const auto solution = solve(frame);
      std::vector<glm::vec4> points;
      for (int i = 0; i < 2000; ++i) {
        const double z = random.logUniform(0.1001, 99.9);
        points.emplace_back(glm::vec3(viewPoint(frame.camera, random.uniform(), random.uniform(), z)),
                            static_cast<float>(windowReference(frame.camera, z)));
      }
      const auto results = gpu.run(
          "  vec4 p = gnomonPick4(gnomon, point.w, gnomonVertexPosition(gnomon, 0, world), gnomonVertexPosition(gnomon, 1, world), "
          "gnomonVertexPosition(gnomon, 2, world), gnomonVertexPosition(gnomon, 3, world));\n"
          "  result = vec4(p.xyz, p.w);\n",
          solution->block, points);
      int compared = 0;
      for (std::size_t i = 0; i < points.size(); ++i) {
        const int served = servedAtWindow(frame, *solution, points[i].w);
        if (served == kMayDiffer) continue;
        ++compared;
        ASSERT_EQ(results[i].w, static_cast<float>(served));
        const glm::dvec3 texel = texelReference(frame, solution->partitions[served], glm::dvec3(points[i]));
        EXPECT_NEAR(static_cast<double>(results[i].x) * solution->atlas.x, texel.x, 1.0 / 256.0);
        EXPECT_NEAR(static_cast<double>(results[i].y) * solution->atlas.y, texel.y, 1.0 / 256.0);
        EXPECT_NEAR(results[i].z, texel.z, 1e-6);
      }
      EXPECT_GT(compared, 1900);
    }
}

INSTANTIATE_TEST_SUITE_P(Dialects, Parity, ::testing::ValuesIn(kDialects), [](const auto& each) { return std::string(each.param.name); });

}  // namespace
}  // namespace gnomon::test
