#include "support.h"

#include "allocations.h"
#include "gnomon/lloyd.h"

namespace gnomon::test {
namespace {

std::unique_ptr<Solution> solve(const Frame& frame, const LloydSettings& settings) {
  auto solution = std::make_unique<Solution>();
  (void)solveLloyd(frame, settings, *solution);
  return solution;
}

constexpr LloydScheme kSchemes[] = {LloydScheme::w,   LloydScheme::zp,    LloydScheme::zpw,
                                    LloydScheme::fpw, LloydScheme::fpzpw, LloydScheme::best};

TEST(Lloyd, RefusesAnEtaOutOfRange) {
  for (const double bad : {-1.1, 1.1, std::nan("")})
    EXPECT_EQ(solve(usualFrame(), {.scheme = LloydScheme::zpw, .warp = {.warp = Warp::eta, .eta = bad}})->status, Status::warpEta);
  EXPECT_EQ(solve(usualFrame(), {.scheme = LloydScheme::zpw, .warp = {.warp = Warp::eta, .eta = 1.0}})->status, Status::ok);
}

// Where faces cannot serve, slices do, and the answer says so.
TEST(Lloyd, WarnsWhereFacesAreMissing) {
  Frame frame = usualFrame();
  frame.light.directionWs = frame.camera.forwardWs;
  frame.budget.partitions = 3;
  const auto solution = solve(frame, {.scheme = LloydScheme::fpw});
  EXPECT_EQ(solution->status, Status::ok);
  EXPECT_EQ(solution->partitionCount, 3);
  EXPECT_TRUE(solution->warnings & static_cast<std::uint32_t>(Warning::facesMissing));
}

// Every scheme and warp, over lights in all directions, exactly along, against and across the view and the axes, and a rolled camera.
TEST(Lloyd, CoversAsPredicted) {
  Random random(321);
  for (int k = 0; k < 10000; ++k) {
    Frame frame = usualFrame();
    frame.camera.forwardWs = k % 4 == 0 ? glm::dvec3(0, 0, -1) : random.direction();
    frame.camera.upWs = k % 4 == 0 ? glm::dvec3(0, 1, 0) : random.direction();
    const Axes axes(frame.camera);
    const glm::dvec3 exact[] = {axes.forward, -axes.forward, axes.up, -axes.up, axes.right, -axes.right};
    frame.light.directionWs = k % 3 == 0 ? exact[random.index(6)] : random.direction();
    if (k % 6 == 5) frame.light.directionWs = axes.forward + random.direction() * random.logUniform(1e-15, 1e-2);
    const glm::dvec4 plane(0.0, 1.0, 0.0, 1.0);
    if (k % 5 == 0) frame.scene.planes = {&plane, 1};
    if (k % 7 == 0) frame.camera.right = 0.1;
    frame.budget.partitions = 1 + random.index(9);
    const LloydSettings settings{.scheme = kSchemes[k % 6],
                                 .split = {},
                                 .warp = {.warp = static_cast<Warp>(random.index(6)), .eta = random.uniform(-1.0, 1.0)},
                                 .shares = random.index(2) ? Shares::error : Shares::equal,
                                 .nearFace = random.index(2) ? NearFace::own : NearFace::stretched};
    const auto solution = solve(frame, settings);
    ASSERT_EQ(solution->status, Status::ok) << k;
    ASSERT_TRUE(isFinite(*solution)) << k;
    ASSERT_LE(solution->partitionCount, frame.budget.partitions);
    checkClaims(frame, *solution, random, 20);
    ASSERT_FALSE(HasFailure()) << k;
  }
}

// `best` needs no more texels than any scheme by itself with any warp, whole views and ones cut by a box or a base plane alike.
TEST(Lloyd, BestIsNoWorseThanAnyScheme) {
  Random random(322);
  for (int k = 0; k < 400; ++k) {
    Frame frame = usualFrame();
    frame.camera = perspective({1.0, 2.0, 3.0}, random.direction(), random.direction(), random.uniform(0.2, 2.2), random.uniform(0.6, 2.4),
                               0.1, random.logUniform(0.15, 2000.0));
    frame.light.directionWs = random.direction();
    if (k % 5 == 0) frame.light.directionWs = frame.camera.forwardWs + random.direction() * random.logUniform(1e-3, 0.5);
    const double depth = random.logUniform(1.0, 50.0), size = depth * random.uniform(0.2, 1.5);
    const glm::dvec3 centre = frame.camera.positionWs + frame.camera.forwardWs * depth;
    const Box box{centre - size * random.uniform(0.4, 1.0), centre + size * random.uniform(0.4, 1.0)};
    const glm::dvec4 plane(0.0, 1.0, 0.0, 0.0);
    if (k % 3 == 1) frame.scene.receivers = {&box, 1};
    if (k % 3 == 2) frame.scene.planes = {&plane, 1};
    frame.budget.partitions = k % 4 == 3 ? 1 + random.index(16) : k % 4 == 2 ? 8 : 4;
    const auto best = solve(frame, {.scheme = LloydScheme::best});
    ASSERT_EQ(best->status, Status::ok);
    for (const LloydScheme scheme : kSchemes)
      for (const Warp warp : {Warp::none, Warp::lispsm, Warp::psm, Warp::tsm, Warp::least}) {
        if (scheme == LloydScheme::best || (scheme == LloydScheme::zp && warp != Warp::none)) continue;
        const auto other = solve(frame, {.scheme = scheme, .warp = {.warp = warp}});
        EXPECT_LE(best->neededTexels, other->neededTexels * (1.0 + 1e-9))
            << k << " " << static_cast<int>(scheme) << " " << static_cast<int>(warp);
      }
  }
}

// Of several receivers `best` needs no more than slices that their gaps part, or rows in columns, but for what named warps rule out; and the maps
// that it leaves out leave it their texels.
TEST(Lloyd, BestOfSeveralReceivers) {
  Random random(323);
  auto rows = std::make_unique<Solution>();
  for (int k = 0; k < 40; ++k) {
    Frame frame = usualFrame();
    const glm::dvec3 forward = glm::normalize(frame.camera.forwardWs);
    Box boxes[3];
    for (Box& box : boxes) {
      const double depth = random.logUniform(1.0, 50.0), size = depth * random.uniform(0.05, 0.3);
      const glm::dvec3 centre = frame.camera.positionWs + forward * depth + random.direction() * (0.3 * depth);
      box = {centre - size, centre + size};
    }
    frame.scene.receivers = boxes;
    frame.light.directionWs = random.direction();
    frame.budget = {.partitions = 2 + k % 3, .resolution = 1024};
    const auto best = solve(frame, {.scheme = LloydScheme::best});
    ASSERT_EQ(best->status, Status::ok);
    if (best->partitionCount == 0) continue;
    const auto parted = solve(frame, {.scheme = LloydScheme::zpw, .minimax = true});
    EXPECT_LE(best->neededTexels, 1.02 * parted->neededTexels) << k;
    for (int columns = 1; columns <= frame.budget.partitions; ++columns) {
      ASSERT_EQ(solveLspsm(frame, {.rows = {.rule = RowRule::error, .maxColumns = columns}, .warp = {.warp = Warp::least}}, *rows),
                Status::ok);
      EXPECT_LE(best->neededTexels, 1.05 * rows->neededTexels) << k << " " << columns;
    }
    double texels = 0.0;
    for (int i = 0; i < best->partitionCount; ++i)
      texels += static_cast<double>(best->partitions[i].viewport.z) * best->partitions[i].viewport.w;
    EXPECT_GT(texels, 0.9 * 1024 * 1024 * frame.budget.partitions) << k;
    EXPECT_LE(texels, 1024 * 1024 * frame.budget.partitions) << k;
  }
}

// Shares by error leave every map with the same error, but for whole texels.
TEST(Lloyd, SharesEqualiseError) {
  Frame frame = usualFrame();
  frame.light.directionWs = {0.2, -0.5, 0.9};
  frame.budget.resolution = 2048;
  frame.budget.partitions = 9;
  for (const LloydScheme scheme : {LloydScheme::zpw, LloydScheme::fpzpw}) {
    const auto solution = solve(frame, {.scheme = scheme});
    ASSERT_GT(solution->partitionCount, 3);
    double least = kInfinity;
    for (int i = 0; i < solution->partitionCount; ++i)
      least = std::min(least, std::max(solution->partitions[i].error.s, solution->partitions[i].error.t));
    EXPECT_LE(solution->maxError, least * 1.05);
  }
}

// As the light turns, through the view's direction, the image's axes and in and out of the view's sides, `needed` changes by no more than 2
// + ln(f/n) of itself for each radian, so finer steps give smaller changes; the least warp's search may miss its valley by a little more or
// less from one step to the next, and `needed` then jumps by that.
TEST(Lloyd, NeededIsContinuousInTheLight) {
  const glm::dvec3 forward{0, 0, -1}, aside = glm::normalize(glm::dvec3(0.3, -0.8, 0.2));
  const std::pair<glm::dvec3, glm::dvec3> circles[] = {{forward, {0, -1, 0}},   {forward, {1, 0, 0}},         {forward, {0.3, -0.8, 0}},
                                                       {{1, 0, 0}, {0, -1, 0}}, {{0.2, 0.1, -1}, {0, -1, 0}}, {aside, {-0.5, 0.1, -0.7}}};
  struct Kind {
    LloydSettings settings;
    double jump;  // of ln needed, allowed
  };
  const Kind kinds[] = {
      {{.scheme = LloydScheme::zp, .split = {}, .warp = {}}, 0.0}, {{.split = {}, .warp = {.warp = Warp::lispsm}}, 0.0},
      {{.split = {}, .warp = {.warp = Warp::psm}}, 0.0},           {{.split = {}, .warp = {.warp = Warp::tsm}}, 0.0},
      {{.split = {}, .warp = {.warp = Warp::least}}, 0.07},        {{.scheme = LloydScheme::best, .split = {}, .warp = {}}, 0.07}};
  const auto solution = std::make_unique<Solution>();
  for (const double ratio : {50.0, 1000.0, 20000.0})
    for (const Kind& kind : kinds) {
      if (kind.settings.scheme == LloydScheme::best && ratio != 1000.0) continue;  // slow
      for (const auto& [from, towards] : circles)
        for (const int steps : {360, 1440}) {
          Frame frame = usualFrame();
          frame.camera = perspective({1, 2, 3}, forward, {0, 1, 0}, 1.0, 16.0 / 9.0, 0.1, 0.1 * ratio);
          const glm::dvec3 x = glm::normalize(from), y = glm::normalize(towards - x * glm::dot(x, towards));
          double before = 0.0;
          for (int i = 0; i <= steps; ++i) {
            const double turn = 2.0 * kPi * i / steps;
            frame.light.directionWs = x * std::cos(turn) + y * std::sin(turn);
            ASSERT_EQ(solveLloyd(frame, kind.settings, *solution), Status::ok);
            const double now = std::log(solution->neededTexels);
            if (i > 0) {
              ASSERT_LE(std::abs(now - before), (2.0 + std::log(ratio)) * 2.0 * kPi / steps + kind.jump)
                  << ratio << " " << i << "/" << steps;
            }
            before = now;
          }
        }
    }
}

TEST(Lloyd, AllocatesNothing) {
  auto solution = std::make_unique<Solution>();
  for (const LloydScheme scheme : kSchemes) {
    const auto before = allocationCount();
    (void)solveLloyd(usualFrame(), {.scheme = scheme, .warp = {.warp = Warp::least}}, *solution);
    EXPECT_EQ(allocationCount(), before);
  }
}

}  // namespace
}  // namespace gnomon::test
