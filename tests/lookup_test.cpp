#include "support.h"

#include "gnomon/lloyd.h"
#include "gnomon/lspsm.h"

namespace gnomon::test {
namespace {

// Selection by window depth and by view depth name the partition whose interval holds the depth, in every convention.
TEST(Lookup, SelectsTheIntervalThatHoldsTheDepth) {
  Random random(81);
  for (const DepthConvention depth : {DepthConvention::negativeOneToOne, DepthConvention::zeroToOne, DepthConvention::reversedZeroToOne})
    for (int count = 1; count <= 16; ++count) {
      Frame frame = usualFrame();
      frame.camera.depth = depth;
      frame.budget.partitions = count;
      const auto solution = solve(frame);
      const double n = frame.camera.near, f = frame.camera.far;
      for (int i = 0; i < 200; ++i) {
        const double z = random.logUniform(n, f);
        bool isNearASplit = false;  // closer than float depth can tell
        for (int k = 0; k < count; ++k) isNearASplit |= std::abs(z / solution->partitions[k].near - 1.0) < 1e-3;
        if (isNearASplit) continue;
        const int expected = servedBy(*solution, z, 0.0);
        const double window = depth == DepthConvention::reversedZeroToOne ? n / (f - n) * (f / z - 1.0) : f / (f - n) * (1.0 - n / z);
        EXPECT_EQ(selectByWindowDepth(solution->block, static_cast<float>(window)), expected) << z;
        EXPECT_EQ(selectByViewDepth(solution->block, static_cast<float>(z)), expected) << z;
      }
      EXPECT_EQ(selectByViewDepth(solution->block, static_cast<float>(f * 1.001)), -1);
      EXPECT_EQ(selectByViewDepth(solution->block, static_cast<float>(n * 0.999)), -1);
      EXPECT_EQ(selectByViewDepth(solution->block, -5.0f), -1);
    }
}

// Half-open: a split depth belongs to the map that begins there; the first and last ends belong to theirs.
TEST(Lookup, BoundariesBelongToTheNextMap) {
  const Frame frame = usualFrame();
  const auto solution = solve(frame);
  for (int k = 1; k < 4; ++k) {
    const float start = solution->block.viewStart[0][k];
    EXPECT_EQ(selectByViewDepth(solution->block, start), k);
    EXPECT_EQ(selectByViewDepth(solution->block, std::nextafter(start, 0.0f)), k - 1);
  }
  EXPECT_EQ(selectByViewDepth(solution->block, 0.1f), 0);
  EXPECT_EQ(selectByViewDepth(solution->block, 100.0f), 3);
  EXPECT_EQ(selectByWindowDepth(solution->block, 0.0f), 0);
  EXPECT_EQ(selectByWindowDepth(solution->block, 1.0f), 3);
}

// Faces and rows, which depth does not find: the first whose planes hold a point, away from borders. A slice as depth finds it.
TEST(Lookup, MaskFindsFacesRowsAndSlices) {
  Random random(83);
  for (const bool worldSpace : {false, true})
    for (int k = 0; k < 12; ++k) {
      Frame frame = usualFrame();
      frame.worldSpace = worldSpace;
      frame.budget.partitions = k % 2 ? 7 : 16;
      if (k >= 3) frame.light.directionWs = random.direction();
      Solution solution;
      const Status status = k % 3 == 0   ? solveLloyd(frame, {.scheme = LloydScheme::fpzpw, .split = {}}, solution)
                            : k % 3 == 1 ? solveLspsm(frame, {.rows = {.maxColumns = 3}}, solution)
                                         : solvePssm(frame, {}, solution);
      ASSERT_EQ(status, Status::ok);
      if (k < 2) {
        ASSERT_GT(solution.partitions[0].planeCount, 0);
      }
      int compared = 0;
      for (int i = 0; i < 500; ++i) {
        const double z = random.logUniform(frame.camera.near, frame.camera.far);
        const glm::dvec3 ws = frame.camera.positionWs + viewPoint(frame.camera, random.uniform(), random.uniform(), z);
        int expected = -1;
        double nearest = kInfinity;  // border
        for (int m = 0; m < solution.partitionCount; ++m) {
          const Partition& map = solution.partitions[m];
          double inside = map.planeCount > 0 ? kInfinity : std::min(z - map.near, map.far - z);
          for (int p = 0; p < map.planeCount; ++p) inside = std::min(inside, glm::dot(glm::dvec3(map.planes[p]), ws) + map.planes[p].w);
          nearest = std::min(nearest, std::abs(inside));
          if (expected < 0 && inside > 0.0) expected = m;
        }
        if (nearest < 4e-6 * (z + glm::length(frame.camera.positionWs))) continue;
        ++compared;
        ASSERT_EQ(selectByMask(solution.block, ws - solution.originWs), expected) << k << " " << z;
        const int byDepth = selectByViewDepth(solution.block, static_cast<float>(z));
        EXPECT_EQ(byDepth, solution.partitions[0].planeCount > 0 ? -1 : expected) << k << " " << z;
      }
      EXPECT_GT(compared, 450) << k;
      EXPECT_EQ(selectByMask(solution.block, glm::dvec3(std::nan(""))), -1);
    }
  GnomonBlock none;
  clearBlock(none);
  EXPECT_EQ(selectByMask(none, glm::dvec3(1.0, 2.0, 3.0)), -1);
}

// Outside its map a point is said to be, within a texel of it not; depth stays in the map's range.
TEST(Lookup, AtlasPositionSaysWhetherItIsInside) {
  Frame frame = usualFrame();
  frame.shadowMap.depth = DepthConvention::negativeOneToOne;
  const auto solution = solve(frame);
  const glm::dvec3 light = glm::normalize(frame.light.directionWs);
  for (int k = 0; k < solution->partitionCount; ++k) {
    const Partition& map = solution->partitions[k];
    const auto worldAt = [&](double texelX, double texelY) {  // of a texel of the map: clip space backwards, at the middle of its depth
      const glm::dvec4 clip(2.0 * texelX / map.viewport.z - 1.0, 2.0 * texelY / map.viewport.w - 1.0, 0.0, 1.0);
      const glm::dvec4 ws = glm::inverse(glm::dmat4(map.clipFromWorld)) * clip;
      return glm::dvec3(ws) / ws.w;
    };
    for (const double out : {-10.0, 0.5, 0.9, 1.1, 3.0}) {
      const double inside = out < 1.0 ? 1.0 : 0.0, across = map.viewport.z / 2.0, up = map.viewport.w / 2.0;
      EXPECT_EQ(atlasPosition(solution->block, k, worldAt(-out, up)).w, inside) << k << " " << out;
      EXPECT_EQ(atlasPosition(solution->block, k, worldAt(map.viewport.z + out, up)).w, inside) << k << " " << out;
      EXPECT_EQ(atlasPosition(solution->block, k, worldAt(across, -out)).w, inside) << k << " " << out;
      EXPECT_EQ(atlasPosition(solution->block, k, worldAt(across, map.viewport.w + out)).w, inside) << k << " " << out;
    }
    const glm::dvec3 middle = worldAt(map.viewport.z / 2.0, map.viewport.w / 2.0);
    EXPECT_NEAR(atlasPosition(solution->block, k, middle).z, 0.5, 1e-4);
    EXPECT_EQ(atlasPosition(solution->block, k, middle - light * 1e4).z, 0.0);
    EXPECT_EQ(atlasPosition(solution->block, k, middle + light * 1e4).z, 1.0);
  }
}

TEST(Lookup, ViewDepthIsAlongTheView) {
  Random random(82);
  for (const bool worldSpace : {false, true}) {
    Frame frame = usualFrame();
    frame.worldSpace = worldSpace;
    const auto solution = solve(frame);
    for (int i = 0; i < 100; ++i) {
      const double z = random.uniform(-50.0, 150.0);
      const glm::dvec3 rel = frame.camera.positionWs + viewPoint(frame.camera, random.uniform(), random.uniform(), z) - solution->originWs;
      EXPECT_NEAR(viewDepth(solution->block, rel), z, 1e-4);
    }
  }
}

}  // namespace
}  // namespace gnomon::test
