// What the lookups make of the host's comparison, and the debug views.
#include "parity.h"

namespace gnomon::test {
namespace {

// Filters against sums over a pattern of texels worked out here; taps stay inside the map, whatever the margin.
TEST_P(Parity, FiltersSumTheirTexels) {
  Gpu gpu(GetParam());
  for (const MapLayout layout : {MapLayout::atlas, MapLayout::layers}) {
    Frame frame = usualFrame();
    frame.budget.resolution = 64;  // small maps: many points near their borders
    frame.margin.filter = layout == MapLayout::atlas ? 0.0 : 2.0;
    frame.shadowMap.layout = layout;
    frame.bias = {.slope = 0.0, .constant = 0.0};
    const auto solution = solve(frame);
    ASSERT_EQ(solution->status, Status::ok);
    Random random(94);
    const std::vector<glm::vec4> points = pointsInMaps(random, frame, *solution, 6000);
    const auto results = gpu.run(
        "  vec3 up = vec3(0.0, 1.0, 0.0);\n  result = vec4(gnomonShadow(gnomon, 1, index, world, up), gnomonShadow3x3(gnomon, 2, index, "
        "world, up),\n"
        "                gnomonShadowTent(gnomon, 3, index, world, up), gnomonShadow(gnomon, 0, -1, world, world));\n",
        solution->block, points);
    int checked = 0, clamped = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const int k = static_cast<int>(points[i].w);
      const Partition& map = solution->partitions[k];
      const glm::dvec2 texel(texelReference(frame, map, glm::dvec3(points[i])));
      const glm::dvec2 inTexel = glm::fract(texel), inTent = glm::fract(texel - 0.5);
      constexpr double kClose = 0.02;  // float rounding may choose the neighbour closer to a border than this
      if (std::min({inTexel.x, inTexel.y, inTent.x, inTent.y}) < kClose ||
          std::max({inTexel.x, inTexel.y, inTent.x, inTent.y}) > 1.0 - kClose)
        continue;
      ++checked;
      const glm::ivec2 middle(glm::floor(texel)), least(map.viewport.x, map.viewport.y),
          most = least + glm::ivec2(map.viewport.z, map.viewport.w) - 1;
      const auto tap = [&](int x, int y, int number) {
        const glm::ivec2 at = glm::clamp(middle + glm::ivec2(x, y), least, most);
        clamped += at != middle + glm::ivec2(x, y);
        return pattern(at.x, at.y, layout == MapLayout::layers ? k : 0, number);
      };
      double box = 0.0, tent = 0.0, weights = 0.0;
      for (int y = -1; y <= 1; ++y)
        for (int x = -1; x <= 1; ++x) box += tap(x, y, 2) / 9.0;
      for (int y = -2; y <= 2; ++y)  // every texel whose centre lies within the tent's half width of 2
        for (int x = -2; x <= 2; ++x) {
          const glm::dvec2 away = glm::abs(glm::dvec2(middle + glm::ivec2(x, y)) + 0.5 - texel);
          const double weight = std::max(2.0 - away.x, 0.0) * std::max(2.0 - away.y, 0.0);
          weights += weight;
          tent += tap(x, y, 3) * weight;
        }
      EXPECT_NEAR(results[i].x, tap(0, 0, 1), 1e-6);
      EXPECT_NEAR(results[i].y, box, 1e-6);
      EXPECT_NEAR(results[i].z, tent / weights, 1e-3);
      EXPECT_EQ(results[i].w, 1.0f);  // no partition: lit
    }
    EXPECT_GT(checked, 4000);
    EXPECT_GT(clamped, layout == MapLayout::atlas ? 100 : -1);
  }
}

// The tent's weights sum to one, and its answer is continuous: across a straight edge it is the tent's integral, step by step.
TEST_P(Parity, TheTentIsContinuous) {
  Gpu gpu(GetParam());
  Frame frame = usualFrame();
  frame.bias = {.slope = 0.0, .constant = 0.0};
  frame.margin.filter = 8.0;
  const auto solution = solve(frame);
  constexpr int k = 1, kSteps = 1024, kPerTexel = 128;
  const Partition& map = solution->partitions[k];
  glm::dvec3 start = viewPoint(frame.camera, 0.5, 0.5, 0.5 * (map.near + map.far));
  const auto edges = measuredEdges(frame, *solution, k, start);
  const std::string body = "  result = vec4(gnomonShadowTent(gnomon, 0, index, world, vec3(0.0, 1.0, 0.0)));\n";
  for (int axis = 0; axis < 2; ++axis) {
    const double first = texelReference(frame, map, start)[axis];
    const double border = std::floor(first) + 4.0;  // texels before this are lit
    std::vector<glm::vec4> points;
    for (int i = 0; i < kSteps; ++i)
      points.emplace_back(glm::vec3(start + edges[static_cast<std::size_t>(axis)] * (static_cast<double>(i) / kPerTexel)),
                          static_cast<float>(k));
    const std::string component = axis == 0 ? "x" : "y";
    const std::string hook = "float gnomonCompare(int map, vec2 uv, float layer, float depth) { return uv." + component +
                             " * gnomon.atlas." + component + " < " + std::to_string(border) + " ? 1.0 : 0.0; }\n";
    const auto steps = gpu.run(body, solution->block, points, hook);
    const auto ones =
        gpu.run(body, solution->block, points, "float gnomonCompare(int map, vec2 uv, float layer, float depth) { return 1.0; }\n");
    for (std::size_t i = 0; i < points.size(); ++i) {
      EXPECT_NEAR(ones[i].x, 1.0, 1e-6);
      const double at = texelReference(frame, map, glm::dvec3(points[i]))[axis];
      double lit = 0.0;
      for (double centre = std::floor(at) - 2.5; centre < at + 4.0; centre += 1.0)
        lit += centre < border ? std::max(2.0 - std::abs(centre - at), 0.0) / 4.0 : 0.0;
      EXPECT_NEAR(steps[i].x, lit, 2e-3);
      if (i > 0) {  // the tent's height is half a unit for each texel of motion
        EXPECT_LE(steps[i].x, steps[i - 1].x + 1e-6);
        EXPECT_GE(steps[i].x, steps[i - 1].x - 0.5 / kPerTexel - 2e-3);
      }
    }
    EXPECT_EQ(steps.front().x, 1.0f);
    EXPECT_EQ(steps.back().x, 0.0f);
  }
}

// What the hook is given: the stored depth of the biased point, the same for every tap.
TEST_P(Parity, TheHookGetsTheStoredDepth) {
  Gpu gpu(GetParam());
  const std::string hook = "float gnomonCompare(int map, vec2 uv, float layer, float depth) { return depth; }\n";
  for (const DepthConvention depth : {DepthConvention::negativeOneToOne, DepthConvention::zeroToOne, DepthConvention::reversedZeroToOne}) {
    Frame frame = usualFrame();
    frame.shadowMap.depth = depth;
    const auto solution = solve(frame);
    Random random(98);
    const std::vector<glm::vec4> points = pointsInMaps(random, frame, *solution, 500);
    const glm::dvec3 normal = glm::normalize(glm::dvec3(0.2, 1.0, -0.3));
    const std::string up = "  vec3 up = normalize(vec3(0.2, 1.0, -0.3));\n";
    const auto results =
        gpu.run(up + "  result = vec4(gnomonShadow(gnomon, 0, index, world, up), gnomonShadow3x3(gnomon, 0, index, world, up), "
                     "gnomonShadowTent(gnomon, 0, index, world, up), 0.0);\n",
                solution->block, points, hook);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const int k = static_cast<int>(points[i].w);
      const glm::dvec3 world(points[i]);
      const auto edges = measuredEdges(frame, *solution, k, world);
      const double across = std::abs(glm::dot(normal, edges[0])) + std::abs(glm::dot(normal, edges[1]));
      const double longest = std::max(glm::length(edges[0]), glm::length(edges[1]));
      const std::array<double, 3> reach{0.5, 1.5, 2.0};
      for (int c = 0; c < 3; ++c) {
        const glm::dvec3 moved =
            world + normal * (frame.bias.slope * reach[static_cast<std::size_t>(c)] * across + frame.bias.constant * longest);
        EXPECT_NEAR(results[i][c], std::clamp(texelReference(frame, solution->partitions[k], moved).z, 0.0, 1.0), 4e-6);
      }
    }
  }
}

TEST_P(Parity, TintsAreDistinctColours) {
  Gpu gpu(GetParam());
  std::vector<glm::vec4> points;
  for (int i = -1; i < kMaxPartitions; ++i) points.emplace_back(0.0f, 0.0f, 0.0f, static_cast<float>(i));
  const auto tints = gpu.run("  result = vec4(gnomonTint(index), gnomonGrid(gnomon, -1, world));\n", GnomonBlock{}, points);
  EXPECT_EQ(tints[0], glm::vec4(0.5f, 0.5f, 0.5f, 0.0f));
  for (std::size_t i = 0; i < tints.size(); ++i)
    for (int c = 0; c < 3; ++c) {
      EXPECT_GE(tints[i][c], 0.0f);
      EXPECT_LE(tints[i][c], 1.0f);
    }
  constexpr float kEightBitSteps = 8.0f / 255.0f;  // neighbours and everything else can be told apart in a picture
  for (std::size_t i = 0; i < tints.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) EXPECT_GT(glm::length(glm::vec3(tints[i]) - glm::vec3(tints[j])), kEightBitSteps) << i << " " << j;
}

}  // namespace
}  // namespace gnomon::test
