#include <algorithm>

#include "support.h"

#include "allocations.h"
#include "gnomon/sdsm.h"

namespace gnomon::test {
namespace {

std::unique_ptr<Solution> solve(const Frame& frame, const SdsmSettings& settings) {
  auto solution = std::make_unique<Solution>();
  SdsmState state;
  (void)solveSdsm(frame, settings, state, *solution);
  return solution;
}

constexpr SdsmScheme kSchemes[] = {SdsmScheme::logarithmic, SdsmScheme::kmeans, SdsmScheme::adaptive, SdsmScheme::optimal};

TEST(Sdsm, Refuses) {
  Frame frame = usualFrame();
  EXPECT_EQ(solve(frame, {})->status, Status::samplesMissing);
  Samples samples{.near = 0.5, .far = 50.0};
  frame.samples = &samples;
  EXPECT_EQ(solve(frame, {})->status, Status::ok);
  for (const double bad : {-0.1, 1.1, std::nan("")}) EXPECT_EQ(solve(frame, {.hysteresis = bad})->status, Status::sdsmHysteresis);
  EXPECT_EQ(solve(frame, {.count = 5})->status, Status::splitCount);
  const auto refuses = [&](Samples bad, Status status) {
    frame.samples = &bad;
    const auto solution = solve(frame, {});
    EXPECT_EQ(solution->status, status);
    EXPECT_EQ(solution->partitionCount, 0);
    EXPECT_EQ(gnomon::test::solve(frame)->status, status);  // every method reads them
  };
  const std::uint32_t counts[] = {1, 2};
  const double weights[] = {1.0, std::nan("")};
  const SampleBounds bounds[] = {{1.0, 2.0, {0.0, 0.0}, {1.0, 1.0}}, {2.0, 1.0, {0.0, 0.0}, {1.0, 1.0}}};
  refuses({.near = std::nan(""), .far = 1.0}, Status::samplesNear);
  refuses({.near = 0.0, .far = 1.0, .histogram = counts}, Status::samplesNear);
  refuses({.near = 2.0, .far = 1.0}, Status::samplesFar);
  refuses({.near = 1.0, .far = kInfinity}, Status::samplesFar);
  refuses({.near = 1.0, .far = 2.0, .histogram = counts, .weights = weights}, Status::samplesWeights);
  refuses({.near = 1.0, .far = 2.0, .weights = weights}, Status::samplesWeights);
  refuses({.near = 1.0, .far = 2.0, .bounds = bounds}, Status::samplesBounds);
  refuses({.near = 1.0, .far = 2.0, .rightWs = {0.0, std::nan(""), 1.0}}, Status::samplesBounds);
  refuses({.near = 1.0, .far = 2.0, .latency = -1.0}, Status::samplesLatency);
}

// Tight bounds, equal ratios: [Zhang 2006, eq. 4] between the nearest and the farthest sample.
TEST(Sdsm, LogarithmicOnTightBounds) {
  Frame frame = usualFrame();
  const Samples samples{.near = 2.0, .far = 32.0};
  frame.samples = &samples;
  const auto solution = solve(frame, {});
  ASSERT_EQ(solution->partitionCount, 4);
  for (int i = 0; i < 4; ++i) {
    EXPECT_NEAR(solution->partitions[i].near, 2.0 * std::pow(2.0, i), 1e-12);
    EXPECT_NEAR(solution->partitions[i].far, 4.0 * std::pow(2.0, i), 1e-12);
  }
  EXPECT_LT(solution->maxError, gnomon::test::solve(usualFrame())->maxError / 3.0);
}

// What was sampled: positions with their view depth.
struct Cloud {
  std::vector<glm::dvec3> fromEye;
  std::vector<double> depths;
};

Cloud randomCloud(Random& random, const Camera& camera, double near, double far, int points) {
  Cloud cloud;
  const double x0 = random.uniform(0.0, 0.6), y0 = random.uniform(0.0, 0.6), drift = random.uniform(0.0, 0.3);
  for (int i = 0; i < points; ++i) {
    const double share = random.uniform(), z = near * std::pow(far / near, share);
    cloud.depths.push_back(z);
    cloud.fromEye.push_back(viewPoint(camera, x0 + 0.1 * random.uniform() + drift * share, y0 + 0.3 * random.uniform(), z));
  }
  return cloud;
}

// Every sample given lies in its partition's map, whatever the scheme, with bounds, latency, hysteresis and quantisation, in all depth
// conventions; maps are never larger than the plain fit's where nothing holds them.
TEST(Sdsm, CoversWhatItWasGiven) {
  Random random(81);
  SdsmState state;
  for (int k = 0; k < 1500; ++k) {
    Frame frame = usualFrame();
    frame.camera.forwardWs = random.direction();
    frame.camera.upWs = random.direction();
    frame.camera.depth = static_cast<DepthConvention>(k % 3);
    if (k % 7 == 0) frame.camera = orthographic({0, 3, 0}, random.direction(), random.direction(), 20.0, 1.5, 0.1, 100.0);
    frame.light.directionWs = k % 2 ? glm::dvec3(0.3, -0.8, 0.2) : random.direction();
    frame.budget.partitions = 1 + random.index(6);
    if (k % 5 == 0) frame.margin.blend = 0.2;
    if (k % 6 == 0) frame.margin.filter = 2.0;
    // Samples may be those of a camera that has moved and turned since: its depths, its axes.
    const Camera taken = frame.camera;
    const bool isLate = k % 4 == 1;
    const double turn = isLate ? random.uniform(0.0, 0.02) : 0.0;
    const Axes takenAxes(taken);
    if (isLate) frame.camera.forwardWs = takenAxes.forward * std::cos(turn) + takenAxes.right * std::sin(turn);
    if (isLate) frame.camera.upWs = takenAxes.up;
    const double near = random.logUniform(0.2, 20.0), far = near * random.logUniform(1.0, 90.0 / near);
    const Cloud cloud = randomCloud(random, taken, near, far, 1 + random.index(100));
    Samples samples;
    for (const double z : cloud.depths) samples.near = std::min(samples.near, z), samples.far = std::max(samples.far, z);
    std::vector<std::uint32_t> histogram(static_cast<std::size_t>(k % 4 == 0 ? 0 : 1 + random.index(300)), 0u);
    const auto binOf = [&](double z) {
      const double share = std::log(z / samples.near) / std::max(std::log(samples.far / samples.near), 1e-300);
      return std::min(static_cast<std::size_t>(std::max(share, 0.0) * static_cast<double>(histogram.size())), histogram.size() - 1);
    };
    for (const double z : cloud.depths)
      if (!histogram.empty()) ++histogram[binOf(z)];
    samples.histogram = histogram;
    // Bounds in intervals that are not the slices, as those of a frame before would be.
    std::vector<SampleBounds> bounds;
    if (k % 3 != 0) {
      const glm::dvec3 l = glm::normalize(frame.light.directionWs), right = takenAxes.right;
      if (std::abs(glm::dot(l, right)) > 0.99) continue;  // along the light it says nothing
      if (isLate) samples.rightWs = 3.0 * right;
      const glm::dvec3 x = glm::normalize(right - l * glm::dot(l, right)), y = glm::cross(x, l);
      const int parts = 1 + random.index(5);
      for (int i = 0; i < parts; ++i) {
        SampleBounds part{samples.near * std::pow(samples.far / samples.near, static_cast<double>(i) / parts),
                          samples.near * std::pow(samples.far / samples.near, (i + 1.0) / parts), glm::dvec2(kInfinity),
                          glm::dvec2(-kInfinity)};
        if (i == 0) part.near = samples.near;
        if (i + 1 == parts) part.far = samples.far;
        for (std::size_t p = 0; p < cloud.depths.size(); ++p) {
          if (!(cloud.depths[p] >= part.near * (1.0 - 1e-5) && cloud.depths[p] <= part.far * (1.0 + 1e-5))) continue;
          const glm::dvec2 ls(glm::dot(x, cloud.fromEye[p]), glm::dot(y, cloud.fromEye[p]));
          part.least = glm::min(part.least, ls);
          part.most = glm::max(part.most, ls);
        }
        if (part.least.x <= part.most.x) bounds.push_back(part);
      }
      samples.bounds = bounds;
    }
    // The cloud stays in the world, the samples do not know.
    const glm::dvec3 moved = isLate ? random.direction() * random.uniform(0.0, 0.3) : glm::dvec3(0.0);
    double reach = 0.0;
    for (const glm::dvec3& p : cloud.fromEye) reach = std::max(reach, glm::length(p));
    if (isLate) samples.latency = 0.3 + turn * reach;
    frame.samples = &samples;
    const SdsmSettings settings{.scheme = kSchemes[random.index(4)],
                                .norm = static_cast<SampleNorm>(random.index(3)),
                                .hysteresis = k % 5 < 2 ? 0.3 : 0.0,
                                .quantise = k % 8 < 3};
    Solution solution;
    ASSERT_EQ(solveSdsm(frame, settings, state, solution), Status::ok) << k;
    ASSERT_TRUE(isFinite(solution)) << k;
    const Axes axes(frame.camera);
    for (std::size_t p = 0; p < cloud.depths.size(); ++p) {
      const glm::dvec3 fromEye = cloud.fromEye[p] - moved;
      const double z = glm::dot(fromEye, axes.forward);
      if (!(z >= frame.camera.near)) continue;
      const double w = frame.camera.projection == Projection::perspective ? z : 1.0, x = glm::dot(fromEye, axes.right),
                   y = glm::dot(fromEye, axes.up);
      if (x < -frame.camera.left * w || x > frame.camera.right * w || y < -frame.camera.down * w || y > frame.camera.up * w) continue;
      Coverage coverage;
      check(frame, solution, fromEye, z, coverage);
      ASSERT_EQ(coverage.uncovered, 0) << k << " depth " << z << " of " << samples.near << " to " << samples.far;
      ASSERT_LE(coverage.worst, 1.0 + 1e-5) << k;
    }
    if (settings.hysteresis > 0.0 || settings.quantise) continue;
    // Bounds only cut.
    SdsmSettings plain = settings;
    plain.bounds = false;
    const auto without = solve(frame, plain);
    EXPECT_LE(solution.neededTexels, without->neededTexels * (1.0 + 1e-4)) << k;
    EXPECT_LE(solution.partitionCount, without->partitionCount);
  }
}

// Samples before the near plane, at the eye and behind it are not shadowed, and change nothing.
TEST(Sdsm, NothingBeforeTheNearPlaneCounts) {
  Frame frame = usualFrame();
  Samples samples{.near = frame.camera.near, .far = 90.0};
  frame.samples = &samples;
  for (const SdsmScheme scheme : kSchemes)
    for (const SampleNorm norm : {SampleNorm::max, SampleNorm::mean, SampleNorm::meanSquare}) {
      samples.near = frame.camera.near;
      const auto whole = solve(frame, {.scheme = scheme, .norm = norm});
      ASSERT_EQ(whole->partitionCount, 4);
      for (const double near : {0.05, 0.0, -1.0, -1e6}) {
        samples.near = near;
        const auto solution = solve(frame, {.scheme = scheme, .norm = norm});
        ASSERT_EQ(solution->partitionCount, 4) << static_cast<int>(scheme) << " " << near;
        EXPECT_NEAR(solution->maxError, whole->maxError, 1e-9 * whole->maxError) << static_cast<int>(scheme) << " " << near;
      }
    }
}

// Bins without samples get no map: a view of a hand and a hill.
TEST(Sdsm, EmptyPartitionsVanish) {
  Frame frame = usualFrame();
  std::vector<std::uint32_t> histogram(100, 0u);
  histogram[0] = histogram[1] = 5u;
  histogram[98] = histogram[99] = 7u;
  const Samples samples{.near = 0.2, .far = 90.0, .histogram = histogram};
  frame.samples = &samples;
  for (const SdsmScheme scheme : kSchemes) {
    const auto solution = solve(frame, {.scheme = scheme});
    ASSERT_GE(solution->partitionCount, 2) << static_cast<int>(scheme);
    for (int i = 0; i < solution->partitionCount; ++i)
      EXPECT_TRUE(solution->partitions[i].far < 0.3 || solution->partitions[i].near > 70.0) << static_cast<int>(scheme);
  }
  EXPECT_EQ(solve(frame, {})->partitionCount, 2);  // the slides' scheme spends two of four on the gap
  EXPECT_EQ(solve(frame, {.scheme = SdsmScheme::adaptive})->partitionCount, 4);
  EXPECT_LT(solve(frame, {.scheme = SdsmScheme::optimal})->maxError, solve(frame, {})->maxError);
}

// A scaled world gives the same answer, scaled.
TEST(Sdsm, ScaleFree) {
  for (const double scale : {1e-6, 1e6}) {
    Frame frame = usualFrame(), scaled = frame;
    scaled.camera.positionWs *= scale;
    scaled.camera.near *= scale;
    scaled.camera.far *= scale;
    const std::uint32_t counts[] = {5, 0, 1000, 3, 3, 0, 0, 100};
    const SampleBounds bounds[] = {{1.0, 8.0, {-1.0, -1.0}, {3.0, 1.0}}, {8.0, 60.0, {-5.0, -9.0}, {10.0, 2.0}}};
    SampleBounds large[] = {bounds[0], bounds[1]};
    for (SampleBounds& b : large) b = {b.near * scale, b.far * scale, b.least * scale, b.most * scale};
    const Samples samples{.near = 1.0, .far = 60.0, .histogram = counts, .bounds = bounds, .latency = 0.01};
    const Samples largeSamples{.near = scale, .far = 60.0 * scale, .histogram = counts, .bounds = large, .latency = 0.01 * scale};
    frame.samples = &samples;
    scaled.samples = &largeSamples;
    for (const SdsmScheme scheme : kSchemes) {
      const auto a = solve(frame, {.scheme = scheme, .norm = SampleNorm::mean}),
                 b = solve(scaled, {.scheme = scheme, .norm = SampleNorm::mean});
      ASSERT_EQ(a->partitionCount, b->partitionCount);
      EXPECT_NEAR(b->maxError / a->maxError, 1.0, 1e-4);
      for (int i = 0; i < a->partitionCount; ++i) EXPECT_NEAR(b->partitions[i].near / a->partitions[i].near, scale, 1e-6 * scale);
    }
  }
}

// Position in texels of a world point in the map that serves it, counted from the atlas' origin.
glm::dvec2 texelOf(const Solution& solution, int i, const glm::dvec3& ws) {
  const Partition& map = solution.partitions[i];
  const glm::dvec4 q = glm::dmat4(map.clipFromWorld) * glm::dvec4(ws - solution.originWs, 1.0);
  return (glm::dvec2(q) / q.w * 0.5 + 0.5) * glm::dvec2(map.viewport.z, map.viewport.w);
}

// How far a static point's place within its texel moves between frames of a walk, at most, while the texel's size stays; and in how many
// of the frames the size changed.
struct Crawl {
  double most = 0.0;
  int resized = 0;
};

Crawl crawl(const SdsmSettings& settings) {
  Crawl result;
  SdsmState state;
  glm::dvec2 last(0.0), lastScale(0.0);
  for (int k = 0; k < 200; ++k) {
    Frame frame = usualFrame();
    frame.camera.positionWs += glm::dvec3(0.011, 0.0, 0.017) * static_cast<double>(k);
    const double sway = std::sin(k * 0.1);
    const Samples samples{.near = 1.0 + 0.05 * sway, .far = 40.0 - 0.5 * sway};
    frame.samples = &samples;
    Solution solution;
    EXPECT_EQ(solveSdsm(frame, settings, state, solution), Status::ok);
    const glm::dvec3 ws = usualFrame().camera.positionWs + viewPoint(usualFrame().camera, 0.5, 0.5, 20.0);
    const int i = solution.partitionCount - 1;
    const glm::dvec2 at = texelOf(solution, i, ws), next = texelOf(solution, i, ws + glm::dvec3(1.0, 0.0, 0.0));
    const glm::dvec2 scale = next - at;
    if (k > 0 && glm::all(glm::lessThan(glm::abs(scale - lastScale), glm::abs(scale) * 1e-4))) {
      const glm::dvec2 moved = at - last - glm::round(at - last);
      result.most = std::max({result.most, std::abs(moved.x), std::abs(moved.y)});
    } else if (k > 0) {
      ++result.resized;
    }
    last = at;
    lastScale = scale;
  }
  return result;
}

TEST(Sdsm, HysteresisAndQuantisationKeepTexelsStill) {
  const Crawl free = crawl({});
  EXPECT_GT(free.resized + (free.most > 0.1 ? 200 : 0), 100);  // it crawls: the test can tell
  const Crawl held = crawl({.hysteresis = 0.25});
  EXPECT_LT(held.resized, 40);
  const Crawl doubled = crawl({.quantise = true});
  EXPECT_LT(doubled.resized, 4);
  EXPECT_LT(doubled.most, 0.02);
  const Crawl both = crawl({.hysteresis = 0.25, .quantise = true});
  EXPECT_LT(both.resized, 4);
  EXPECT_LT(both.most, 0.02);
}

// Hysteresis costs its room and nothing else: a rectangle taken anew is the least one, each side longer by half of the share. Turned along
// with the camera, it is taken anew before it has (1 + share)^2 times the least one's area.
TEST(Sdsm, HysteresisCostsItsRoom) {
  constexpr double kShare = 0.25;
  SdsmState state;
  int taken = 0;
  glm::vec2 before(0.0f);
  for (int k = 0; k < 60; ++k) {
    Frame frame = usualFrame();
    frame.camera.forwardWs = {std::sin(0.004 * k), -0.2, std::cos(0.004 * k)};
    const SampleBounds bounds[] = {{2.0, 40.0, {-9.0, -1.0}, {11.0, 2.0}}};
    const Samples samples{.near = 2.0, .far = 40.0, .bounds = bounds};
    frame.samples = &samples;
    const auto least = solve(frame, {});
    Solution held;
    ASSERT_EQ(solveSdsm(frame, {.hysteresis = kShare}, state, held), Status::ok);
    ASSERT_EQ(held.partitionCount, least->partitionCount);
    for (int i = 0; i < held.partitionCount; ++i) {
      const TexelError &a = held.partitions[i].error, &b = least->partitions[i].error;
      const double room = std::sqrt(a.s * a.t / (b.s * b.t));  // viewports have as many texels but for whole ones
      ASSERT_LE(room, 1.01 * (1.0 + kShare)) << k << " " << i;
      if (k == 0) {
        EXPECT_NEAR(room, 1.0 + kShare / 2.0, 0.01) << i;
      }
    }
    const glm::vec2 now(held.partitions[held.partitionCount - 1].clipFromWorld[0]);
    taken += glm::any(glm::greaterThan(glm::abs(now - before), glm::abs(now) * 1e-4f));
    before = now;
  }
  EXPECT_GT(taken, 2);  // it turns
  EXPECT_LT(taken, 30);  // in steps
}

// The fewest partitions whose error meets the target.
TEST(Sdsm, AutomaticCount) {
  Frame frame = usualFrame();
  frame.budget.partitions = 8;
  const Samples samples{.near = 1.0, .far = 60.0};
  frame.samples = &samples;
  for (const SdsmScheme scheme : kSchemes) {
    if (scheme == SdsmScheme::kmeans) continue;  // more clusters may be worse
    std::vector<double> errors;
    for (int count = 1; count <= 8; ++count) errors.push_back(solve(frame, {.scheme = scheme, .count = count})->maxError);
    for (const double target : {errors[1] * 1.03, errors[4] * 1.03}) {
      frame.budget.targetError = target;
      const auto solution = solve(frame, {.scheme = scheme, .automatic = true});
      EXPECT_LE(solution->partitionCount, target > errors[1] ? 2 : 5) << static_cast<int>(scheme);
      EXPECT_GT(solution->partitionCount, target > errors[1] ? 1 : 4) << static_cast<int>(scheme);
      EXPECT_FALSE(solution->warnings & static_cast<std::uint32_t>(Warning::targetMissed));
    }
    frame.budget.targetError = errors[7] * 0.1;
    EXPECT_TRUE(solve(frame, {.scheme = scheme, .automatic = true})->warnings & static_cast<std::uint32_t>(Warning::targetMissed));
  }
}

TEST(Sdsm, AllocatesNothing) {
  Frame frame = usualFrame();
  const std::uint32_t counts[] = {5, 0, 1000, 3, 3, 0, 0, 100};
  const Samples samples{.near = 1.0, .far = 60.0, .histogram = counts};
  frame.samples = &samples;
  Solution solution;
  SdsmState state;
  const auto before = allocationCount();
  for (const SdsmScheme scheme : kSchemes)
    for (const double hysteresis : {0.0, 0.5}) (void)solveSdsm(frame, {.scheme = scheme, .hysteresis = hysteresis}, state, solution);
  EXPECT_EQ(allocationCount(), before);
}

}  // namespace
}  // namespace gnomon::test
