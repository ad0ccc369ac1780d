#include "support.h"

#include "allocations.h"
#include "gnomon/lspsm.h"

namespace gnomon::test {
namespace {

constexpr RowRule kRules[] = {RowRule::paper, RowRule::fitted, RowRule::error};

std::unique_ptr<Solution> solve(const Frame& frame, const LspsmSettings& settings, RowLayout* layout = nullptr) {
  auto solution = std::make_unique<Solution>();
  (void)solveLspsm(frame, settings, *solution, layout);
  return solution;
}

bool warns(const Solution& solution, Warning warning) { return (solution.warnings & static_cast<std::uint32_t>(warning)) != 0; }

TEST(Lspsm, RefusesWhatItsStagesRefuse) {
  EXPECT_EQ(solve(usualFrame(), {.rows = {.zeta = 0.5}})->status, Status::rowsZeta);
  EXPECT_EQ(solve(usualFrame(), {.rows = {}, .warp = {.warp = Warp::eta, .eta = 2.0}})->status, Status::warpEta);
  Frame frame = usualFrame();
  frame.light.directionWs = glm::dvec3(0.0);
  EXPECT_EQ(solve(frame, {})->status, Status::lightDirection);
  EXPECT_EQ(solve(usualFrame(), {})->status, Status::ok);
}

// The paper's four rows rarely reach: that is said, and nothing is left uncovered in silence. Fitted rows reach, and say what they waste.
TEST(Lspsm, PaperIsRefusedWhereItsRowsDoNotReach) {
  const RowSettings paper{.rule = RowRule::paper, .maxRows = 4};
  Frame frame = usualFrame();
  frame.budget.partitions = 8;
  const auto refused = solve(frame, {.rows = paper});
  EXPECT_EQ(refused->status, Status::rowsReach);
  EXPECT_EQ(refused->block.info.x, 0u);
  RowLayout layout;
  const auto fitted = solve(frame, {.rows = {.maxRows = 4}}, &layout);
  ASSERT_EQ(fitted->status, Status::ok);
  EXPECT_EQ(layout.count, 4);
  EXPECT_GT(layout.waste, 0.25);
  EXPECT_TRUE(warns(*fitted, Warning::rowsWaste));

  frame.camera.near = 5.0;
  frame.camera.far = 20.0;
  frame.budget.partitions = 16;
  EXPECT_EQ(solve(frame, {.rows = {.rule = RowRule::paper}}, &layout)->status, Status::ok);
  EXPECT_LE(layout.waste, 0.25 * (1.0 + 1e-12));
  const auto few = solve(frame, {}, &layout);
  EXPECT_LE(layout.waste, 0.25 * (1.0 + 1e-12));
  EXPECT_FALSE(warns(*few, Warning::rowsWaste));
}

// Columns give way to the budget first, then rows.
TEST(Lspsm, ColumnsGiveWayFirst) {
  Frame frame = usualFrame();
  frame.camera.near = 5.0;
  frame.camera.far = 20.0;
  frame.light.directionWs = {0, -1, 0};
  RowLayout layout;
  const RowSettings settings{.zeta = 0.1, .sigma = 0.5, .maxRows = 4, .maxColumns = 3};
  const struct { int most, rows, columns; } known[] = {{16, 4, 3}, {12, 4, 3}, {11, 4, 2}, {8, 4, 2}, {7, 4, 1}, {4, 4, 1}, {3, 3, 1}};
  for (const auto& each : known) {
    frame.budget.partitions = each.most;
    const auto solution = solve(frame, {.rows = settings}, &layout);
    EXPECT_EQ(solution->partitionCount, each.rows * each.columns) << each.most;
    EXPECT_EQ(layout.count, each.rows) << each.most;
    for (int i = 0; i < layout.count; ++i) EXPECT_EQ(layout.columns[i], each.columns) << each.most;
  }
}

// One rectangle is one slice: selection by depth finds it as it finds any.
TEST(Lspsm, OneMapIsFoundByDepth) {
  Frame frame = usualFrame();
  frame.budget.partitions = 1;
  const auto solution = solve(frame, {});
  ASSERT_EQ(solution->partitionCount, 1);
  EXPECT_EQ(solution->partitions[0].planeCount, 0);
  EXPECT_EQ(selectByViewDepth(solution->block, 5.0f), 0);
  EXPECT_EQ(solution->block.rowCells[0], 0xffffff00u);
}

// The spread of texel sizes in pixels, the 95th of a hundred over the 5th, by differences of the emitted matrices over a grid of the picture:
// of a ground, or of points at depths of all magnitudes.
double spreadOfTexels(const glm::dvec3& light, bool hasGround) {
  Frame frame = usualFrame();
  frame.camera = perspective({0.0, 1.7, 0.0}, {0.0, -0.1, -1.0}, {0.0, 1.0, 0.0}, kPi / 3.0, 4.0 / 3.0, 0.1, 200.0);
  frame.image = {1440.0, 1080.0};
  frame.light.directionWs = light;
  frame.budget = {.partitions = 8, .resolution = 1024};
  const Box ground{{-200.0, -0.01, -200.0}, {200.0, 0.0, 0.0}};
  if (hasGround) frame.scene.receivers = {&ground, 1};
  const auto solution = solve(frame, {.rows = {.maxColumns = 1}});
  EXPECT_EQ(solution->status, Status::ok);
  std::vector<double> sizes;
  for (int y = 0; y < 60; ++y)
    for (int x = 0; x < 40; ++x) {
      const glm::dvec3 ray = viewPoint(frame.camera, (x + 0.5) / 40.0, (y + 0.5) / 60.0, 1.0);
      const double z = hasGround ? -frame.camera.positionWs.y / ray.y : 0.1 * std::pow(2000.0, (40 * y + x) % 97 / 96.0);
      if (!(z > frame.camera.near && z < frame.camera.far)) continue;
      for (int i = 0; i < solution->partitionCount; ++i) {
        const Partition& map = solution->partitions[i];
        bool isServed = true;
        for (int p = 0; p < map.planeCount; ++p)
          isServed = isServed && glm::dot(glm::dvec3(map.planes[p]), frame.camera.positionWs + ray * z) + map.planes[p].w >= 0.0;
        if (!isServed) continue;
        const glm::dvec2 texel = measuredTexel(map, ray * z, light, z * 1e-3) / pixelAt(frame, z);
        sizes.push_back(std::sqrt(texel.x * texel.y));
        break;
      }
    }
  EXPECT_GT(sizes.size(), 500u);
  std::sort(sizes.begin(), sizes.end());
  return sizes[sizes.size() * 95 / 100] / sizes[sizes.size() * 5 / 100];
}

// The letter's nearly constant ratio of texels to pixels holds over a ground; for light along the view, and depths of all magnitudes behind
// each texel, no map has it.
TEST(Lspsm, TexelsPerPixelVaryLittleOverAGround) {
  const double overhead = spreadOfTexels({0.2, -1.0, 0.1}, true), low = spreadOfTexels({0.9, -0.3, 0.2}, true),
               along = spreadOfTexels({0.0, -0.1, -1.0}, false);
  RecordProperty("overhead", std::to_string(overhead));
  RecordProperty("low", std::to_string(low));
  RecordProperty("along", std::to_string(along));
  EXPECT_LT(overhead, 2.0);
  EXPECT_LT(low, 3.0);
  EXPECT_GT(along, 20.0);
}

// Every rule and warp, over lights in all directions, exactly along, against and across the view, cut and rolled views.
TEST(Lspsm, CoversAsPredicted) {
  Random random(511);
  int answered = 0;
  for (int k = 0; k < 1200; ++k) {
    Frame frame = usualFrame();
    frame.camera.forwardWs = k % 4 == 0 ? glm::dvec3(0, 0, -1) : random.direction();
    frame.camera.upWs = k % 4 == 0 ? glm::dvec3(0, 1, 0) : random.direction();
    const Axes axes(frame.camera);
    const glm::dvec3 exact[] = {axes.forward, -axes.forward, axes.up, -axes.up, axes.right, -axes.right};
    frame.light.directionWs = k % 5 == 0 ? exact[random.index(6)] : random.direction();
    if (k % 10 == 5) frame.light.directionWs = axes.forward + random.direction() * random.logUniform(1e-15, 1e-2);
    const glm::dvec4 plane(0.0, 1.0, 0.0, 1.0);
    if (k % 5 == 0) frame.scene.planes = {&plane, 1};
    if (k % 7 == 0) frame.camera.right = 0.1;
    frame.budget.partitions = 1 + random.index(12);
    const LspsmSettings settings{.rows = {.rule = kRules[k % 3],
                                          .zeta = random.uniform(0.05, 0.45),
                                          .sigma = random.uniform(0.1, 2.0),
                                          .maxColumns = 1 + random.index(3)},
                                 .warp = {.warp = static_cast<Warp>(random.index(6)), .eta = random.uniform(-1.0, 1.0)}};
    const auto solution = solve(frame, settings);
    if (solution->status == Status::rowsReach) continue;
    ASSERT_EQ(solution->status, Status::ok) << k;
    ASSERT_TRUE(isFinite(*solution)) << k;
    ASSERT_LE(solution->partitionCount, frame.budget.partitions);
    answered += solution->partitionCount > 0;
    checkClaims(frame, *solution, random, 40);
    ASSERT_FALSE(HasFailure()) << k;
  }
  EXPECT_GT(answered, 700);
}

// Rows of a given number need no jump of texels as the light turns through the view direction and across it.
TEST(Lspsm, NeededIsContinuousInTheLight) {
  for (const RowRule rule : {RowRule::fitted, RowRule::error})
    for (const double from : {0.0, 0.4, 1.2}) {
      Frame frame = usualFrame();
      frame.budget.partitions = 4;
      const Axes axes(frame.camera);
      double last = 0.0;
      for (int i = -100; i <= 100; ++i) {
        const double angle = from + i * 1e-5;
        frame.light.directionWs = axes.forward * std::cos(angle) + glm::normalize(axes.up * 0.8 + axes.right * 0.6) * std::sin(angle);
        const double needed = solve(frame, {.rows = {.rule = rule, .zeta = 1e-6, .maxColumns = 1}})->neededTexels;
        if (last > 0.0) {
          EXPECT_NEAR(needed / last, 1.0, 0.02) << static_cast<int>(rule) << " " << angle;
        }
        last = needed;
      }
    }
}

// By error: no more texels than rows of one ratio, nor than slices with the same warp.
TEST(Lspsm, ErrorRowsAreNoWorse) {
  Random random(512);
  for (int k = 0; k < 200; ++k) {
    Frame frame = usualFrame();
    frame.camera.forwardWs = random.direction();
    frame.light.directionWs = random.direction();
    frame.camera.far = random.logUniform(1.0, 1000.0);
    frame.budget.partitions = 1 + random.index(12);
    const WarpSettings warp{.warp = k % 2 ? Warp::least : Warp::none};
    const double error = solve(frame, {.rows = {.rule = RowRule::error}, .warp = warp})->neededTexels;
    auto slices = std::make_unique<Solution>();
    (void)solveLloyd(frame, {.scheme = LloydScheme::zpw, .split = {}, .warp = warp}, *slices);
    EXPECT_LE(error, slices->neededTexels * 1.01) << k;
  }
}

// Same answer for a world scaled by a millionth or a million.
TEST(Lspsm, ScaleFree) {
  const auto plain = solve(usualFrame(), {});
  for (const double scale : {1e-6, 1e6}) {
    Frame frame = usualFrame();
    frame.camera.positionWs *= scale;
    frame.camera.near *= scale;
    frame.camera.far *= scale;
    const auto scaled = solve(frame, {});
    ASSERT_EQ(scaled->partitionCount, plain->partitionCount);
    EXPECT_NEAR(scaled->neededTexels / plain->neededTexels, 1.0, 1e-4);
  }
}

TEST(Lspsm, AllocatesNothing) {
  auto solution = std::make_unique<Solution>();
  for (const RowRule rule : kRules) {
    const auto before = allocationCount();
    (void)solveLspsm(usualFrame(), {.rows = {.rule = rule}, .warp = {.warp = Warp::least}}, *solution);
    EXPECT_EQ(allocationCount(), before);
  }
}

}  // namespace
}  // namespace gnomon::test
