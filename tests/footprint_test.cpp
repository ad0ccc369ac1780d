#include "support.h"

#include "gnomon/footprint.h"
#include "gnomon/fit.h"

namespace gnomon::test {
namespace {

struct Made {
  Region region;
  LightSpace light;
  Splits splits;
  Footprint footprints[kMaxPartitions];
  Served served[kMaxPartitions];
};

std::unique_ptr<Made> make(const Frame& frame, int count) {
  auto made = std::make_unique<Made>();
  int index = 0;
  double value = 0.0;
  EXPECT_EQ(makeRegion(frame, made->region, index, value), Status::ok);
  EXPECT_EQ(makeLightSpace(frame.light, made->region, FitMode::tight, made->light), Status::ok);
  EXPECT_EQ(split(made->region, {}, count, made->splits, value), Status::ok);
  makeFootprints(made->region, made->light, made->splits, {}, false, true, made->footprints, made->served);
  return made;
}

double area(const Footprint& footprint) {
  double twice = 0.0;
  for (int i = 0; i < footprint.count; ++i) {
    const glm::dvec2 p = footprint.hull[i], q = footprint.hull[(i + 1) % footprint.count];
    twice += p.x * q.y - p.y * q.x;
  }
  return twice / 2.0;
}

// Light straight down on a level camera of 90 degrees: a slice from a to b is a trapezoid of area b^2 - a^2, counter-clockwise; a pixel is
// 2 z / 1080 wide.
TEST(Footprint, SlicesSeenFromAbove) {
  Frame frame;
  frame.camera = perspective({0, 5, 0}, {0, 0, -1}, {0, 1, 0}, kPi / 2.0, 1.0, 1.0, 16.0);
  frame.camera.depth = DepthConvention::reversedZeroToOne;
  frame.light.directionWs = {0, -1, 0};
  frame.image = {1080.0, 1080.0};
  const auto made = make(frame, 2);
  const double depths[3] = {1.0, 4.0, 16.0};
  for (int i = 0; i < 2; ++i) {
    const double a = depths[i], b = depths[i + 1];
    EXPECT_NEAR(area(made->footprints[i]) / (b * b - a * a), 1.0, 1e-5);
    EXPECT_NEAR(made->footprints[i].depthNear, -b, 1e-5 * b);
    EXPECT_NEAR(made->footprints[i].depthFar, b, 1e-5 * b);
    const Served& served = made->served[i];
    ASSERT_EQ(served.count, 8);
    for (int v = 0; v < 8; ++v) {
      const double z = served.pixels[v] * 1080.0 / 2.0;
      EXPECT_TRUE(std::abs(z - a) < 1e-9 || std::abs(z - b) < 1e-9) << z;  // not padded
    }
  }
}

// Every point of the view lies inside its slice's hull, whatever cuts the view: hulls that are taken over from the slice before included.
TEST(Footprint, HoldsEveryPoint) {
  Random random(301);
  for (int k = 0; k < 200; ++k) {
    Frame frame = usualFrame();
    frame.camera.forwardWs = random.direction();
    frame.light.directionWs = random.direction();
    const glm::dvec4 plane(random.direction(), random.uniform(0.0, 20.0));
    if (k % 2 == 1) frame.scene.planes = {&plane, 1};
    const int count = 1 + k % 6;
    const auto made = make(frame, count);
    for (int i = 0; i < 300; ++i) {
      const double z = random.logUniform(0.1, 100.0);
      const glm::dvec3 fromEye = viewPoint(frame.camera, random.uniform(), random.uniform(), z);
      if (!needsShadow(frame, frame.camera.positionWs + fromEye)) continue;
      int slice = 0;
      while (slice + 1 < made->splits.count && z >= made->splits.slices[slice].far) ++slice;
      const Footprint& footprint = made->footprints[slice];
      ASSERT_GE(footprint.count, 3);
      const glm::dvec3 ls(made->light.lsFromWorld * glm::dvec4(fromEye, 0.0));
      for (int v = 0; v < footprint.count; ++v) {
        const glm::dvec2 p = footprint.hull[v], edge = footprint.hull[(v + 1) % footprint.count] - p;
        EXPECT_GE(edge.x * (ls.y - p.y) - edge.y * (ls.x - p.x), -1e-9 * z * glm::length(edge)) << k;
      }
      EXPECT_GE(ls.z, footprint.depthNear - 1e-9 * z);
      EXPECT_LE(ls.z, footprint.depthFar + 1e-9 * z);
    }
  }
}

// Hundreds of receivers: the hull is simplified, and still holds every corner that the view sees.
TEST(Footprint, ManyReceivers) {
  Random random(302);
  Frame frame = usualFrame();
  std::vector<Box> boxes;
  for (int i = 0; i < 300; ++i) {
    const glm::dvec3 centre =
        frame.camera.positionWs + viewPoint(frame.camera, random.uniform(), random.uniform(), random.logUniform(1.0, 90.0));
    boxes.push_back({centre - glm::dvec3(0.2), centre + glm::dvec3(0.2)});
  }
  frame.scene.receivers = boxes;
  const auto made = make(frame, 1);
  const Footprint& footprint = made->footprints[0];
  EXPECT_LE(footprint.count, kMaxHull);
  EXPECT_LE(made->served[0].count, kMaxHull);
  for (const Box& box : boxes) {
    const glm::dvec3 ls(made->light.lsFromWorld * glm::dvec4((box.minWs + box.maxWs) / 2.0 - frame.camera.positionWs, 0.0));
    for (int v = 0; v < footprint.count; ++v) {
      const glm::dvec2 p = footprint.hull[v], edge = footprint.hull[(v + 1) % footprint.count] - p;
      EXPECT_GE(edge.x * (ls.y - p.y) - edge.y * (ls.x - p.x), -1e-7);
    }
  }
}

}  // namespace
}  // namespace gnomon::test
