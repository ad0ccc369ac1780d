#include "support.h"

#include "gnomon/face.h"
#include "gnomon/fit.h"

namespace gnomon::test {
namespace {

Splits faces(const Frame& frame, NearFace nearFace, int most, bool inRows) {
  Region region;
  LightSpace light;
  int index = 0;
  double value = 0.0;
  EXPECT_EQ(makeRegion(frame, region, index, value), Status::ok);
  EXPECT_EQ(makeLightSpace(frame.light, region, FitMode::tight, light), Status::ok);
  Splits splits;
  splitFaces(region, light, nearFace, most, inRows, splits);
  return splits;
}

Frame level(const glm::dvec3& light) {
  Frame frame;
  frame.camera = perspective({0, 0, 0}, {0, 0, -1}, {0, 1, 0}, kPi / 2.0, 1.0, 1.0, 81.0);
  frame.light.directionWs = light;
  return frame;
}

// How many sides light meets first: straight down one (the top), slanting along a diagonal two, from behind or ahead all four.
TEST(Face, CountsTheSidesThatTheLightMeets) {
  EXPECT_EQ(faces(level({0, -1, 0}), NearFace::own, 16, false).count, 1);
  EXPECT_EQ(faces(level({-1, -1, 0.001}), NearFace::stretched, 16, false).count, 2);
  EXPECT_EQ(faces(level({0, 0, -1}), NearFace::own, 16, false).count, 5);
  EXPECT_EQ(faces(level({0, 0, -1}), NearFace::stretched, 16, false).count, 4);
  EXPECT_EQ(faces(level({0, 0, 1}), NearFace::own, 16, false).count, 5);
}

// Rows of equal ratio, and what is left over goes to the neediest side: 1 + 4 x 2 + 1.
TEST(Face, Rows) {
  const Splits splits = faces(level({0, 0, -1}), NearFace::own, 9, true);
  ASSERT_EQ(splits.count, 9);
  EXPECT_EQ(splits.wedges[0].end, 1.0);
  EXPECT_EQ(splits.wedges[1].start, 1.0);
  EXPECT_NEAR(splits.wedges[1].end, 9.0, 1e-9);
  EXPECT_EQ(splits.wedges[2].start, splits.wedges[1].end);
  EXPECT_EQ(splits.wedges[2].end, kInfinity);
  EXPECT_EQ(faces(level({0, 0, -1}), NearFace::own, 10, true).count, 10);
}

TEST(Face, NoneWhereThereAreTooFewMapsOrNoSides) {
  EXPECT_EQ(faces(level({0, 0, -1}), NearFace::own, 4, true).count, 0);
  Frame frame = level({0.1, -1, 0.2});
  frame.camera = orthographic({0, 0, 0}, {0, 0, -1}, {0, 1, 0}, 10.0, 1.0, 0.0, 50.0);
  EXPECT_EQ(faces(frame, NearFace::own, 16, true).count, 0);
}

// A face that the region leaves empty gets no map: receivers above the camera's axis only, light from behind.
TEST(Face, EmptySidesGetNoMap) {
  Frame frame = level({0, 0, -1});
  const Box box{{-0.05, 5.0, -60.0}, {0.05, 6.0, -20.0}};
  frame.scene.receivers = {&box, 1};
  EXPECT_EQ(faces(frame, NearFace::stretched, 16, false).count, 1);
}

// Every point of the view is held by at least one wedge; by exactly one but for rounding at their borders.
TEST(Face, EveryPointHasOneWedge) {
  Random random(311);
  for (int k = 0; k < 300; ++k) {
    Frame frame = usualFrame();
    frame.camera.forwardWs = random.direction();
    frame.light.directionWs = random.direction();
    if (k % 3 == 0) frame.camera.left = 0.2;
    if (k % 5 == 0) frame.camera.down = -0.1;
    const Splits splits = faces(frame, k % 2 ? NearFace::own : NearFace::stretched, 12, true);
    ASSERT_GT(splits.count, 0);
    const Axes axes(frame.camera);
    for (int i = 0; i < 200; ++i) {
      const glm::dvec3 ws = viewPoint(frame.camera, random.uniform(), random.uniform(), random.logUniform(0.1, 100.0));
      const glm::dvec3 vs(glm::dot(ws, axes.right), glm::dot(ws, axes.up), glm::dot(ws, axes.forward));
      int held = 0;
      for (int s = 0; s < splits.count; ++s) {
        const Wedge& wedge = splits.wedges[s];
        const double along = glm::dot(wedge.axis.normal, vs) + wedge.axis.offset;
        held += along >= wedge.start && along < wedge.end && glm::dot(wedge.left.normal, vs) + wedge.left.offset >= 0.0 &&
                glm::dot(wedge.right.normal, vs) + wedge.right.offset >= 0.0;
      }
      EXPECT_EQ(held, 1) << k;
    }
  }
}

}  // namespace
}  // namespace gnomon::test
