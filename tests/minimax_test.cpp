#include "support.h"

#include "gnomon/lloyd.h"

namespace gnomon::test {
namespace {

std::unique_ptr<Solution> solve(const Frame& frame, const LloydSettings& settings) {
  auto solution = std::make_unique<Solution>();
  EXPECT_EQ(solveLloyd(frame, settings, *solution), Status::ok);
  return solution;
}

// A view cut by one box, two boxes with a gap in depth, or a base plane and a box.
struct CutView {
  Frame frame = usualFrame();
  Box boxes[2];
  glm::dvec4 plane{0.0, 1.0, 0.0, 0.5};

  CutView(Random& random, int kind) {
    const Axes axes(frame.camera);
    frame.light.directionWs = random.direction();
    const double first = random.logUniform(1.0, 20.0), second = first * random.uniform(2.0, 3.0);
    const double sizes[] = {first * random.uniform(0.3, 0.9), second * 0.3};
    for (int i = 0; i < 2; ++i) {
      const glm::dvec3 centre = frame.camera.positionWs + axes.forward * (i == 0 ? first : second);
      boxes[i] = {centre - sizes[i] * random.uniform(0.5, 1.0), centre + sizes[i] * random.uniform(0.5, 1.0)};
    }
    frame.scene.receivers = {boxes, kind == 1 ? 2u : 1u};
    if (kind == 2) frame.scene.planes = {&plane, 1};
    frame.budget = {.partitions = 3, .resolution = 2048};
    frame.camera.depth = DepthConvention::reversedZeroToOne;
  }
};

// The texels of every map, or of the one that needs most.
double judge(const Solution& solution, Shares shares) {
  double sum = 0.0, most = 0.0;
  for (int i = 0; i < solution.partitionCount; ++i) {
    const Partition& map = solution.partitions[i];
    const double needed = map.error.s * map.error.t * map.viewport.z * map.viewport.w;
    sum += needed;
    most = std::max(most, needed);
  }
  return shares == Shares::equal ? most : sum;
}

// No planes of a fine grid do better, with or without a blend band: every pair of them is tried, through the solver's explicit splits.
TEST(Minimax, IsTheBestOfAllPlanes) {
  Random random(401);
  for (int k = 0; k < 24; ++k) {
    CutView view(random, k % 3);
    if (k >= 12) view.frame.margin.blend = random.uniform(0.1, 0.5);
    const Shares shares = k % 2 ? Shares::error : Shares::equal;
    LloydSettings settings{.scheme = k % 4 < 2 ? LloydScheme::zp : LloydScheme::zpw, .split = {}, .shares = shares};
    settings.minimax = true;
    const auto found = solve(view.frame, settings);
    ASSERT_GT(found->partitionCount, 0);
    settings.minimax = false;
    const double near = found->partitions[0].near, far = found->partitions[found->partitionCount - 1].far;
    double least = judge(*solve(view.frame, settings), shares);  // logarithmic
    constexpr int kSteps = 36;
    for (int a = 1; a < kSteps; ++a)
      for (int b = a; b < kSteps; ++b) {
        const double depths[] = {near * std::pow(far / near, static_cast<double>(a) / kSteps),
                                 near * std::pow(far / near, static_cast<double>(b) / kSteps)};
        settings.split = {.scheme = SplitScheme::explicitDepths, .depths = {depths, a == b ? 1u : 2u}};
        least = std::min(least, judge(*solve(view.frame, settings), shares));
      }
    EXPECT_LE(judge(*found, shares), least * 1.005) << k;
  }
}

// A whole view's best planes have equal ratios.
TEST(Minimax, IsLogarithmicForAWholeView) {
  Frame frame = usualFrame();
  for (const Shares shares : {Shares::equal, Shares::error}) {
    const auto found = solve(frame, {.scheme = LloydScheme::zp, .minimax = true, .shares = shares}),
               logarithmic = solve(frame, {.scheme = LloydScheme::zp, .shares = shares});
    ASSERT_EQ(found->partitionCount, 4);
    EXPECT_LE(judge(*found, shares), judge(*logarithmic, shares) * 1.001);
    for (int i = 1; i < 4 && shares == Shares::equal; ++i)
      EXPECT_NEAR(std::log(found->partitions[i].near / (0.1 * std::pow(1000.0, i / 4.0))), 0.0, 0.01) << i;
  }
}

// Maps of equal size end with equal errors, as far as the depths between receivers let them, bands and margins included.
TEST(Minimax, EqualisesErrorOverACutView) {
  Random random(402);
  for (int k = 0; k < 60; ++k) {
    CutView view(random, 2 * (k % 2));
    if (k >= 20) view.frame.margin.blend = k < 40 ? 0.2 : random.uniform(0.0, 0.9);
    if (k % 3 == 0) view.frame.margin.filter = 2.0;
    const auto found = solve(view.frame, {.scheme = LloydScheme::zp, .minimax = true, .shares = Shares::equal});
    double least = kInfinity, most = 0.0;
    for (int i = 0; i < found->partitionCount; ++i) {
      const Partition& map = found->partitions[i];
      const double needed = map.error.s * map.error.t * map.viewport.z * map.viewport.w;
      least = std::min(least, needed);
      most = std::max(most, needed);
    }
    EXPECT_LE(most, least * 1.01) << k;
  }
}

// Flat receivers, points, receivers outside the view, orthographic views and every count: an answer that covers.
TEST(Minimax, TakesAnyRegion) {
  Random random(403);
  for (int k = 0; k < 60; ++k) {
    CutView view(random, k % 3);
    if (k % 4 == 0) view.boxes[0].maxWs = view.boxes[0].minWs;
    if (k % 4 == 1) view.boxes[0].maxWs.y = view.boxes[0].minWs.y;
    if (k % 5 == 0) view.frame.camera = orthographic({1, 2, 3}, {0.3, -0.2, 1.0}, {0, 1, 0}, 30.0, 1.5, -5.0, 60.0);
    if (k == 13) view.boxes[0] = {glm::dvec3(-1e4), glm::dvec3(-9e3)};
    view.frame.budget.partitions = 1 + k % 16;
    const auto found = solve(view.frame, {.scheme = LloydScheme::zp, .minimax = true});
    EXPECT_TRUE(isFinite(*found));
    EXPECT_LE(found->partitionCount, view.frame.budget.partitions);
    const Coverage coverage = checkAll(view.frame, *found);
    EXPECT_EQ(coverage.uncovered, 0) << k;
    EXPECT_LE(coverage.worst, 1.0 + 1e-5) << k;
  }
}

}  // namespace
}  // namespace gnomon::test
