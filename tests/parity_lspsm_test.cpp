// The cell lookup against the mask, against the answer's planes in double, and on every boundary to the last bit.
#include "parity.h"

#include "gnomon/lspsm.h"

namespace gnomon::test {
namespace {

// The first partition whose planes hold a point, by the block's own floats in double; kMayDiffer within rounding of a border.
int servedByPlanes(const GnomonBlock& block, const glm::dvec3& world) {
  const double slack = 4e-6 * glm::length(world);
  for (unsigned i = 0; i < block.info.x; ++i) {
    const GnomonPartition& map = block.partitions[i];
    const auto at = [&](const vec4& plane) { return glm::dot(glm::dvec4(plane), glm::dvec4(world, 1.0)); };
    const double inside =
        std::min({at(map.axis) - map.range.x, static_cast<double>(map.range.y) - at(map.axis), at(map.left), at(map.right)});
    if (std::abs(inside) < slack) return kMayDiffer;
    if (inside > 0.0) return static_cast<int>(i);
  }
  return -1;
}

const char* const kBoth =
    "  result = vec4(float(gnomonSelectCell(gnomon, world)), float(gnomonSearchCell(gnomon, world)), "
    "float(gnomonSelectMask(gnomon, world)), 0.0);\n";

TEST_P(Parity, CellIsWhoServes) {
  Gpu gpu(GetParam());
  Random random(521);
  int byRule = 0, withColumns = 0;
  for (int k = 0; k < 9; ++k) {
    Frame frame = usualFrame();
    frame.camera.positionWs = {0.0, 0.0, 0.0};
    frame.camera.far = random.logUniform(10.0, 1000.0);
    if (k != 0) frame.light.directionWs = random.direction();
    frame.budget.partitions = k % 2 ? 7 : 16;
    if (k == 3) frame.camera = orthographic({0, 0, 0}, {0, 0, -1}, {0, 1, 0}, 10.0, 1.5, -1.0, 50.0);
    const LspsmSettings settings{.rows = {.rule = k % 3 == 2 ? RowRule::error : RowRule::fitted,
                                          .zeta = 0.1 + 0.1 * (k % 4),
                                          .maxRows = k % 2 ? 16 : 5,
                                          .maxColumns = 3}};
    Solution solution;
    ASSERT_EQ(solveLspsm(frame, settings, solution), Status::ok);
    if (solution.partitions[0].planeCount == 0 && solution.partitionCount > 1) continue;  // slices need fewer texels
    byRule += solution.block.rowRule.w >= 0.0f;
    withColumns += solution.block.rows[0].w > 0.0f;
    std::vector<glm::vec4> points;
    for (int i = 0; i < 2000; ++i)
      points.emplace_back(glm::vec3(viewPoint(frame.camera, random.uniform(), random.uniform(),
                                              random.logUniform(std::max(frame.camera.near, 0.1), frame.camera.far))),
                          0.0f);
    for (int i = 0; i < 200; ++i) points.emplace_back(glm::vec3(random.direction() * 200.0), 0.0f);  // beside and beyond the view
    const auto results = gpu.run(kBoth, solution.block, points);
    int compared = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const int expected = servedByPlanes(solution.block, glm::dvec3(points[i]));
      ASSERT_EQ(results[i].x, results[i].y) << k << " " << i;
      if (expected == kMayDiffer) continue;
      ++compared;
      ASSERT_EQ(results[i].x, static_cast<float>(expected)) << k << " " << i;
      ASSERT_EQ(results[i].z, static_cast<float>(expected)) << k << " " << i;
      ASSERT_EQ(selectByMask(solution.block, glm::dvec3(points[i])), expected) << k << " " << i;
    }
    EXPECT_GT(compared, 1800);
  }
  EXPECT_GT(byRule, 2);
  EXPECT_GT(withColumns, 1);
}

// Points at a boundary and a float step to either side: `along` is the x coordinate, so that nothing is rounded on the way.
TEST_P(Parity, CellIsExactOnEveryBoundary) {
  Gpu gpu(GetParam());
  Random random(522);
  for (int k = 0; k < 8; ++k) {
    Frame frame = usualFrame();
    frame.camera.positionWs = {0.0, 0.0, 0.0};
    frame.light.directionWs = {0.1, -1.0, 0.1};
    frame.camera.far = random.logUniform(10.0, 1e4);
    frame.budget.partitions = 4 * (1 + k % 4);
    Solution solution;
    ASSERT_EQ(solveLspsm(frame, {.rows = {.zeta = 0.02 + 0.05 * k, .maxColumns = 1}}, solution), Status::ok);
    GnomonBlock block = solution.block;
    ASSERT_GE(block.rowRule.w, 0.0f);
    block.rowAlong = vec4(1.0f, 0.0f, 0.0f, 0.0f);
    std::vector<glm::vec4> points;
    std::vector<int> rows;
    const int count = static_cast<int>(block.rowRule.x) + 1;
    for (int r = 1; r < count; ++r) {
      const float start = block.rowStart[r / 4][r % 4];
      for (const float x : {std::nextafter(start, -3e38f), start, std::nextafter(start, 3e38f)}) {
        points.emplace_back(x, 0.0f, 0.0f, 0.0f);
        rows.push_back(x >= start ? r : r - 1);
      }
    }
    const auto results = gpu.run(kBoth, block, points);
    for (std::size_t i = 0; i < points.size(); ++i) {
      EXPECT_EQ(results[i].x, static_cast<float>(rows[i])) << k << " " << i;
      EXPECT_EQ(results[i].y, static_cast<float>(rows[i])) << k << " " << i;
    }
  }
}

// A solution without rows has no cell.
TEST_P(Parity, NoCellWithoutRows) {
  Gpu gpu(GetParam());
  const auto solution = solve(usualFrame());
  for (const glm::vec4& result : gpu.run(kBoth, solution->block, {glm::vec4(0.0f, 0.0f, 5.0f, 0.0f)})) {
    EXPECT_EQ(result.x, -1.0f);
    EXPECT_EQ(result.y, -1.0f);
  }
}

}  // namespace
}  // namespace gnomon::test
