#include "support.h"

#include <array>
#include <cstring>
#include <limits>

#include "allocations.h"

namespace gnomon::test {
namespace {

const double kNan = std::numeric_limits<double>::quiet_NaN();

// One labelled block for each refusal, then the valid frame.
TEST(Pssm, RefusesWithAReason) {
  const auto refuses = [](Status expected, auto change) {
    Frame frame = usualFrame();
    PssmSettings settings;
    change(frame, settings);
    const auto solution = solve(frame, settings);
    EXPECT_EQ(solution->status, expected) << statusField(expected);
    EXPECT_EQ(solution->partitionCount, 0);
    EXPECT_EQ(solution->block.info.x, 0u);
  };
  using F = Frame&;
  using S = PssmSettings&;
  // camera
  refuses(Status::cameraPosition, [](F f, S) { f.camera.positionWs.y = kNan; });
  refuses(Status::cameraForward, [](F f, S) { f.camera.forwardWs = glm::dvec3(0.0); });
  refuses(Status::cameraForward, [](F f, S) { f.camera.forwardWs.x = kInfinity; });
  refuses(Status::cameraUp, [](F f, S) { f.camera.upWs = -3.0 * f.camera.forwardWs; });
  refuses(Status::cameraUp, [](F f, S) { f.camera.upWs.z = kNan; });
  for (const double bad : {0.0, -1.0, kNan, kInfinity}) refuses(Status::cameraNear, [&](F f, S) { f.camera.near = bad; });
  for (const double bad : {0.1, 0.05, -1.0, kNan}) refuses(Status::cameraFar, [&](F f, S) { f.camera.far = bad; });
  refuses(Status::cameraInfiniteFar, [](F f, S) { f.camera.far = kInfinity; });
  refuses(Status::cameraInfiniteFar, [](F f, S) {
    f.camera.projection = Projection::orthographic;
    f.camera.far = kInfinity;
    f.camera.shadowDistance = 10.0;
  });
  refuses(Status::cameraNear, [](F f, S) {
    f.camera.projection = Projection::orthographic;
    f.camera.near = -kInfinity;
  });
  refuses(Status::cameraShadowDistance, [](F f, S) { f.camera.shadowDistance = kNan; });
  refuses(Status::cameraTangents, [](F f, S) { f.camera.left = -f.camera.right; });
  refuses(Status::cameraTangents, [](F f, S) { f.camera.up = kNan; });
  refuses(Status::cameraTangents,
          [](F f, S) { f.camera = perspective(f.camera.positionWs, f.camera.forwardWs, f.camera.upWs, 1.0, kInfinity, 0.1, 100.0); });
  // light
  refuses(Status::lightDirection, [](F f, S) { f.light.directionWs = glm::dvec3(0.0); });
  refuses(Status::lightDirection, [](F f, S) { f.light.directionWs.x = kNan; });
  // image
  refuses(Status::imageSize, [](F f, S) { f.image.height = 0.0; });
  refuses(Status::imageSize, [](F f, S) { f.image.width = kNan; });
  // margin
  refuses(Status::marginFilter, [](F f, S) { f.margin.filter = -1.0; });
  refuses(Status::marginNormalOffset, [](F f, S) { f.margin.normalOffset = kNan; });
  refuses(Status::marginBlend, [](F f, S) { f.margin.blend = 1.0; });
  refuses(Status::marginBorder, [](F f, S) { f.margin.border = 1025; });
  refuses(Status::marginTexels, [](F f, S) { f.margin.filter = 1024.0; });
  // fade and bias
  refuses(Status::fade, [](F f, S) { f.fade = 1.5; });
  refuses(Status::biasSlope, [](F f, S) { f.bias.slope = -1.0; });
  refuses(Status::biasConstant, [](F f, S) { f.bias.constant = kInfinity; });
  // budget
  for (const int bad : {0, 17, -1}) refuses(Status::budgetPartitions, [&](F f, S) { f.budget.partitions = bad; });
  for (const int bad : {0, 16385}) refuses(Status::budgetResolution, [&](F f, S) { f.budget.resolution = bad; });
  for (const double bad : {3.0, -1.0, kNan, kInfinity}) refuses(Status::budgetTexels, [&](F f, S) { f.budget.texels = bad; });
  refuses(Status::budgetAtlas, [](F f, S) { f.budget.atlas = {-1, 100}; });
  refuses(Status::budgetAtlas, [](F f, S) {
    f.budget.atlas = {16, 16};
    f.margin.border = 8;
  });
  for (const double bad : {0.0, kNan, kInfinity}) refuses(Status::budgetTargetError, [&](F f, S) { f.budget.targetError = bad; });
  // method
  refuses(Status::splitLambda, [](F, S s) { s.split.lambda = 2.0; });
  refuses(Status::stableAutomatic, [](F, S s) {
    s.fit = FitMode::stable;
    s.split.automatic = true;
  });
  // world space: too far for any answer, and too far for stable
  refuses(Status::worldSpacePrecision, [](F f, S) {
    f.worldSpace = true;
    f.camera.positionWs.x = 1e9;
  });
  refuses(Status::stableWorldSpace, [](F f, S s) {
    f.worldSpace = true;
    f.camera.positionWs.x = 1e6;
    s.fit = FitMode::stable;
  });
  // range
  refuses(Status::floatRange, [](F f, S) { f.camera.positionWs.x = 1e39; });
  refuses(Status::floatRange, [](F f, S) {
    f.camera.near = 1e-45;
    f.camera.far = 1e-44;
  });
  // the valid one, and a fade too short to be one
  Frame sharp = usualFrame();
  sharp.fade = 1e-17;
  EXPECT_EQ(solve(sharp)->status, Status::ok);
  EXPECT_EQ(solve(usualFrame())->status, Status::ok);
}

TEST(Pssm, EmptyIsAnAnswer) {
  const auto isEmpty = [](const Frame& frame, const PssmSettings& settings) {
    const auto solution = solve(frame, settings);
    EXPECT_EQ(solution->status, Status::ok);
    EXPECT_EQ(solution->partitionCount, 0);
    EXPECT_EQ(solution->block.info.x, 0u);
    EXPECT_EQ(solution->layers, 0);
    EXPECT_EQ(selectByViewDepth(solution->block, 5.0f), -1);
    EXPECT_TRUE(isFinite(*solution));
  };
  const std::vector<Box> behind{{{-1, 0, -50}, {1, 1, -40}}};
  const std::vector<glm::dvec4> nowhere{{0, 1, 0, -1e6}};
  for (const FitMode fit : {FitMode::tight, FitMode::slice, FitMode::stable}) {
    Frame frame = usualFrame();
    frame.camera.shadowDistance = 0.05;
    isEmpty(frame, {.split = {}, .fit = fit});
    frame = usualFrame();
    frame.scene.receivers = behind;
    isEmpty(frame, {.split = {}, .fit = fit});
    frame = usualFrame();
    frame.scene.planes = nowhere;
    isEmpty(frame, {.split = {}, .fit = fit});
    frame = usualFrame();
    const std::uint32_t none[8] = {};
    const Samples samples{.near = 1.0, .far = 50.0, .histogram = none};
    frame.samples = &samples;
    isEmpty(frame, {.split = {}, .fit = fit});
  }
}

struct Scenery {
  std::vector<Box> receivers, casters;
  std::vector<glm::dvec4> planes;
};

// A random view, scene and budget.
Frame randomFrame(Random& random, Scenery& scenery) {
  Frame frame;
  const double scale = random.logUniform(1e-3, 1e3);
  const glm::dvec3 position = random.index(3) == 0
                                  ? glm::dvec3(random.uniform(-1e5, 1e5), random.uniform(-10, 10), random.uniform(-1e5, 1e5)) * scale
                                  : glm::dvec3(random.uniform(-10, 10)) * scale;
  const double near = random.logUniform(0.01, 1.0) * scale, far = near * random.logUniform(1.5, 1e4);
  const glm::dvec3 forward = random.direction(), up = random.direction();
  if (random.index(4) == 0)
    frame.camera =
        orthographic(position, forward, up, far * random.uniform(0.1, 2.0), random.uniform(0.3, 3.0), random.index(2) ? -far : near, far);
  else
    frame.camera = perspective(position, forward, up, random.uniform(0.05, 2.4), random.uniform(0.3, 3.0), near, far);
  if (random.index(4) == 0) {
    frame.camera.left *= random.uniform(-0.5, 1.5);
    frame.camera.up *= random.uniform(-0.5, 1.5);
  }
  if (random.index(4) == 0) frame.camera.shadowDistance = far * random.uniform(0.3, 1.0);
  frame.camera.depth = static_cast<DepthConvention>(random.index(3));
  frame.shadowMap.depth = static_cast<DepthConvention>(random.index(3));
  frame.shadowMap.style = static_cast<ClipStyle>(random.index(3));
  frame.shadowMap.layout = static_cast<MapLayout>(random.index(2));
  const Axes axes(frame.camera);
  switch (random.index(4)) {
    case 0: frame.light.directionWs = axes.forward; break;
    case 1: frame.light.directionWs = -axes.forward + random.direction() * 1e-7; break;
    default: frame.light.directionWs = random.direction() * random.logUniform(1e-6, 1e6);
  }
  scenery = {};
  if (random.index(2) == 0)
    for (int i = 0, n = 1 + random.index(5); i < n; ++i) {
      const double z = random.uniform(near, far);
      const glm::dvec3 centre = position + axes.forward * z + random.direction() * z * 0.5, half = glm::abs(random.direction()) * z * 0.3;
      scenery.receivers.push_back({centre - half, centre + (random.index(5) == 0 ? -half : half)});
    }
  if (random.index(3) == 0) {
    const glm::dvec3 n = random.direction();
    scenery.planes.emplace_back(n, -glm::dot(n, position + axes.forward * random.uniform(near, far)));
  }
  if (random.index(3) == 0) scenery.casters.push_back({position - glm::dvec3(far), position + glm::dvec3(far * 0.5)});
  frame.scene = {scenery.receivers, scenery.casters, scenery.planes};
  frame.budget.partitions = 1 + random.index(16);
  frame.budget.resolution = 1 << (4 + random.index(8));
  return frame;
}

// Every point to be shadowed is served, lies inside its map, and is no less sharp there than predicted.
TEST(Pssm, CoversRandomViewsAsPredicted) {
  Random random(2026);
  int points = 0;
  for (int i = 0; i < 3000; ++i) {
    Scenery scenery;
    const Frame frame = randomFrame(random, scenery);
    const PssmSettings settings{.split = {.scheme = static_cast<SplitScheme>(random.index(3)), .lambda = random.uniform()},
                                .fit = static_cast<FitMode>(random.index(3))};
    const auto solution = solve(frame, settings);
    ASSERT_EQ(solution->status, Status::ok) << i << " " << statusField(solution->status);
    EXPECT_TRUE(isFinite(*solution)) << i;
    EXPECT_LE(solution->partitionCount, frame.budget.partitions);
    const Coverage coverage = checkAll(frame, *solution, 5, 21);
    points += coverage.points;
    EXPECT_EQ(coverage.uncovered, 0) << "view " << i << ", of " << coverage.points;
    EXPECT_LE(coverage.worst, 1.0 + 1e-6) << "view " << i;
    for (int a = 0; a < solution->partitionCount; ++a) {
      const Partition& map = solution->partitions[a];
      EXPECT_GE(map.far, map.near);
      if (a > 0) {
        EXPECT_GE(map.near, solution->partitions[a - 1].far);
        EXPECT_GT(map.near, solution->partitions[a - 1].near);
      }
    }
  }
  EXPECT_GT(points, 200000);
}

// Predictions meet the measured error where no scene cuts the region: 1e-6 for rounding, no more.
TEST(Pssm, PredictionsAreTight) {
  Random random(8);
  for (int i = 0; i < 200; ++i) {
    Frame frame = usualFrame();
    frame.camera.forwardWs = random.direction();
    frame.light.directionWs = random.direction();
    const auto solution = solve(frame);
    for (int k = 0; k < solution->partitionCount; ++k) {
      const Partition& map = solution->partitions[k];
      const double pixel = pixelAt(frame, map.near);
      const glm::dvec2 texel =
          measuredTexel(map, viewPoint(frame.camera, 0.5, 0.5, map.near), frame.light.directionWs, pixel * 1e3) / pixel;
      EXPECT_NEAR(map.error.s / texel.x, 1.0, 1e-5);
      EXPECT_NEAR(map.error.t / texel.y, 1.0, 1e-5);
    }
  }
}

// Light overhead, level camera: [Lloyd 2006, sec. 5.2], S of z-partitions without warp, k R^(1/k) (R^(1/k) - 1) / (2 tan theta).
TEST(Pssm, NeededTexelsAreLloydsClosedForm) {
  for (const double degrees : {40.0, 60.0, 90.0})
    for (const double ratio : {50.0, 1e3, 1e4})
      for (const int count : {1, 2, 4, 8}) {
        Frame frame;
        frame.camera = perspective({3, 7, -2}, {0, 0, -1}, {0, 1, 0}, degrees * kPi / 180.0, 1.0, 0.5, 0.5 * ratio);
        frame.camera.depth = DepthConvention::reversedZeroToOne;  // float depth fine enough for the padding to vanish
        frame.light.directionWs = {0, -1, 0};
        frame.image = {1080, 1080};
        frame.budget.partitions = count;
        const auto solution = solve(frame, {.split = {}, .fit = FitMode::slice});
        const double root = std::pow(ratio, 1.0 / count), t = std::tan(degrees * kPi / 360.0);
        EXPECT_NEAR(solution->storageFactor / (count * root * (root - 1.0) / (2.0 * t)), 1.0, 1e-4);
      }
}

TEST(Pssm, LimitIsTheClosedForm) {
  // Light along the view: a |l_z| + ln R / 2t * sum over the four sides of |N . l| w, with N . l = -a t, -a t, -t, -t and w = 1, 1, a, a.
  Frame frame;
  frame.camera = perspective({0, 0, 0}, {0, 0, -1}, {0, 1, 0}, 2.0 * std::atan(0.5), 2.0, 1.0, std::exp(3.0));
  frame.light.directionWs = {0, 0, -1};
  frame.image = {2000, 1000};
  EXPECT_NEAR(solve(frame)->limitTexels / 1e6, 2.0 + 3.0 / (2.0 * 0.5) * 4.0 * 2.0 * 0.5, 1e-9);
  frame.camera.right = 0.7;  // asymmetric: 1.7 wide instead of 2, and the sides' slopes 1, 0.7 (height 1) and 0.5, 0.5 (width 1.7)
  EXPECT_NEAR(solve(frame)->limitTexels / 1e6, 1.7 + 3.0 * (1.7 + 1.7), 1e-9);
}

// A world scaled by a power of two gives the same bits, up to the scale.
TEST(Pssm, ScalesExactly) {
  Random random(4);
  for (const double scale : {0x1p-20, 0x1p20}) {
    for (const FitMode fit : {FitMode::tight, FitMode::slice, FitMode::stable}) {
      Frame frame = usualFrame();
      frame.light.directionWs = random.direction();
      const std::vector<Box> boxes{{{-5, -1, 2}, {5, 3, 30}}};
      frame.scene.receivers = boxes;
      Frame scaled = frame;
      scaled.camera.positionWs *= scale;
      scaled.camera.near *= scale;
      scaled.camera.far *= scale;
      const std::vector<Box> scaledBoxes{{boxes[0].minWs * scale, boxes[0].maxWs * scale}};
      scaled.scene.receivers = scaledBoxes;
      const auto a = solve(frame, {.split = {}, .fit = fit}), b = solve(scaled, {.split = {}, .fit = fit});
      ASSERT_EQ(a->partitionCount, b->partitionCount);
      for (int i = 0; i < a->partitionCount; ++i) {
        // pow and log of a scaled argument may differ in the last bit, so depths agree to double rounding, not to the bit.
        EXPECT_NEAR(b->partitions[i].near / scale / a->partitions[i].near, 1.0, 1e-13);
        EXPECT_EQ(a->partitions[i].viewport, b->partitions[i].viewport);
        EXPECT_NEAR(b->partitions[i].error.s / a->partitions[i].error.s, 1.0, 1e-6);
        for (int r = 0; r < 4; ++r)
          for (int c = 0; c < 4; ++c)
            EXPECT_NEAR(b->partitions[i].clipFromWorld[c][r] * (c < 3 ? scale : 1.0), a->partitions[i].clipFromWorld[c][r], 1e-6 * 20);
      }
    }
  }
}

// Moving the whole world by 1e7, or turning it, leaves needed texels and splits as they are.
TEST(Pssm, MovesAndTurnsWithTheWorld) {
  Random random(6);
  for (int i = 0; i < 50; ++i) {
    Frame frame = usualFrame();
    frame.light.directionWs = random.direction();
    const auto a = solve(frame);
    Frame moved = frame;
    moved.camera.positionWs += random.direction() * 1e7;
    EXPECT_NEAR(solve(moved)->neededTexels / a->neededTexels, 1.0, 1e-6);
    const glm::dvec3 x = random.direction(), y = glm::normalize(glm::cross(x, random.direction()));
    const glm::dmat3 turn(x, y, glm::cross(x, y));
    Frame turned = frame;
    turned.camera.forwardWs = turn * frame.camera.forwardWs;
    turned.camera.upWs = turn * frame.camera.upWs;
    turned.camera.positionWs = turn * frame.camera.positionWs;
    turned.light.directionWs = turn * frame.light.directionWs;
    const auto b = solve(turned);
    EXPECT_NEAR(b->neededTexels / a->neededTexels, 1.0, 1e-6);
    for (int k = 0; k < 4; ++k) EXPECT_NEAR(b->partitions[k].near / a->partitions[k].near, 1.0, 1e-12);
  }
}

TEST(Pssm, AutomaticCountIsTheLeastThatMeetsTheTarget) {
  for (const double target : {1.0, 2.0, 5.0, 50.0}) {
    Frame frame = usualFrame();
    frame.budget.targetError = target;
    frame.budget.partitions = 16;
    const auto solution = solve(frame, {.split = {.automatic = true}});
    ASSERT_EQ(solution->status, Status::ok);
    EXPECT_LE(solution->maxError, target);
    if (solution->partitionCount > 1) {
      frame.budget.partitions = solution->partitionCount - 1;
      EXPECT_GT(solve(frame, {.split = {.count = solution->partitionCount - 1}})->maxError, target);
      const auto missed = solve(frame, {.split = {.automatic = true}});
      EXPECT_EQ(missed->partitionCount, frame.budget.partitions);
      EXPECT_NE(missed->warnings & static_cast<std::uint32_t>(Warning::targetMissed), 0u);
    }
  }
}

TEST(Pssm, GapsInDepthGetNoPartition) {
  Frame frame = usualFrame();
  frame.camera = perspective({0, 0, 0}, {0, 0, -1}, {0, 1, 0}, 1.0, 1.5, 0.1, 1000.0);
  const std::vector<Box> boxes{{{-1, -1, -4}, {1, 1, -2}}, {{-100, -100, -900}, {100, 100, -700}}};
  frame.scene.receivers = boxes;
  const auto solution = solve(frame);
  for (int i = 0; i < solution->partitionCount; ++i) {
    const Partition& map = solution->partitions[i];
    EXPECT_TRUE(map.far <= 4.0 + 1e-9 || map.near >= 700.0 - 1e-9) << map.near << " " << map.far;
    EXPECT_GE(map.near, 2.0 - 1e-9);
  }
  EXPECT_EQ(selectByViewDepth(solution->block, 100.0f), -1);
  EXPECT_EQ(selectByViewDepth(solution->block, 1.0f), -1);
  EXPECT_EQ(selectByViewDepth(solution->block, 3.9f), servedBy(*solution, 3.9, 0.0));
}

TEST(Pssm, WorldSpaceMatricesWarnAndCover) {
  Frame frame = usualFrame();
  frame.worldSpace = true;
  frame.camera.positionWs = {20000.0, 50.0, -30000.0};
  const auto solution = solve(frame);
  ASSERT_EQ(solution->status, Status::ok);
  EXPECT_NE(solution->warnings & static_cast<std::uint32_t>(Warning::worldSpacePrecision), 0u);
  EXPECT_EQ(solution->originWs, glm::dvec3(0.0));
  EXPECT_EQ(checkAll(frame, *solution).uncovered, 0);
  frame.camera.positionWs = {1.0, 2.0, 3.0};
  EXPECT_EQ(solve(frame)->warnings & static_cast<std::uint32_t>(Warning::worldSpacePrecision), 0u);
}

TEST(Pssm, CollapsedDepthSelectsByViewDepth) {
  Frame frame = usualFrame();
  frame.camera.near = 1e-4;
  frame.camera.far = 1e5;
  frame.budget.partitions = 16;
  const auto solution = solve(frame);
  ASSERT_EQ(solution->status, Status::ok);
  EXPECT_NE(solution->warnings & static_cast<std::uint32_t>(Warning::viewDepthSelection), 0u);
  EXPECT_NE(solution->block.info.y & GNOMON_FLAG_VIEW_DEPTH, 0u);
  EXPECT_EQ(checkAll(frame, *solution).uncovered, 0);
  frame.camera.depth = DepthConvention::reversedZeroToOne;  // tells them apart
  EXPECT_EQ(solve(frame)->warnings, 0u);
}

TEST(Pssm, AllocatesNothing) {
  Random random(12);
  auto solution = std::make_unique<Solution>();
  for (int i = 0; i < 200; ++i) {
    Scenery scenery;
    const Frame frame = randomFrame(random, scenery);
    const PssmSettings settings{.split = {.automatic = i % 2 == 0}};
    const std::size_t before = allocationCount();
    (void)solvePssm(frame, settings, *solution);
    EXPECT_EQ(allocationCount(), before);
  }
}

TEST(Pssm, IsDeterministic) {
  Random random(13);
  for (int i = 0; i < 200; ++i) {
    Scenery scenery;
    const Frame frame = randomFrame(random, scenery);
    const auto a = solve(frame);
    auto b = std::make_unique<Solution>();
    (void)solvePssm(usualFrame(), {}, *b);  // a used one answers the same as a fresh one
    (void)solvePssm(frame, {}, *b);
    ASSERT_EQ(a->partitionCount, b->partitionCount);
    const std::size_t bytes =
        sizeof(GnomonBlock) - sizeof a->block.partitions + static_cast<std::size_t>(a->partitionCount) * sizeof(GnomonPartition);
    EXPECT_EQ(std::memcmp(&a->block, &b->block, bytes), 0);
  }
}

// The volume of the corners, a point in it by shares of its edges.
glm::dvec3 cornerPoint(const std::vector<glm::dvec3>& corners, double x, double y, double z) {
  glm::dvec3 point(0.0);
  for (std::size_t i = 0; i < 8; ++i) point += corners[i] * (((i & 1) ? x : 1.0 - x) * ((i & 2) ? y : 1.0 - y) * ((i & 4) ? z : 1.0 - z));
  return point;
}

// Dense points of the volume, between the camera's near plane and shadow distance: each is served and covered, no less sharp than said.
Coverage checkCorners(const Frame& frame, const Solution& solution, const std::vector<glm::dvec3>& corners) {
  Coverage coverage;
  const Axes axes(frame.camera);
  constexpr int kAcross = 9, kDeep = 81;
  for (int x = 0; x < kAcross; ++x)
    for (int y = 0; y < kAcross; ++y)
      for (int z = 0; z < kDeep; ++z) {
        const double share = z / (kDeep - 1.0);
        const glm::dvec3 fromEye =
            cornerPoint(corners, x / (kAcross - 1.0), y / (kAcross - 1.0), share * share * share) - frame.camera.positionWs;
        const double depth = glm::dot(fromEye, axes.forward);
        if (depth >= frame.camera.near && depth <= std::min(frame.camera.far, frame.camera.shadowDistance))
          check(frame, solution, fromEye, depth, coverage);
      }
  return coverage;
}

TEST(PssmCorners, TheCamerasOwnCornersGiveTheCamerasMaps) {
  for (const FitMode fit : {FitMode::tight, FitMode::slice})
    for (const Projection projection : {Projection::perspective, Projection::orthographic}) {
      Frame frame = usualFrame();
      if (projection == Projection::orthographic)
        frame.camera = orthographic(frame.camera.positionWs, frame.camera.forwardWs, frame.camera.upWs, 20.0, 1.5, -15.0, 80.0);
      const auto own = solve(frame, {.split = {}, .fit = fit});
      std::vector<glm::dvec3> corners;
      for (int i = 0; i < 8; ++i)
        corners.push_back(frame.camera.positionWs +
                          viewPoint(frame.camera, i & 1, (i >> 1) & 1, (i & 4) ? frame.camera.far : frame.camera.near));
      frame.cornersWs = corners;
      const auto solution = solve(frame, {.split = {}, .fit = fit});
      ASSERT_EQ(solution->status, Status::ok);
      ASSERT_EQ(solution->partitionCount, own->partitionCount);
      EXPECT_NEAR(solution->limitTexels / own->limitTexels, 1.0, 1e-9);
      for (int i = 0; i < own->partitionCount; ++i) {
        EXPECT_NEAR(solution->partitions[i].near, own->partitions[i].near, 1e-9 * std::abs(own->partitions[i].far));
        EXPECT_NEAR(solution->partitions[i].error.s * solution->partitions[i].error.t,
                    own->partitions[i].error.s * own->partitions[i].error.t,
                    1e-3 * own->partitions[i].error.s * own->partitions[i].error.t);
      }
      EXPECT_EQ(checkAll(frame, *solution).uncovered, 0);
    }
}

TEST(PssmCorners, CoverAnyConvexVolume) {
  Random random(17);
  int points = 0;
  for (int k = 0; k < 200; ++k) {
    Frame frame = usualFrame();
    frame.light.directionWs = random.direction();
    frame.camera.positionWs = random.direction() * random.logUniform(1.0, 1e5);
    frame.shadowMap.style = static_cast<ClipStyle>(k % 3);
    frame.camera.depth = static_cast<DepthConvention>(k / 3 % 3);
    if (k % 5 == 4) frame.camera.shadowDistance = 30.0;
    const Axes axes(frame.camera);
    // Two faces of one shape, ahead of the eye, turned alike and scaled: the four between them are flat.
    const glm::dvec3 tilt = 0.4 * random.direction(), a = axes.right + axes.forward * tilt.x, b = axes.up + axes.forward * tilt.y;
    const double near = random.logUniform(0.05, 5.0), far = near * random.logUniform(2.0, 200.0), grow = random.uniform(0.5, 2.0);
    const glm::dvec3 along = axes.forward + axes.right * random.uniform(-0.5, 0.5) + axes.up * random.uniform(-0.5, 0.5);
    std::vector<glm::dvec3> corners;
    for (int i = 0; i < 8; ++i) {
      const double z = (i & 4) ? far : near, size = (i & 4) ? grow * far : near;
      corners.push_back(frame.camera.positionWs + along * z + (a * ((i & 1) ? 1.0 : -1.0) + b * ((i & 2) ? 0.6 : -0.6)) * (0.5 * size));
    }
    frame.cornersWs = corners;
    const FitMode fit = k % 2 ? FitMode::tight : FitMode::slice;
    const auto solution = solve(frame, {.split = {}, .fit = fit});
    ASSERT_EQ(solution->status, Status::ok) << k;
    ASSERT_GT(solution->partitionCount, 0);
    ASSERT_TRUE(isFinite(*solution));
    const Coverage coverage = checkCorners(frame, *solution, corners);
    points += coverage.points;
    ASSERT_EQ(coverage.uncovered, 0) << k;
    ASSERT_LE(coverage.worst, 1.0 + 1e-3) << k;
    // Cull planes hold every caster of every point.
    for (int r = 0; r < 200; ++r) {
      const glm::dvec3 ws = cornerPoint(corners, random.uniform(), random.uniform(), random.uniform());
      const double z = glm::dot(ws - frame.camera.positionWs, axes.forward);
      const int served = servedBy(*solution, z, 0.0);
      if (served < 0) continue;
      const glm::dvec3 caster = ws - glm::normalize(frame.light.directionWs) * random.logUniform(1e-3, 1e4);
      ASSERT_TRUE(mayCast(solution->partitions[served], {caster, caster})) << k;
    }
  }
  EXPECT_GT(points, 200000);
}

// The two eyes of a headset, parallel and canted: one solve covers what either sees.
TEST(PssmCorners, AStereoPairSharesItsMaps) {
  for (const double cant : {0.0, 0.17}) {
    Frame frame;
    frame.camera = perspective({7.0, 1.7, -3.0}, {0.2, -0.1, -1.0}, {0.0, 1.0, 0.0}, 1.6, 1.0, 0.1, 200.0);
    const Axes axes(frame.camera);
    std::array<Camera, 2> eyes{frame.camera, frame.camera};
    for (int e = 0; e < 2; ++e) {
      const double sign = e ? 1.0 : -1.0;
      Camera& eye = eyes[static_cast<std::size_t>(e)];
      eye.positionWs += axes.right * (0.032 * sign);
      eye.forwardWs = axes.forward + axes.right * (std::tan(cant) * sign);
      (e ? eye.right : eye.left) = 1.3;
    }
    glm::dvec3 corners[8];
    enclose(eyes, frame.camera, corners);
    frame.camera.near = 0.05;  // a canted eye sees before the head's near plane
    frame.cornersWs = corners;
    const auto solution = solve(frame);
    ASSERT_EQ(solution->status, Status::ok);
    Coverage coverage;
    for (const Camera& eye : eyes)
      for (int k = 0; k < 41; ++k)
        for (int x = 0; x < 9; ++x)
          for (int y = 0; y < 9; ++y) {
            const glm::dvec3 fromEye =
                viewPoint(eye, x / 8.0, y / 8.0, 0.1 * std::pow(2000.0, k / 40.0)) + eye.positionWs - frame.camera.positionWs;
            const double z = glm::dot(fromEye, axes.forward);
            if (z <= 200.0) check(frame, *solution, fromEye, z, coverage);
          }
    EXPECT_GT(coverage.points, 5000);
    EXPECT_EQ(coverage.uncovered, 0) << cant;
  }
}

TEST(PssmCorners, RefusesWhatIsNoConvexVolume) {
  Frame frame = usualFrame();
  std::vector<glm::dvec3> box;
  for (int i = 0; i < 8; ++i) box.emplace_back((i & 1) ? 3.0 : -1.0, (i & 2) ? 3.0 : 1.0, (i & 4) ? 30.0 : 5.0);
  const auto status = [&](const std::vector<glm::dvec3>& corners, FitMode fit = FitMode::tight) {
    frame.cornersWs = corners;
    const auto solution = solve(frame, {.split = {}, .fit = fit});
    if (solution->status != Status::ok) {
      EXPECT_EQ(solution->partitionCount, 0);
      EXPECT_EQ(solution->block.info.x, 0u);
    }
    return solution->status;
  };
  EXPECT_EQ(status(box), Status::ok);
  EXPECT_EQ(status(box, FitMode::stable), Status::stableCorners);
  std::vector<glm::dvec3> bad(box.begin(), box.end() - 1);
  EXPECT_EQ(status(bad), Status::corners) << "seven";
  bad = box;
  bad[3].y = kInfinity;
  EXPECT_EQ(status(bad), Status::corners) << "infinite";
  bad[3].y = std::nan("");
  EXPECT_EQ(status(bad), Status::corners) << "not a number";
  bad = box;
  std::swap(bad[0], bad[1]);
  EXPECT_EQ(status(bad), Status::corners) << "out of order";
  bad = box;
  bad[7] += glm::dvec3(0.5, 0.0, 0.0);
  EXPECT_EQ(status(bad), Status::corners) << "a bent face";
  bad[7] = box[7] + glm::dvec3(1e-4, 0.0, 0.0);  // within what float32 corners have
  EXPECT_EQ(status(bad), Status::ok);
  bad = box;
  for (glm::dvec3& corner : bad) corner.y = 1.0;
  EXPECT_EQ(status(bad), Status::corners) << "flat";
  bad.assign(8, glm::dvec3(0.0));
  EXPECT_EQ(status(bad), Status::corners) << "a point";
  bad = box;
  for (std::size_t i = 0; i < 8; i += 2) std::swap(bad[i], bad[i + 1]);
  EXPECT_EQ(status(bad), Status::ok) << "mirrored";
  for (glm::dvec3& corner : box) corner -= glm::dvec3(0.0, 0.0, 200.0);  // behind the eye
  frame.cornersWs = box;
  const auto behind = solve(frame);
  EXPECT_EQ(behind->status, Status::ok);
  EXPECT_EQ(behind->partitionCount, 0);
}

}  // namespace
}  // namespace gnomon::test
