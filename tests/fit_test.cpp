#include "support.h"

#include "gnomon/fit.h"

namespace gnomon::test {
namespace {

TEST(Fit, RefusesALightWithoutDirection) {
  Frame frame = usualFrame();
  for (const glm::dvec3 bad : {glm::dvec3(0.0), glm::dvec3(0.0, std::nan(""), 1.0), glm::dvec3(kInfinity, 0.0, 0.0)})
    for (const FitMode fit : {FitMode::tight, FitMode::slice, FitMode::stable}) {
      frame.light.directionWs = bad;
      EXPECT_EQ(solve(frame, {.split = {}, .fit = fit})->status, Status::lightDirection);
    }
  frame.light.directionWs = {0.0, -1e-300, 0.0};  // any length will do
  EXPECT_EQ(solve(frame)->status, Status::ok);
}

// Light straight down on a level camera: each slice is an isosceles trapezoid, whose least rectangle is the upright one
// (far width x depth) for these proportions. Areas by hand.
TEST(Fit, TightIsTheLeastRectangleOfATrapezoid) {
  Frame frame;
  frame.camera = perspective({0, 5, 0}, {0, 0, -1}, {0, 1, 0}, kPi / 2.0, 1.0, 1.0, 16.0);
  frame.camera.depth = DepthConvention::reversedZeroToOne;
  frame.light.directionWs = {0, -1, 0};
  frame.budget.partitions = 2;
  const auto solution = solve(frame);
  ASSERT_EQ(solution->partitionCount, 2);
  for (int i = 0; i < 2; ++i) {
    const Partition& map = solution->partitions[i];
    const glm::dvec3 x(map.clipFromWorld[0][0], map.clipFromWorld[1][0], map.clipFromWorld[2][0]),
        y(map.clipFromWorld[0][1], map.clipFromWorld[1][1], map.clipFromWorld[2][1]);
    const double area = 4.0 / (glm::length(x) * glm::length(y)), expected = 2.0 * map.far * (map.far - map.near);
    EXPECT_NEAR(area / expected, 1.0, 1e-4);
    EXPECT_LE(map.viewport.z * map.viewport.w, 2048 * 2048);
    EXPECT_NEAR(static_cast<double>(map.viewport.z) / map.viewport.w / (glm::length(y) / glm::length(x)), 1.0, 1e-3);  // square texels
  }
}

// No rectangle at any of 3600 orientations is smaller.
TEST(Fit, TightBeatsEveryOrientation) {
  Random random(21);
  for (int i = 0; i < 40; ++i) {
    Frame frame = usualFrame();
    frame.camera.forwardWs = random.direction();
    frame.light.directionWs = random.direction();
    frame.budget.partitions = 1;
    const auto solution = solve(frame);
    const Partition& map = solution->partitions[0];
    const glm::dvec3 d = glm::normalize(frame.light.directionWs), a = glm::normalize(glm::cross(d, glm::dvec3(0.3, 0.5, 0.9))),
                     b = glm::cross(d, a);
    double least = kInfinity;
    for (int k = 0; k < 3600; ++k) {
      const double angle = k * kPi / 7200.0;
      const glm::dvec3 x = a * std::cos(angle) + b * std::sin(angle), y = b * std::cos(angle) - a * std::sin(angle);
      glm::dvec2 lo(kInfinity), hi(-kInfinity);
      for (int c = 0; c < 8; ++c) {
        const glm::dvec3 p = viewPoint(frame.camera, c & 1, (c >> 1) & 1, (c & 4) ? frame.camera.far : frame.camera.near);
        lo = glm::min(lo, glm::dvec2(glm::dot(p, x), glm::dot(p, y)));
        hi = glm::max(hi, glm::dvec2(glm::dot(p, x), glm::dot(p, y)));
      }
      least = std::min(least, (hi.x - lo.x) * (hi.y - lo.y));
    }
    const double pixel = pixelAt(frame, map.near);
    const double area = map.error.s * map.error.t * map.viewport.z * map.viewport.w * pixel * pixel;
    EXPECT_LE(area, least * (1.0 + 1e-4));
  }
}

// A walk of 200 frames: eye moving, view turning. Fractions of a texel at which static world points fall, for each map.
double worstDrift(FitMode fit, const glm::dvec3& start) {
  Random random(31);
  std::vector<glm::dvec3> points;
  for (int i = 0; i < 400; ++i)
    points.push_back(start + glm::dvec3(random.uniform(-40, 40), random.uniform(-3, 6), random.uniform(-40, 40)));
  std::vector<glm::dvec3> last(points.size(), glm::dvec3(-1.0));  // fraction and partition of the frame before
  double worst = 0.0;
  int kept = 0;
  for (int frameIndex = 0; frameIndex < 200; ++frameIndex) {
    Frame frame = usualFrame();
    const double time = frameIndex * 0.01;
    frame.camera.positionWs = start + glm::dvec3(3.1 * time, 0.3 * std::sin(5.0 * time), -2.3 * time);
    frame.camera.forwardWs = {std::sin(0.9 * time), -0.2 + 0.1 * std::sin(3.0 * time), std::cos(0.9 * time)};
    const auto solution = solve(frame, {.split = {}, .fit = fit});
    EXPECT_EQ(solution->status, Status::ok);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const glm::dvec3 rel = points[i] - solution->originWs;
      const int index = selectByViewDepth(solution->block, static_cast<float>(viewDepth(solution->block, rel)));
      if (index < 0) {
        last[i].z = -1.0;
        continue;
      }
      const glm::dvec2 texel = glm::dvec2(atlasPosition(solution->block, index, rel)) * glm::dvec2(solution->atlas);
      if (last[i].z == index) {
        glm::dvec2 drift = glm::abs(glm::fract(texel) - glm::dvec2(last[i]));
        drift = glm::min(drift, 1.0 - drift);
        worst = std::max({worst, drift.x, drift.y});
        ++kept;
      }
      last[i] = glm::dvec3(glm::fract(texel), index);
    }
  }
  EXPECT_GT(kept, 10000);
  return worst;
}

TEST(Fit, StableKeepsEveryPointInItsTexel) {
  EXPECT_LT(worstDrift(FitMode::stable, {0, 0, 0}), 1e-3);
  EXPECT_LT(worstDrift(FitMode::stable, {1e6, 200.0, -3e6}), 1e-3);
}

TEST(Fit, OthersDoNot) {
  EXPECT_GT(worstDrift(FitMode::slice, {0, 0, 0}), 0.1);
  EXPECT_GT(worstDrift(FitMode::tight, {0, 0, 0}), 0.1);
}

// Size and splits of stable maps do not change with position, orientation or receivers.
TEST(Fit, StableSizeDependsOnTheProjectionAlone) {
  Random random(32);
  const Frame first = usualFrame();
  const auto reference = solve(first, {.split = {}, .fit = FitMode::stable});
  for (int i = 0; i < 100; ++i) {
    Frame frame = first;
    frame.camera.positionWs = random.direction() * 1e4;
    frame.camera.forwardWs = random.direction();
    const Box box{frame.camera.positionWs - glm::dvec3(40.0), frame.camera.positionWs + glm::dvec3(30.0)};
    frame.scene.receivers = {&box, 1};
    const auto solution = solve(frame, {.split = {}, .fit = FitMode::stable});
    for (int k = 0; k < solution->partitionCount; ++k) {
      const auto length = [&](const Solution& s, int row) {
        const glm::mat4& m = s.partitions[k].clipFromWorld;
        return glm::length(glm::dvec3(m[0][row], m[1][row], m[2][row]));
      };
      EXPECT_EQ(solution->partitions[k].near, reference->partitions[k].near);
      EXPECT_NEAR(length(*solution, 0) / length(*reference, 0), 1.0, 1e-6);
      EXPECT_NEAR(length(*solution, 1) / length(*reference, 1), 1.0, 1e-6);
    }
  }
}

// The map keeps the margin asked for around every point it serves.
TEST(Fit, MarginsAreKept) {
  Random random(33);
  for (int i = 0; i < 60; ++i) {
    Frame frame = usualFrame();
    frame.light.directionWs = random.direction();
    frame.margin = {.filter = 3.0, .normalOffset = 1.5, .blend = 0.2, .border = 2};
    const auto solution = solve(frame, {.split = {}, .fit = static_cast<FitMode>(i % 3)});
    ASSERT_EQ(solution->status, Status::ok);
    for (int k = 0; k < solution->partitionCount; ++k) {
      const Partition& map = solution->partitions[k];
      const double from =
          k > 0 ? map.near - 0.2 * (map.near - solution->partitions[k - 1].near) : map.near;  // the blend band belongs to it too
      for (int c = 0; c < 8; ++c) {
        const glm::dvec3 rel = viewPoint(frame.camera, c & 1, (c >> 1) & 1, (c & 4) ? map.far : from);
        const glm::dvec4 q = glm::dmat4(map.clipFromWorld) * glm::dvec4(rel, 1.0);
        const glm::dvec2 texel = (glm::dvec2(q) * 0.5 + 0.5) * glm::dvec2(map.viewport.z, map.viewport.w);
        EXPECT_GE(std::min(texel.x, texel.y), 4.5 - 1e-3);
        EXPECT_LE(texel.x, map.viewport.z - 4.5 + 1e-3);
        EXPECT_LE(texel.y, map.viewport.w - 4.5 + 1e-3);
      }
    }
  }
}

// Two boxes of many receivers: the hull of hundreds of points is still covered.
TEST(Fit, HundredsOfReceivers) {
  Random random(34);
  Frame frame = usualFrame();
  std::vector<Box> boxes;
  for (int i = 0; i < 400; ++i) {
    const double z = random.logUniform(1.0, 90.0), angle = random.uniform(0.0, 2.0 * kPi);
    const glm::dvec3 centre =
        frame.camera.positionWs + viewPoint(frame.camera, 0.5 + 0.45 * std::cos(angle), 0.5 + 0.45 * std::sin(angle), z);
    boxes.push_back({centre - glm::dvec3(0.01 * z), centre + glm::dvec3(0.01 * z)});
  }
  frame.scene.receivers = boxes;
  const auto solution = solve(frame);
  ASSERT_EQ(solution->status, Status::ok);
  const Coverage coverage = checkAll(frame, *solution);
  EXPECT_GT(coverage.points, 100000);
  EXPECT_EQ(coverage.uncovered, 0);
}

// What is thinner than a map can tell apart lies in the middle of it, with as much room on each side.
TEST(Fit, APointLiesInTheMiddleOfItsMap) {
  Frame frame = usualFrame();
  const glm::dvec3 fromEye = viewPoint(frame.camera, 0.4, 0.6, 10.0), at = frame.camera.positionWs + fromEye;
  const Box point{at, at};
  frame.scene.receivers = {&point, 1};
  frame.budget.partitions = 1;
  for (const FitMode fit : {FitMode::tight, FitMode::slice}) {
    const auto solution = solve(frame, {.fit = fit});
    ASSERT_EQ(solution->partitionCount, 1);
    const glm::dvec4 q = glm::dmat4(solution->partitions[0].clipFromWorld) * glm::dvec4(fromEye, 1.0);
    EXPECT_LT(std::max(std::abs(q.x), std::abs(q.y)), 1e-3);
  }
}

}  // namespace
}  // namespace gnomon::test
