#include "support.h"

#include "gnomon/atlas.h"

namespace gnomon::test {
namespace {

TEST(Atlas, RefusesWhatCannotFit) {
  Frame frame = usualFrame();
  frame.budget.atlas = {3, 1};  // four maps of a texel
  EXPECT_EQ(solve(frame)->status, Status::budgetAtlas);
  frame.budget.atlas = {4, 4};
  frame.margin.border = 1;
  EXPECT_EQ(solve(frame)->status, Status::budgetAtlas);
  frame.budget.atlas = {6, 6};  // four texels, each with its border
  EXPECT_EQ(solve(frame)->status, Status::ok);
}

void checkAtlas(const Frame& frame, const Solution& solution) {
  double texels = 0.0;
  const int border = frame.margin.border;
  for (int i = 0; i < solution.partitionCount; ++i) {
    const glm::ivec4 a = solution.partitions[i].viewport;
    EXPECT_GE(a.z, 1);
    EXPECT_GE(a.w, 1);
    EXPECT_GE(a.x, border);
    EXPECT_GE(a.y, border);
    EXPECT_LE(a.x + a.z + border, solution.atlas.x);
    EXPECT_LE(a.y + a.w + border, solution.atlas.y);
    texels += static_cast<double>(a.z) * a.w;
    for (int j = 0; j < i; ++j) {
      const glm::ivec4 b = solution.partitions[j].viewport;
      const bool isApart =
          a.x >= b.x + b.z + 2 * border || b.x >= a.x + a.z + 2 * border || a.y >= b.y + b.w + 2 * border || b.y >= a.y + a.w + 2 * border;
      EXPECT_TRUE(isApart || solution.partitions[i].layer != solution.partitions[j].layer) << i << " " << j;
    }
  }
  const Budget& budget = frame.budget;
  EXPECT_LE(texels, budget.texels > 0.0 ? budget.texels : static_cast<double>(budget.resolution) * budget.resolution * budget.partitions);
  EXPECT_LE(solution.atlas.x, budget.atlas.x > 0 ? budget.atlas.x : kMaxTextureSide);
  EXPECT_LE(solution.atlas.y, budget.atlas.y > 0 ? budget.atlas.y : kMaxTextureSide);
}

TEST(Atlas, MapsAreDisjointInsideAndInBudget) {
  Random random(41);
  for (int i = 0; i < 3000; ++i) {
    Frame frame = usualFrame();
    frame.camera.forwardWs = random.direction();
    frame.light.directionWs = random.direction();
    frame.camera.right = frame.camera.left = random.logUniform(0.05, 20.0);
    frame.budget.partitions = 1 + random.index(16);
    frame.budget.resolution = 1 + random.index(4096);
    if (random.index(3) == 0) frame.budget.texels = random.logUniform(16.0, 1e8);
    if (random.index(3) == 0) frame.budget.atlas = {64 + random.index(4096), 64 + random.index(4096)};
    frame.margin.border = random.index(3) == 0 ? random.index(4) : 0;
    frame.shadowMap.layout = random.index(3) == 0 ? MapLayout::layers : MapLayout::atlas;
    const auto solution = solve(frame, {.split = {}, .fit = static_cast<FitMode>(random.index(3))});
    if (solution->status == Status::marginTexels) continue;  // stable gives a texel to the snap: a map of one texel has none
    ASSERT_EQ(solution->status, Status::ok) << statusField(solution->status);
    checkAtlas(frame, *solution);
  }
}

TEST(Atlas, FourSquaresMakeASquare) {
  const auto solution = solve(usualFrame(), {.split = {}, .fit = FitMode::slice});
  EXPECT_EQ(solution->atlas, glm::ivec2(4096, 4096));
  for (int i = 0; i < 4; ++i)
    EXPECT_EQ(glm::ivec2(solution->partitions[i].viewport.z, solution->partitions[i].viewport.w), glm::ivec2(2048, 2048));
}

TEST(Atlas, LayersAreSquaresOfTheResolution) {
  Frame frame = usualFrame();
  frame.shadowMap.layout = MapLayout::layers;
  const auto solution = solve(frame);
  EXPECT_EQ(solution->layers, 4);
  EXPECT_EQ(solution->atlas, glm::ivec2(2048, 2048));
  for (int i = 0; i < 4; ++i) {
    EXPECT_EQ(solution->partitions[i].layer, i);
    EXPECT_EQ(solution->partitions[i].viewport, glm::ivec4(0, 0, 2048, 2048));
    EXPECT_EQ(solution->block.partitions[i].layer.x, static_cast<float>(i));
  }
}

TEST(Atlas, TooSmallAnAtlasScalesEveryMapAlike) {
  Frame frame = usualFrame();
  frame.budget.atlas = {1024, 1024};
  const auto solution = solve(frame, {.split = {}, .fit = FitMode::slice});
  ASSERT_EQ(solution->status, Status::ok);
  EXPECT_NE(solution->warnings & static_cast<std::uint32_t>(Warning::atlasReduced), 0u);
  double least = kInfinity, most = 0.0, sum = 0.0;
  for (int i = 0; i < 4; ++i) {
    const double texels = static_cast<double>(solution->partitions[i].viewport.z) * solution->partitions[i].viewport.w;
    least = std::min(least, texels);
    most = std::max(most, texels);
    sum += texels;
  }
  EXPECT_LT(most / least, 1.02);
  EXPECT_GT(sum, 0.9 * 1024 * 1024);  // four squares fill a square but for the step of the search
}

// A map that would be longer than the atlas is as long as it, which the warning says.
TEST(Atlas, AMapIsNoLongerThanTheAtlas) {
  Frame frame = usualFrame();
  frame.camera = orthographic({0.0, 2.0, 0.0}, {0.0, 0.0, -1.0}, {0.0, 1.0, 0.0}, 4.0, 1.0, 0.0, 400.0);  // 100 times as long as wide
  frame.light.directionWs = {0.0, -1.0, 0.0};
  frame.budget = {.partitions = 1, .resolution = 1024};
  const auto roomy = solve(frame);
  EXPECT_NEAR(roomy->partitions[0].viewport.z, 10240, 10240 / 100);
  EXPECT_EQ(roomy->warnings & static_cast<std::uint32_t>(Warning::atlasReduced), 0u);
  frame.budget.atlas = {4096, 4096};
  const auto tight = solve(frame);
  EXPECT_EQ(tight->partitions[0].viewport.z, 4096);
  EXPECT_NE(tight->warnings & static_cast<std::uint32_t>(Warning::atlasReduced), 0u);
}

}  // namespace
}  // namespace gnomon::test
