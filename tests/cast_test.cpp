#include "support.h"

#include "gnomon/cast.h"

namespace gnomon::test {
namespace {

bool holds(const Partition& map, const glm::dvec3& ws, double slack) {
  for (int i = 0; i < map.cullPlaneCount; ++i)
    if (glm::dot(glm::dvec3(map.cullPlanes[i]), ws) + map.cullPlanes[i].w < -slack) return false;
  return true;
}

// Whatever lies between the light and a point to be shadowed is kept.
TEST(Cast, PlanesHoldEveryCasterOfEveryReceiver) {
  Random random(61);
  for (int i = 0; i < 400; ++i) {
    Frame frame = usualFrame();
    frame.camera.forwardWs = random.direction();
    frame.light.directionWs = random.index(5) == 0 ? frame.camera.forwardWs : random.direction();
    std::vector<Box> boxes;
    for (int b = random.index(4); b > 0; --b) {
      const glm::dvec3 centre =
                           frame.camera.positionWs + viewPoint(frame.camera, random.uniform(), random.uniform(), random.uniform(1, 90)),
                       half = glm::abs(random.direction()) * random.uniform(0.5, 20.0);
      boxes.push_back({centre - half, centre + half});
    }
    frame.scene.receivers = boxes;
    const std::vector<glm::dvec4> planes{{0, 1, 0, 1.0}};
    if (random.index(2) == 0) frame.scene.planes = planes;
    const auto solution = solve(frame, {.split = {}, .fit = static_cast<FitMode>(random.index(3))});
    ASSERT_EQ(solution->status, Status::ok);
    const glm::dvec3 towardsLight = -glm::normalize(frame.light.directionWs);
    for (int p = 0; p < 200; ++p) {
      const double z = random.logUniform(0.1, 100.0);
      const glm::dvec3 ws = frame.camera.positionWs + viewPoint(frame.camera, random.uniform(), random.uniform(), z);
      if (!needsShadow(frame, ws)) continue;
      const int index = servedBy(*solution, z, 0.0);
      ASSERT_GE(index, 0);
      for (const double far : {0.0, 1.0, 1e3})
        EXPECT_TRUE(holds(solution->partitions[index], ws + towardsLight * far, 1e-9)) << "view " << i;
    }
  }
}

// Light straight down on a level, square, 90 degree view: casters of the only map lie over the trapezoid, and above its bottom.
TEST(Cast, VolumeIsTight) {
  Frame frame;
  frame.camera = perspective({0, 0, 0}, {0, 0, -1}, {0, 1, 0}, kPi / 2.0, 1.0, 1.0, 10.0);
  frame.light.directionWs = {0, -1, 0};
  frame.budget.partitions = 1;
  frame.budget.resolution = 8192;
  const auto solution = solve(frame);
  const Partition& map = solution->partitions[0];
  const double texel = 20.0 / 8192.0 * 2.0;  // room for the texel that the planes are moved out by
  EXPECT_TRUE(holds(map, {0, 500, -5}, 0.0));
  EXPECT_TRUE(holds(map, {4.9, 500, -5}, 0.0));
  EXPECT_FALSE(holds(map, {5.0 + 2.0 * texel, 500, -5}, 0.0));  // beside the slanted side
  EXPECT_FALSE(holds(map, {0, 500, -10.0 - 2.0 * texel}, 0.0));  // beyond far
  EXPECT_FALSE(holds(map, {0, 500, -1.0 + 2.0 * texel}, 0.0));  // before near
  EXPECT_FALSE(holds(map, {0, -5.0 - 2.0 * texel, -5}, 0.0));  // below the bottom side plane
  EXPECT_TRUE(holds(map, {0, -4.9, -5}, 0.0));
}

TEST(Cast, MayCastTestsBoxes) {
  Frame frame;
  frame.camera = perspective({0, 0, 0}, {0, 0, -1}, {0, 1, 0}, kPi / 2.0, 1.0, 1.0, 10.0);
  frame.light.directionWs = {0, -1, 0};
  frame.budget.partitions = 1;
  const Partition map = solve(frame)->partitions[0];
  EXPECT_TRUE(mayCast(map, {{-1, 90, -6}, {1, 91, -5}}));
  EXPECT_TRUE(mayCast(map, {{-1000, 90, -1000}, {1000, 91, 1000}}));
  EXPECT_FALSE(mayCast(map, {{30, 90, -6}, {31, 91, -5}}));
  EXPECT_FALSE(mayCast(map, {{-1, -91, -6}, {1, -90, -5}}));
}

// The planes that a half-space gives are those of one whose normal is unit, however long its own is.
TEST(Cast, PlanesOfHalfSpacesOfAnyLength) {
  Frame frame;
  frame.camera = perspective({0, 0, 0}, {0, 0, -1}, {0, 1, 0}, kPi / 2.0, 1.0, 1.0, 10.0);
  frame.light.directionWs = {0.2, -1, 0.1};
  const glm::dvec4 plane(0.36, 0.8, 0.48, 2.0);
  frame.scene.planes = {&plane, 1};
  const auto expected = solve(frame);
  ASSERT_GT(expected->partitionCount, 0);
  for (const double length : {1e-200, 1e-170, 1e-100, 1e100, 1e170, 1e200}) {
    const glm::dvec4 scaled = plane * length;
    frame.scene.planes = {&scaled, 1};
    const auto found = solve(frame);
    ASSERT_EQ(found->partitionCount, expected->partitionCount) << length;
    for (int i = 0; i < found->partitionCount; ++i) {
      const Partition &a = found->partitions[i], &b = expected->partitions[i];
      ASSERT_EQ(a.cullPlaneCount, b.cullPlaneCount) << length;
      for (int p = 0; p < a.cullPlaneCount; ++p)
        for (int c = 0; c < 4; ++c) EXPECT_NEAR(a.cullPlanes[p][c], b.cullPlanes[p][c], 1e-9) << length << " " << i << " " << p;
    }
  }
}

// Casters over the map lie inside its depth range; those beside it do not stretch it; receivers lie inside always.
TEST(Cast, DepthRangeReachesTheCasters) {
  Frame frame;
  frame.camera = perspective({0, 0, 0}, {0, 0, -1}, {0, 1, 0}, kPi / 2.0, 1.0, 1.0, 10.0);
  frame.light.directionWs = {0, -1, 0};
  frame.budget.partitions = 1;
  const auto depthAt = [](const Solution& solution, const glm::dvec3& ws) {
    const glm::dvec4 q = glm::dmat4(solution.partitions[0].clipFromWorld) * glm::dvec4(ws - solution.originWs, 1.0);
    return q.z / q.w;
  };
  const auto open = solve(frame);
  EXPECT_TRUE(open->depthClamp);
  EXPECT_NEAR(depthAt(*open, {0, 10, -10}), 0.0, 1e-4);
  EXPECT_NEAR(depthAt(*open, {0, -10, -10}), 1.0, 1e-4);
  const std::vector<Box> over{{{-1, 40, -6}, {1, 60, -5}}}, beside{{{100, 40, -6}, {101, 60, -5}}}, below{{{-1, -90, -6}, {1, -80, -5}}};
  frame.scene.casters = over;
  const auto reaching = solve(frame);
  EXPECT_FALSE(reaching->depthClamp);
  EXPECT_GE(depthAt(*reaching, {0, 60, -5}), 0.0);
  EXPECT_NEAR(depthAt(*reaching, {0, 60, -5}), 0.0, 1e-4);
  EXPECT_NEAR(depthAt(*reaching, {0, -10, -10}), 1.0, 1e-4);
  for (const auto& boxes : {beside, below}) {
    frame.scene.casters = boxes;
    EXPECT_NEAR(depthAt(*solve(frame), {0, 10, -10}), 0.0, 1e-4);
  }
}

}  // namespace
}  // namespace gnomon::test
