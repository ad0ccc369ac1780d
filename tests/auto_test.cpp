#include "support.h"

#include "allocations.h"
#include "gnomon/auto.h"

namespace gnomon::test {
namespace {

struct Answer {
  Solution solution;
  AutoReport why;
};

std::unique_ptr<Answer> choose(const Frame& frame, const AutoSettings& settings, AutoState& state) {
  auto answer = std::make_unique<Answer>();
  (void)solveAuto(frame, settings, state, answer->solution, &answer->why);
  return answer;
}
std::unique_ptr<Answer> choose(const Frame& frame, const AutoSettings& settings = {}) {
  AutoState state;
  return choose(frame, settings, state);
}

bool isMissed(const Solution& solution) { return (solution.warnings & static_cast<std::uint32_t>(Warning::targetMissed)) != 0; }

double texelsOf(const Solution& solution) {
  double sum = 0.0;
  for (int i = 0; i < solution.partitionCount; ++i)
    sum += static_cast<double>(solution.partitions[i].viewport.z) * solution.partitions[i].viewport.w;
  return sum;
}

// Views in all directions, lights in all directions and along the view, whole or cut by a box or a ground, all budgets.
Frame randomFrame(Random& random, int k, Box& box, glm::dvec4& ground) {
  Frame frame = usualFrame();
  frame.camera.forwardWs = random.direction();
  frame.camera.upWs = random.direction();
  frame.camera.far = random.logUniform(1.0, 1000.0);
  frame.light.directionWs = k % 5 == 0 ? frame.camera.forwardWs * (k % 2 ? 1.0 : -1.0) : random.direction();
  const glm::dvec3 centre = frame.camera.positionWs + glm::normalize(frame.camera.forwardWs) * random.logUniform(0.2, 50.0);
  const glm::dvec3 half(random.logUniform(0.01, 20.0), random.logUniform(0.01, 20.0), random.logUniform(0.01, 20.0));
  box = {centre - half, centre + half};
  ground = {0.0, 1.0, 0.0, 0.5};
  if (k % 3 == 1) frame.scene.receivers = {&box, 1};
  if (k % 6 == 2) frame.scene.planes = {&ground, 1};
  frame.budget.partitions = 1 + random.index(8);
  frame.budget.resolution = 256 << random.index(4);
  frame.budget.targetError = random.logUniform(0.3, 100.0);
  return frame;
}

TEST(Auto, RefusesWeightsAndWhatItsStagesRefuse) {
  AutoState state;
  const std::pair<Status, double DeviceProfile::*> weights[] = {{Status::autoPass, &DeviceProfile::pass},
                                                                {Status::autoTexel, &DeviceProfile::texel},
                                                                {Status::autoFit, &DeviceProfile::fit},
                                                                {Status::autoSearch, &DeviceProfile::search}};
  for (const auto& [status, weight] : weights)
    for (const double bad : {-1.0, kInfinity, std::nan("")}) {
      AutoSettings settings;
      settings.profile.*weight = bad;
      EXPECT_EQ(choose(usualFrame(), settings)->solution.status, status);
    }
  EXPECT_EQ(choose(usualFrame(), {.hysteresis = -0.1})->solution.status, Status::autoHysteresis);
  ASSERT_EQ(choose(usualFrame(), {}, state)->solution.status, Status::ok);
  const AutoState before = state;
  Frame frame = usualFrame();
  frame.light.directionWs = glm::dvec3(0.0);
  const auto refused = choose(frame, {}, state);
  EXPECT_EQ(refused->solution.status, Status::lightDirection);
  EXPECT_EQ(refused->solution.block.info.x, 0u);
  EXPECT_EQ(state.choice, before.choice);
  EXPECT_EQ(state.value, before.value);
}

// Met where it says so, within every budget, everything covered and no less sharp than certified.
TEST(Auto, MeetsTheTargetOrSaysSo) {
  Random random(701);
  int met = 0, missed = 0;
  for (int k = 0; k < 300; ++k) {
    Box box;
    glm::dvec4 ground;
    Frame frame = randomFrame(random, k, box, ground);
    if (k % 7 == 0) frame.margin = {.filter = 1.0, .normalOffset = 0.5, .blend = 0.1, .border = 2};
    if (k % 11 == 0) frame.shadowMap.layout = MapLayout::layers;
    if (k % 13 == 0) frame.budget.atlas = {700, 900};
    if (k % 17 == 0) frame.camera = orthographic({1.0, 2.0, 3.0}, random.direction(), {0.1, 1.0, 0.2}, 10.0, 1.5, 0.1, 50.0);
    const auto answer = choose(frame);
    const Solution& solution = answer->solution;
    ASSERT_EQ(solution.status, Status::ok) << k << " " << statusField(solution.status);
    ASSERT_TRUE(isFinite(solution)) << k;
    if (solution.partitionCount == 0) continue;
    ASSERT_EQ(isMissed(solution), !(solution.maxError <= frame.budget.targetError)) << k;
    (isMissed(solution) ? missed : met) += 1;
    ASSERT_LE(solution.partitionCount, frame.budget.partitions) << k;
    ASSERT_LE(texelsOf(solution), frame.budget.resolution * frame.budget.resolution * frame.budget.partitions) << k;
    ASSERT_GE(answer->why.chosen, 0);
    ASSERT_EQ(answer->why.candidates[answer->why.chosen].maps, solution.partitionCount) << k;
    if (k % 7) checkClaims(frame, solution, random, 40);  // blended maps claim less than they cover
    ASSERT_FALSE(HasFailure()) << k;
  }
  EXPECT_GT(met, 100);
  EXPECT_GT(missed, 50);
}

// Cost by the profile, as the header states it, of what a solution has and what it took to fit it.
double costOf(const DeviceProfile& profile, double maps, double texels, double fits, bool isSearched) {
  return maps * profile.pass + texels * profile.texel + fits * (profile.fit + (isSearched ? profile.search : 0.0));
}

// Every layout, count and warp, each solved by its own method: none that meets the target costs less than 1 / 1.05 of what auto takes.
TEST(Auto, NeverDearerThanTheBestOfAllChoices) {
  Random random(702);
  const DeviceProfile profile;
  auto tried = std::make_unique<Solution>();
  double worst = 0.0, worstError = 0.0;
  for (int k = 0; k < 60; ++k) {
    Box box;
    glm::dvec4 ground;
    Frame frame = randomFrame(random, k, box, ground);
    frame.budget.partitions = 1 + k % 6;
    const double target = frame.budget.targetError, budget = frame.budget.resolution * frame.budget.resolution * frame.budget.partitions;
    double cheapest = kInfinity, sharpest = kInfinity;
    const auto consider = [&](bool isSearched) {
      if (tried->status != Status::ok || tried->partitionCount == 0) return;
      constexpr double kRounding = 2.0;  // texels that each side of a map may take beyond what it needs
      double needed = 0.0;
      for (int i = 0; i < tried->partitionCount; ++i) {
        const Partition& map = tried->partitions[i];
        needed += (map.error.s * map.viewport.z / target + kRounding) * (map.error.t * map.viewport.w / target + kRounding);
      }
      sharpest = std::min(sharpest, std::sqrt(tried->neededTexels / budget));
      if (needed > budget) return;
      const double fits = frame.scene.receivers.empty() && frame.scene.planes.empty() ? 1.0 : tried->partitionCount;
      cheapest = std::min(cheapest, costOf(profile, tried->partitionCount, needed, fits, isSearched));
    };
    for (const Warp warp : {Warp::none, Warp::lispsm, Warp::least})
      for (int count = 1; count <= frame.budget.partitions; ++count) {
        Frame few = frame;
        few.budget.partitions = count;
        (void)solveLloyd(few, {.scheme = LloydScheme::zpw, .split = {}, .warp = {.warp = warp}}, *tried);
        consider(warp == Warp::least);
        (void)solveLloyd(few, {.scheme = LloydScheme::fpzpw, .split = {}, .warp = {.warp = warp}}, *tried);
        consider(warp == Warp::least);
        (void)solveLspsm(few, {.rows = {.rule = RowRule::error, .maxColumns = 1}, .warp = {.warp = warp}}, *tried);
        consider(warp == Warp::least);
      }
    const auto answer = choose(frame);
    if (answer->solution.partitionCount == 0) continue;
    const AutoCandidate& chosen = answer->why.candidates[answer->why.chosen];
    if (cheapest < kInfinity) {
      EXPECT_FALSE(isMissed(answer->solution)) << k;
      const double fits = chosen.choice.layout == AutoLayout::slices && frame.scene.receivers.empty() && frame.scene.planes.empty()
                              ? 1.0
                              : answer->solution.partitionCount;
      const double cost =
          costOf(profile, answer->solution.partitionCount, texelsOf(answer->solution), fits, chosen.choice.warp == Warp::least);
      worst = std::max(worst, cost / cheapest);
      EXPECT_LE(cost, 1.05 * cheapest) << k;
    } else if (isMissed(answer->solution)) {
      worstError = std::max(worstError, answer->solution.maxError / sharpest);
      EXPECT_LE(answer->solution.maxError, 1.05 * sharpest) << k;
    }
  }
  RecordProperty("cost", std::to_string(worst));
  RecordProperty("error", std::to_string(worstError));
}

// A crate in the distance of a long view: one map of about as many texels as it has pixels.
TEST(Auto, ASmallSceneGetsOneSmallMap) {
  Frame frame = usualFrame();
  const glm::dvec3 centre = frame.camera.positionWs + glm::normalize(frame.camera.forwardWs) * 40.0;
  const Box crate{centre - 0.5, centre + 0.5};
  frame.scene.receivers = {&crate, 1};
  const auto answer = choose(frame);
  EXPECT_EQ(answer->solution.partitionCount, 1);
  EXPECT_FALSE(isMissed(answer->solution));
  const double side = std::sqrt(3.0) / pixelAt(frame, 39.0);  // of the crate's diagonal in pixels
  EXPECT_LE(texelsOf(answer->solution), side * side);
  EXPECT_GE(answer->solution.maxError, 0.9);  // no sharper than asked
}

// Two crates far apart in depth: what lies between takes no texel, nor does anything behind the viewer.
TEST(Auto, EmptyDepthGetsNothing) {
  Frame frame = usualFrame();
  const glm::dvec3 forward = glm::normalize(frame.camera.forwardWs);
  const auto crate = [&](double depth) {
    const glm::dvec3 centre = frame.camera.positionWs + forward * depth;
    return Box{centre - 0.2, centre + 0.2};
  };
  const Box both[] = {crate(2.0), crate(50.0)};
  frame.scene.receivers = both;
  frame.budget.targetError = 0.5;
  const auto answer = choose(frame);
  ASSERT_EQ(answer->solution.partitionCount, 2);
  double area = 0.0;
  for (const double depth : {2.0, 50.0}) {
    const double side = 0.4 * std::sqrt(3.0) / pixelAt(frame, depth - 0.4) / frame.budget.targetError;  // of a crate's diagonal
    area += side * side;
  }
  EXPECT_LE(texelsOf(answer->solution), area);
  const Box behind = crate(-10.0);
  frame.scene.receivers = {&behind, 1};
  const auto nothing = choose(frame);
  EXPECT_EQ(nothing->solution.status, Status::ok);
  EXPECT_EQ(nothing->solution.partitionCount, 0);
  EXPECT_EQ(nothing->why.chosen, -1);
  EXPECT_EQ(nothing->solution.block.info.x, 0u);
}

// Texels beyond the target are not allocated: they fall with its square, down to what passes cost.
TEST(Auto, NoTexelsBeyondTheTarget) {
  Frame frame = usualFrame();
  frame.budget = {.partitions = 4, .resolution = 8192};
  for (const double target : {1.0, 2.0, 4.0, 8.0, 16.0}) {
    frame.budget.targetError = target;
    const auto answer = choose(frame);
    ASSERT_FALSE(isMissed(answer->solution)) << target;
    EXPECT_GE(answer->solution.maxError, 0.99 * target);
    EXPECT_NEAR(texelsOf(answer->solution) * target * target / answer->solution.neededTexels, 1.0, 0.03) << target;
  }
}

// Without a target: the least error, no worse than the best of Lloyd's schemes with the same budget.
TEST(Auto, WithoutATargetTheLeastError) {
  Random random(703);
  auto best = std::make_unique<Solution>();
  for (int k = 0; k < 40; ++k) {
    Box box;
    glm::dvec4 ground;
    const Frame frame = randomFrame(random, k, box, ground);
    (void)solveLloyd(frame, {.scheme = LloydScheme::best}, *best);
    const auto answer = choose(frame, {.hasTarget = false});
    EXPECT_FALSE(isMissed(answer->solution));
    EXPECT_LE(answer->solution.neededTexels, 1.1 * best->neededTexels) << k;
    EXPECT_LE(texelsOf(answer->solution), frame.budget.resolution * frame.budget.resolution * frame.budget.partitions);
  }
}

// Without perspective pixels are as wide everywhere: more slices need more texels, rows fewer. The error is no more than that of one map or of
// rows, however many maps the budget allows.
TEST(Auto, OrthographicViews) {
  Random random(706);
  auto other = std::make_unique<Solution>();
  for (int k = 0; k < 60; ++k) {
    Frame frame = usualFrame();
    frame.camera = orthographic({1.0, 2.0, 3.0}, random.direction(), random.direction(), random.logUniform(1.0, 100.0),
                                random.uniform(0.5, 2.5), 0.0, random.logUniform(1.0, 1000.0));
    frame.light.directionWs = k % 4 == 0 ? frame.camera.forwardWs : random.direction();
    frame.budget = {.partitions = 1 + k % 16, .resolution = 512};
    const double total = 512.0 * 512.0 * frame.budget.partitions;
    const auto answer = choose(frame, {.hasTarget = false});
    Frame one = frame;
    one.budget = {.partitions = 1, .texels = total};
    ASSERT_EQ(solveLloyd(one, {.scheme = LloydScheme::w}, *other), Status::ok);
    EXPECT_LE(answer->solution.maxError, 1.05 * other->maxError) << k;
    frame.budget.texels = total;
    ASSERT_EQ(solveLspsm(frame, {.rows = {.rule = RowRule::error, .maxColumns = 1}}, *other), Status::ok);
    EXPECT_LE(answer->solution.maxError, 1.05 * other->maxError) << k;
  }
}

// A flat view of 650 units by 4 wants a map longer than the atlas: more maps, shorter ones, serve it as well as its slices by themselves.
TEST(Auto, KnowsHowLongAMapMayBe) {
  auto slices = std::make_unique<Solution>();
  for (const int side : {0, 8192, 4096}) {
    Frame frame = usualFrame();
    frame.camera = orthographic({0.0, 2.0, 0.0}, {0.0, 0.0, -1.0}, {0.0, 1.0, 0.0}, 3.71, 1.7778, 0.0, 654.0);
    frame.light.directionWs = {0.0, -1.0, 0.0};
    frame.budget.atlas = {side, side};
    ASSERT_EQ(solvePssm(frame, {}, *slices), Status::ok);
    const auto sharpest = choose(frame, {.hasTarget = false});
    EXPECT_LE(sharpest->solution.maxError, 1.01 * slices->maxError) << side;
    EXPECT_NEAR(sharpest->why.candidates[sharpest->why.chosen].error, sharpest->solution.maxError, 0.02 * slices->maxError) << side;
    frame.budget.targetError = 1.1 * slices->maxError;
    EXPECT_FALSE(isMissed(choose(frame)->solution)) << side;
  }
}

// Of receivers side by side, two columns of rows are among the choices.
TEST(Auto, ReceiversSideBySide) {
  Random random(707);
  auto columns = std::make_unique<Solution>();
  for (int k = 0; k < 20; ++k) {
    Frame frame = usualFrame();
    const double depth = random.uniform(3.0, 20.0), apart = depth * random.uniform(0.3, 0.5), size = apart * random.uniform(0.1, 0.4);
    const glm::dvec3 forward = glm::normalize(frame.camera.forwardWs), right = glm::normalize(glm::cross(forward, frame.camera.upWs));
    const glm::dvec3 middle = frame.camera.positionWs + forward * depth;
    const Box boxes[] = {{middle - right * apart - size, middle - right * apart + size},
                         {middle + right * apart - size, middle + right * apart + size}};
    frame.scene.receivers = boxes;
    frame.light.directionWs = glm::dvec3(random.uniform(-0.5, 0.5), -1.0, random.uniform(-0.5, 0.5));
    frame.budget = {.partitions = 2 + k % 2, .texels = 1 << 20};
    ASSERT_EQ(solveLspsm(frame, {.rows = {.rule = RowRule::error, .maxColumns = 2}, .warp = {.warp = Warp::least}}, *columns), Status::ok);
    EXPECT_LE(choose(frame, {.hasTarget = false})->solution.maxError, 1.02 * columns->maxError) << k;
  }
}

// A choice made where samples allow no warp does not hold where they are gone, not even for a light along the view, which no warp serves
// better.
TEST(Auto, ForgetsWhatSamplesForbade) {
  Frame frame = usualFrame();
  const SampleBounds all{0.2, 90.0, glm::dvec2(-100.0), glm::dvec2(100.0)};
  Samples samples;
  samples.near = all.near;
  samples.far = all.far;
  samples.bounds = {&all, 1};
  frame.light.directionWs = frame.camera.forwardWs;
  for (const bool hasTarget : {false, true}) {
    AutoState state;
    frame.samples = &samples;
    const auto first = choose(frame, {.hasTarget = hasTarget}, state);
    ASSERT_EQ(first->solution.status, Status::ok);
    ASSERT_EQ(state.choice.warp, Warp::none);
    frame.samples = nullptr;
    const auto second = choose(frame, {.hasTarget = hasTarget}, state), fresh = choose(frame, {.hasTarget = hasTarget});
    EXPECT_FALSE(second->why.isKept);
    EXPECT_NE(second->why.candidates[second->why.chosen].choice.warp, Warp::none);
    EXPECT_EQ(second->solution.maxError, fresh->solution.maxError);
  }
}

// Layers are as many as the maps that are not empty: the others' texels go to these, whether the target is met or missed.
TEST(Auto, LayersOfNothingTakeNothing) {
  Random random(705);
  int empty = 0;
  for (int k = 0; k < 400; ++k) {
    Box box;
    glm::dvec4 ground;
    Frame frame = randomFrame(random, 3 * k + 1, box, ground);
    frame.shadowMap.layout = MapLayout::layers;
    frame.budget.texels = 1 << 18;
    const auto answer = choose(frame);
    if (answer->why.chosen < 0) continue;
    const AutoCandidate& chosen = answer->why.candidates[answer->why.chosen];
    if (chosen.choice.count == chosen.maps) continue;
    ++empty;
    const double texels = texelsOf(answer->solution), side = std::sqrt(texels / chosen.maps);
    EXPECT_NEAR(chosen.texels / texels, 1.0, 4.0 / side) << k;  // whole texels
    if (isMissed(answer->solution)) {
      EXPECT_NEAR(frame.budget.texels / texels, 1.0, 4.0 / side) << k;
    }
  }
  EXPECT_GT(empty, 5);
}

// What a missed target is said to take does meet it, and every map gives way alike.
TEST(Auto, SaysWhatAMissedTargetTakes) {
  Random random(704);
  int known = 0;
  for (int k = 0; k < 60; ++k) {
    Box box;
    glm::dvec4 ground;
    Frame frame = randomFrame(random, k, box, ground);
    frame.budget.resolution = 512;
    frame.budget.partitions = 1 + k % 4;
    frame.budget.targetError = random.logUniform(0.3, 3.0);
    const auto answer = choose(frame);
    if (!isMissed(answer->solution)) continue;
    double least = kInfinity, most = 0.0;
    for (int i = 0; i < answer->solution.partitionCount; ++i) {
      const double error = std::max(answer->solution.partitions[i].error.s, answer->solution.partitions[i].error.t);
      least = std::min(least, error);
      most = std::max(most, error);
    }
    const glm::ivec4& first = answer->solution.partitions[0].viewport;
    if (std::min(first.z, first.w) > 100) {
      EXPECT_LT(most / least, 1.1) << k;
    }
    if (answer->why.mapsForTarget > 0) {
      ++known;
      Frame more = frame;
      more.budget.partitions = answer->why.mapsForTarget;
      EXPECT_FALSE(isMissed(choose(more)->solution)) << k << " " << answer->why.mapsForTarget;
    }
    frame.budget.texels = answer->why.texelsForTarget * 1.02;  // whole texels
    if (frame.budget.texels < 1e8) {
      EXPECT_FALSE(isMissed(choose(frame)->solution)) << k;
    }
  }
  EXPECT_GT(known, 5);
}

// Along a walk under a turning light the choice is kept while it serves: fewer switches, and never dearer than the stated share twice over
// (once for what was compared last, once for what has changed since).
TEST(Auto, KeepsTheChoiceWhileItServes) {
  Frame frame = usualFrame();
  frame.budget = {.partitions = 6, .resolution = 2048, .targetError = 2.0};
  const AutoSettings settings;
  AutoState state;
  AutoChoice last, lastFresh;
  int switches = 0, freshSwitches = 0, kept = 0;
  double worst = 0.0;
  constexpr int kFrames = 300;
  for (int i = 0; i < kFrames; ++i) {
    const double turn = i * 0.01;
    frame.camera.positionWs += glm::dvec3(0.02, 0.0, 0.05);
    frame.camera.forwardWs = {std::sin(0.3 * turn + 0.2 * std::sin(7.0 * turn)), -0.2, std::cos(0.3 * turn)};
    frame.light.directionWs = {std::cos(turn), -0.8, std::sin(turn)};
    const auto answer = choose(frame, settings, state), fresh = choose(frame, settings);
    ASSERT_EQ(isMissed(answer->solution), isMissed(fresh->solution)) << i;
    kept += answer->why.isKept;
    switches += i > 0 && !(state.choice == last);
    const AutoChoice& freshChoice = fresh->why.candidates[fresh->why.chosen].choice;
    freshSwitches += i > 0 && !(freshChoice == lastFresh);
    last = state.choice;
    lastFresh = freshChoice;
    const AutoCandidate &own = answer->why.candidates[answer->why.chosen], &other = fresh->why.candidates[fresh->why.chosen];
    worst = std::max(worst, other.isMet ? own.cost / other.cost : own.error / other.error);
  }
  RecordProperty("switches", switches);
  RecordProperty("switches_without", freshSwitches);
  RecordProperty("kept", kept);
  RecordProperty("worst", std::to_string(worst));
  EXPECT_LT(switches, freshSwitches);
  EXPECT_GT(kept, kFrames * 9 / 10);
  EXPECT_LE(worst, (1.0 + settings.hysteresis) * (1.0 + settings.hysteresis));
}

// What is not sampled costs nothing.
TEST(Auto, SamplesCutTheCost) {
  Frame frame = usualFrame();
  frame.budget.targetError = 4.0;
  const auto whole = choose(frame);
  Samples samples;
  samples.near = 20.0;
  samples.far = 30.0;
  frame.samples = &samples;
  const auto sampled = choose(frame);
  EXPECT_LE(sampled->solution.partitionCount, whole->solution.partitionCount);
  EXPECT_LT(texelsOf(sampled->solution), 0.5 * texelsOf(whole->solution));
  EXPECT_LE(sampled->solution.maxError, 4.0);
  EXPECT_GE(sampled->solution.partitions[0].near, 19.9);
}

TEST(Auto, ScaleFree) {
  const auto plain = choose(usualFrame());
  for (const double scale : {1e-6, 1e6}) {
    Frame frame = usualFrame();
    frame.camera.positionWs *= scale;
    frame.camera.near *= scale;
    frame.camera.far *= scale;
    const auto scaled = choose(frame);
    EXPECT_EQ(scaled->why.candidates[scaled->why.chosen].choice, plain->why.candidates[plain->why.chosen].choice);
    EXPECT_NEAR(scaled->solution.neededTexels / plain->solution.neededTexels, 1.0, 1e-2);
  }
}

TEST(Auto, AllocatesNothing) {
  auto answer = std::make_unique<Answer>();
  AutoState state;
  const auto before = allocationCount();
  for (int i = 0; i < 2; ++i) (void)solveAuto(usualFrame(), {}, state, answer->solution, &answer->why);
  EXPECT_EQ(allocationCount(), before);
}

}  // namespace
}  // namespace gnomon::test
