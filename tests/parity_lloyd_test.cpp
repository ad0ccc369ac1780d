// The mask lookup against the planes and intervals of the answer, in double.
#include "parity.h"

#include "gnomon/lloyd.h"

namespace gnomon::test {
namespace {

// The first partition whose interval and planes hold a point; kMayDiffer within rounding of a border.
int servedByMask(const Frame& frame, const Solution& solution, const glm::dvec3& fromEye) {
  const double z = glm::dot(fromEye, Axes(frame.camera).forward), slack = 4e-6 * glm::length(fromEye);
  for (int i = 0; i < solution.partitionCount; ++i) {
    const Partition& map = solution.partitions[i];
    double inside = kInfinity;
    if (map.planeCount == 0) inside = std::min(z - map.near, map.far - z);
    for (int p = 0; p < map.planeCount; ++p)
      inside = std::min(inside, glm::dot(glm::dvec3(map.planes[p]), frame.camera.positionWs + fromEye) + map.planes[p].w);
    if (std::abs(inside) < slack) return kMayDiffer;
    if (inside > 0.0) return i;
  }
  return -1;
}

TEST_P(Parity, MaskFindsWhoServes) {
  Gpu gpu(GetParam());
  Random random(331);
  for (const LloydScheme scheme : {LloydScheme::zpw, LloydScheme::fpw, LloydScheme::fpzpw})
    for (int k = 0; k < 6; ++k) {
      Frame frame = usualFrame();
      frame.camera.positionWs = {0.0, 0.0, 0.0};
      frame.light.directionWs = k == 0 ? frame.camera.forwardWs : random.direction();
      frame.budget.partitions = k % 2 ? 7 : 16;
      Solution solution;
      ASSERT_EQ(solveLloyd(frame, {.scheme = scheme, .split = {}}, solution), Status::ok);
      std::vector<glm::vec4> points;
      for (int i = 0; i < 3000; ++i)
        points.emplace_back(glm::vec3(viewPoint(frame.camera, random.uniform(), random.uniform(), random.logUniform(0.1, 100.0))), 0.0f);
      for (int i = 0; i < 200; ++i) points.emplace_back(glm::vec3(random.direction() * 200.0), 0.0f);  // beside and beyond the view
      const auto results = gpu.run(
          "  int at = gnomonSelectMask(gnomon, world);\n"
          "  vec4 own = gnomonMaskCoordinate(gnomonMask4(gnomon, 0, world), gnomonVertexPosition(gnomon, 0, world), "
          "gnomonVertexPosition(gnomon, 1, world), gnomonVertexPosition(gnomon, 2, world), gnomonVertexPosition(gnomon, 3, world));\n"
          "  result = vec4(float(at), own.xyw);\n",
          solution.block, points);
      int compared = 0, looked = 0;
      for (std::size_t i = 0; i < points.size(); ++i) {
        const glm::dvec3 world(points[i]);
        const int expected = servedByMask(frame, solution, world);
        if (expected == kMayDiffer) continue;
        ++compared;
        ASSERT_EQ(results[i].x, static_cast<float>(expected)) << static_cast<int>(scheme) << " " << k << " " << i;
        ASSERT_EQ(selectByMask(solution.block, world), expected) << static_cast<int>(scheme) << " " << k << " " << i;
        if (expected < 0 || expected > 3) {
          EXPECT_EQ(results[i].w, 0.0f);
          continue;
        }
        const glm::dvec3 texel = texelReference(frame, solution.partitions[expected], world);
        const glm::ivec4& v = solution.partitions[expected].viewport;
        if (texel.x < v.x || texel.x > v.x + v.z || texel.y < v.y || texel.y > v.y + v.w)
          continue;  // a face's planes go on beyond the view
        ++looked;
        EXPECT_NEAR(static_cast<double>(results[i].y) / results[i].w * solution.atlas.x, texel.x, 1.0 / 64.0);
        EXPECT_NEAR(static_cast<double>(results[i].z) / results[i].w * solution.atlas.y, texel.y, 1.0 / 64.0);
      }
      EXPECT_GT(compared, 2500);
      EXPECT_GT(looked, 500);
    }
}

// Half-open: a point exactly on a split, which float32 holds here, belongs to the slice that begins there.
TEST_P(Parity, TheMaskGivesASplitToWhatBeginsThere) {
  Gpu gpu(GetParam());
  Frame frame = usualFrame();
  frame.camera = perspective({0, 0, 0}, {0, 0, -1}, {0, 1, 0}, 1.0, 1.5, 0.5, 100.0);
  const auto solution = solve(frame);
  ASSERT_EQ(solution->partitionCount, 4);
  std::vector<glm::vec4> points;
  for (int i = 1; i < 4; ++i) points.emplace_back(0.0f, 0.0f, -solution->block.partitions[i].range.x, static_cast<float>(i));
  const auto selected = gpu.run("  result = vec4(float(gnomonSelectMask(gnomon, world)));\n", solution->block, points);
  for (std::size_t i = 0; i < points.size(); ++i) {
    EXPECT_EQ(selected[i].x, points[i].w);
    EXPECT_EQ(selectByMask(solution->block, glm::dvec3(points[i])), static_cast<int>(points[i].w));
  }
}

}  // namespace
}  // namespace gnomon::test
