#include "support.h"

#include "gnomon/region.h"

namespace gnomon::test {
namespace {

Status make(const Frame& frame, Region& region, int& index, double& value) { return makeRegion(frame, region, index, value); }

TEST(Region, RefusesBadBoxesAndPlanes) {
  Frame frame = usualFrame();
  Region region;
  int index = 0;
  double value = 0.0;
  // min above max
  const std::vector<Box> inverted{{{0, 0, 0}, {1, 1, 1}}, {{0, 2, 0}, {1, 1, 1}}};
  frame.scene.receivers = inverted;
  EXPECT_EQ(make(frame, region, index, value), Status::receiverBox);
  EXPECT_EQ(index, 1);
  EXPECT_EQ(value, 1.0);
  // not finite, as casters
  const std::vector<Box> nan{{{0, std::nan(""), 0}, {1, 1, 1}}};
  frame.scene = {.casters = nan, .planes = {}};
  EXPECT_EQ(make(frame, region, index, value), Status::casterBox);
  // planes
  const std::vector<glm::dvec4> flat{{0, 1, 0, 0}, {0, 0, 0, 1}}, endless{{0, 1, 0, kInfinity}};
  frame.scene = {.planes = flat};
  EXPECT_EQ(make(frame, region, index, value), Status::halfSpace);
  EXPECT_EQ(index, 1);
  frame.scene = {.planes = endless};
  EXPECT_EQ(make(frame, region, index, value), Status::halfSpace);
  // nothing
  frame.scene = {};
  EXPECT_EQ(make(frame, region, index, value), Status::ok);
}

Region regionOf(const Frame& frame) {
  Region region;
  int index = 0;
  double value = 0.0;
  EXPECT_EQ(makeRegion(frame, region, index, value), Status::ok);
  return region;
}

// An eye at the origin that looks along -z, 90 degrees square, near 1, far 100.
Frame plainFrame() {
  Frame frame;
  frame.camera = perspective({0, 0, 0}, {0, 0, -1}, {0, 1, 0}, kPi / 2.0, 1.0, 1.0, 100.0);
  return frame;
}

TEST(Region, WholeFrustumIsItsEightCorners) {
  const Region region = regionOf(plainFrame());
  ASSERT_EQ(region.spanCount, 1);
  EXPECT_EQ(region.spans[0].near, 1.0);
  EXPECT_EQ(region.spans[0].far, 100.0);
  EXPECT_EQ(region.volume.vertexCount, 8);
  EXPECT_EQ(region.volume.edgeCount, 12);
}

TEST(Region, ShadowDistanceCutsIt) {
  Frame frame = plainFrame();
  frame.camera.shadowDistance = 40.0;
  EXPECT_EQ(regionOf(frame).spans[0].far, 40.0);
  frame.camera.far = kInfinity;
  EXPECT_EQ(regionOf(frame).spans[0].far, 40.0);
  frame.camera.shadowDistance = 0.5;  // below near: nothing is left
  EXPECT_EQ(regionOf(frame).spanCount, 0);
}

TEST(Region, PlaneAcrossTheAxisCutsDepth) {
  Frame frame = plainFrame();
  const std::vector<glm::dvec4> planes{{0, 0, 2, 60}};  // z >= -30: view depth <= 30
  frame.scene.planes = planes;
  const Region region = regionOf(frame);
  EXPECT_NEAR(region.spans[0].far, 30.0, 1e-12);
  EXPECT_EQ(region.volume.vertexCount, 8);
  EXPECT_EQ(region.volume.edgeCount, 12);
}

TEST(Region, GroundBelowTheEye) {
  Frame frame = plainFrame();
  const std::vector<glm::dvec4> planes{{0, -1, 0, -10}};  // y <= -10: seen from depth 10 on
  frame.scene.planes = planes;
  EXPECT_NEAR(regionOf(frame).spans[0].near, 10.0, 1e-12);
}

TEST(Region, BoxesAreAUnionWithGaps) {
  Frame frame = plainFrame();
  const std::vector<Box> boxes{{{-1, -1, -60}, {1, 1, -50}},
                               {{-1, -1, -6}, {1, 1, -4}},
                               {{-1, -1, -7}, {1, 1, -5}},
                               {{500, 0, -9}, {501, 1, -8}},
                               {{-1, -1, 3}, {1, 1, 5}}};
  frame.scene.receivers = boxes;  // two that overlap, one far, one beside the view, one behind the eye
  const Region region = regionOf(frame);
  ASSERT_EQ(region.spanCount, 2);
  EXPECT_NEAR(region.spans[0].near, 4.0, 1e-12);
  EXPECT_NEAR(region.spans[0].far, 7.0, 1e-12);
  EXPECT_NEAR(region.spans[1].near, 50.0, 1e-12);
  EXPECT_NEAR(region.spans[1].far, 60.0, 1e-12);
}

// Of several boxes one that is all in view is its eight corners, one beyond a side of the view is nothing.
TEST(Region, BoxesInViewAndOutOfIt) {
  Random random(1107);
  int whole = 0, none = 0, cut = 0;
  for (int k = 0; k < 600; ++k) {
    Frame frame = plainFrame();
    frame.camera =
        perspective(random.direction() * random.logUniform(1.0, 1e6), random.direction(), random.direction(), 1.2, 1.5, 1.0, 100.0);
    const Axes axes(frame.camera);
    const double depth = random.logUniform(1.0, 150.0);
    const glm::dvec3 centre = frame.camera.positionWs + (axes.forward + axes.right * random.uniform(-1.5, 1.5)) * depth,
                     half = depth * glm::dvec3(random.uniform(0.01, 0.3), random.uniform(0.01, 0.3), random.uniform(0.01, 0.3));
    const Box boxes[] = {{centre - half, centre + half}, {frame.camera.positionWs - 1.0, frame.camera.positionWs + 50.0}};
    frame.scene.receivers = boxes;
    glm::dvec3 corners[8];
    int inside = 0, beyond[6] = {};
    for (int i = 0; i < 8; ++i) {
      const glm::dvec3 ws((i & 1 ? boxes[0].maxWs : boxes[0].minWs).x, (i & 2 ? boxes[0].maxWs : boxes[0].minWs).y,
                          (i & 4 ? boxes[0].maxWs : boxes[0].minWs).z),
          fromEye = ws - frame.camera.positionWs;
      const glm::dvec3 p = corners[i] = {glm::dot(fromEye, axes.right), glm::dot(fromEye, axes.up), glm::dot(fromEye, axes.forward)};
      const double room[] = {frame.camera.left * p.z + p.x,
                             frame.camera.right * p.z - p.x,
                             frame.camera.down * p.z + p.y,
                             frame.camera.up * p.z - p.y,
                             p.z - 1.0,
                             100.0 - p.z};
      inside += *std::min_element(room, room + 6) > 1e-6;
      for (int side = 0; side < 6; ++side) beyond[side] += room[side] < -1e-6;
    }
    const Region region = regionOf(frame);
    Cell storage;
    const Cell* cell = getCell(region, 0, storage);
    if (*std::max_element(beyond, beyond + 6) == 8) {
      EXPECT_EQ(cell, nullptr) << k;
      ++none;
    } else if (inside == 8) {
      ASSERT_NE(cell, nullptr) << k;
      EXPECT_EQ(cell->vertexCount, 8) << k;
      for (const glm::dvec3& corner : corners) {
        double least = kInfinity;
        for (int v = 0; v < cell->vertexCount; ++v) least = std::min(least, glm::distance(cell->vertices[v], corner));
        EXPECT_LE(least, 1e-8) << k;
      }
      ++whole;
    } else if (cell) {  // no vertex of what is cut is out of view
      for (int v = 0; v < cell->vertexCount; ++v) {
        const glm::dvec3& p = cell->vertices[v];
        EXPECT_GE(std::min({frame.camera.left * p.z + p.x, frame.camera.right * p.z - p.x, frame.camera.down * p.z + p.y,
                            frame.camera.up * p.z - p.y, p.z - 1.0, 100.0 - p.z}),
                  -1e-8)
            << k;
      }
      ++cut;
    }
  }
  EXPECT_GT(whole, 50);
  EXPECT_GT(none, 50);
  EXPECT_GT(cut, 50);
}

TEST(Region, FlatBoxesAndPoints) {
  Frame frame = plainFrame();
  const std::vector<Box> wall{{{-2, -2, -20}, {2, 2, -20}}}, point{{{0, 0, -5}, {0, 0, -5}}};
  frame.scene.receivers = wall;
  Region region = regionOf(frame);
  ASSERT_EQ(region.spanCount, 1);
  EXPECT_NEAR(region.spans[0].near, 20.0, 1e-12);
  EXPECT_NEAR(region.spans[0].far, 20.0, 1e-12);
  frame.scene.receivers = point;
  region = regionOf(frame);
  ASSERT_EQ(region.spanCount, 1);
  EXPECT_NEAR(region.spans[0].near, 5.0, 1e-12);
}

TEST(Region, MoreGapsThanItHoldsAreJoined) {
  Frame frame = plainFrame();
  std::vector<Box> boxes;
  for (int i = 0; i < 90; ++i) boxes.push_back({{-0.1, -0.1, -(1.55 + i)}, {0.1, 0.1, -(1.5 + i)}});
  frame.scene.receivers = boxes;
  const Region region = regionOf(frame);
  EXPECT_LE(region.spanCount, kMaxSpans);
  EXPECT_GT(region.spanCount, kMaxSpans / 2);
  for (const Box& box : boxes) {
    bool isHeld = false;
    for (int i = 0; i < region.spanCount; ++i)
      isHeld |= region.spans[i].near <= -box.maxWs.z + 1e-12 && region.spans[i].far >= -box.minWs.z - 1e-12;
    EXPECT_TRUE(isHeld) << box.minWs.z;
  }
  for (int i = 1; i < region.spanCount; ++i) EXPECT_GT(region.spans[i].near, region.spans[i - 1].far);
}

// Cut by random planes a hexahedron stays a polytope: Euler's formula, every vertex on three faces' edges at least, all
// vertices inside all planes, and every point of the cut inside the hull of the vertices along random directions.
TEST(Region, CellsStayConvexPolytopes) {
  Random random(5);
  for (int i = 0; i < 3000; ++i) {
    Cell cell;
    boxCell({-1, -1, -1}, {1, 1, 1}, glm::dmat3(1.0), cell);
    bool isEmpty = false;
    int cuts = 0;
    for (int p = 0; p < 8 && !isEmpty; ++p) {
      const Cut cut = cutCell(cell, {random.direction(), random.uniform(-0.3, 1.2)}, 1.0);
      EXPECT_NE(cut, Cut::kept);
      isEmpty = cut == Cut::outside;
      cuts += cut == Cut::cut;
    }
    if (isEmpty || cuts == 0) continue;
    int degree[kMaxCellVertices] = {};
    bool isFace[kMaxCellPlanes] = {};
    for (int e = 0; e < cell.edgeCount; ++e) {
      ++degree[cell.edges[e].from];
      ++degree[cell.edges[e].to];
      isFace[cell.edges[e].left] = isFace[cell.edges[e].right] = true;
    }
    int faces = 0;
    for (int f = 0; f < cell.planeCount; ++f) faces += isFace[f];
    EXPECT_EQ(cell.vertexCount - cell.edgeCount + faces, 2);
    for (int v = 0; v < cell.vertexCount; ++v) {
      EXPECT_GE(degree[v], 3);
      for (int f = 0; f < cell.planeCount; ++f)
        EXPECT_GE(glm::dot(cell.planes[f].normal, cell.vertices[v]) + cell.planes[f].offset, -1e-12);
    }
    for (int s = 0; s < 50; ++s) {  // samples of the true polytope stay below the vertices' support
      const glm::dvec3 point(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)), direction = random.direction();
      bool isInside = true;
      for (int f = 0; f < cell.planeCount; ++f) isInside &= glm::dot(cell.planes[f].normal, point) + cell.planes[f].offset >= 0.0;
      if (!isInside) continue;
      double support = -kInfinity;
      for (int v = 0; v < cell.vertexCount; ++v) support = std::max(support, glm::dot(direction, cell.vertices[v]));
      EXPECT_GE(support, glm::dot(direction, point) - 1e-12);
    }
  }
}

TEST(Region, TooManyPlanesAreIgnoredAndSaid) {
  Frame frame = plainFrame();
  std::vector<glm::dvec4> planes;
  Random random(9);
  for (int i = 0; i < 60; ++i) {
    const glm::dvec3 n = random.direction();
    planes.emplace_back(n, 30.0 - glm::dot(n, glm::dvec3(0, 0, -50)));  // a ball of radius 30 around depth 50
  }
  frame.scene.planes = planes;
  const Region region = regionOf(frame);
  EXPECT_NE(region.warnings & static_cast<std::uint32_t>(Warning::regionSimplified), 0u);
  const auto solution = solve(frame);
  EXPECT_EQ(solution->status, Status::ok);
  const Coverage coverage = checkAll(frame, *solution);
  EXPECT_GT(coverage.points, 50);
  EXPECT_EQ(coverage.uncovered, 0);
}

}  // namespace
}  // namespace gnomon::test
