#include "gnomon/face.h"

#include "numeric.h"

namespace gnomon {
namespace {

constexpr int kFaces = 4;

// A side of the view volume that light rays meet where they are narrowest.
struct Side {
  Plane left{glm::dvec3(0.0), 0.0}, right{glm::dvec3(0.0), 0.0};  // between it and its neighbours; none where a neighbour is not used
  glm::dvec3 axis;  // axis . p is the view depth where the light ray through p meets the side's plane
  double near = kInfinity, far = -kInfinity;  // those depths over the region's part
  double weight;  // how much of the limit it is
};

bool cut(Cell& cell, const Plane& plane) noexcept {
  return plane.normal == glm::dvec3(0.0) || cutCell(cell, plane, std::abs(plane.offset)) != Cut::outside;
}

// The depths that the region's part of a side spans.
void measure(const Region& region, Side& side) noexcept {
  Cell storage;
  for (int i = 0; i < cellCount(region); ++i) {
    const Cell* cell = getCell(region, i, storage);
    if (!cell) continue;
    Cell part;
    copyCell(*cell, part);
    if (!cut(part, side.left) || !cut(part, side.right)) continue;
    for (int v = 0; v < part.vertexCount; ++v) {
      const double depth = glm::dot(side.axis, part.vertices[v]);
      side.near = std::min(side.near, depth);
      side.far = std::max(side.far, depth);
    }
  }
}

// The sides in use. Returns their number; opposite ones are bottom and top, right and left.
int findSides(const Region& region, const glm::dvec3& light, bool hasNear, Side* sides, int* places) noexcept {
  const Camera& camera = region.camera;
  const glm::dvec3 edges[kFaces] = {
      {-camera.left, -camera.down, 1.0}, {camera.right, -camera.down, 1.0}, {camera.right, camera.up, 1.0}, {-camera.left, camera.up, 1.0}};
  const double sign = light.z >= 0.0 ? 1.0 : -1.0;
  bool isUsed[kFaces];
  double facing[kFaces];
  for (int i = 0; i < kFaces; ++i) {
    const glm::dvec3 normal = glm::cross(edges[i], edges[(i + 1) % kFaces]);  // inward
    constexpr double kEdgeOn = 1e-9;  // cosine below which the light sees a side as a line: its neighbours hold it
    facing[i] = sign * glm::dot(unit(normal), light);
    isUsed[i] = facing[i] > kEdgeOn;  // [Lloyd 2006, sec. 5.1, signs corrected]
  }
  int count = 0;
  for (int i = 0; i < kFaces; ++i) {
    if (!isUsed[i]) continue;
    const int next = (i + 1) % kFaces, before = (i + kFaces - 1) % kFaces;
    const glm::dvec3 &a = edges[i], &b = edges[next];
    Side& side = sides[count];
    side = {};
    const auto between = [&](const glm::dvec3& edge, const glm::dvec3& inside) -> Plane {
      const glm::dvec3 normal = unit(glm::cross(light, edge));
      return {glm::dot(normal, inside) < 0.0 ? -normal : normal, 0.0};
    };
    if (isUsed[before]) side.left = between(a, b);
    if (isUsed[next]) side.right = between(b, a);
    const glm::dvec3 along = glm::cross(light, b - a);
    side.axis = along / glm::dot(along, a);
    side.weight = facing[i];
    measure(region, side);
    // What rays through the near plane reach is its own wedge's, or else this side's.
    if (side.far < (hasNear ? region.near : side.near)) continue;
    side.near = std::max(side.near, region.near);
    side.far = std::max(side.far, side.near);
    places[count++] = i;
  }
  return count;
}

// The part of the light plane that rays through the near plane fill: before every side's rows.
Wedge nearWedge(const Region& region, const Side* sides, const int* places, int count) noexcept {
  const Plane none{glm::dvec3(0.0), 0.0};
  Wedge wedge{none, none, {sides[0].axis, 0.0}, -kInfinity, region.near};
  Plane* const free[2] = {&wedge.left, &wedge.right};
  int bounds = 0;
  for (int i = 1; i < count; ++i) {
    if (places[i] == places[0] + 2) {  // opposite: the same axis, turned round
      const double turn = glm::dot(sides[i].axis, sides[0].axis) / glm::dot(sides[0].axis, sides[0].axis);
      wedge.start = region.near / turn;
    } else if (bounds < 2) {
      *free[bounds++] = {-sides[i].axis, region.near};
    }
  }
  return wedge;
}

}  // namespace

void splitFaces(const Region& region, const LightSpace& light, NearFace nearFace, int most, bool inRows, Splits& splits) noexcept {
  splits.count = 0;
  splits.isWedged = true;
  if (region.camera.projection != Projection::perspective || region.spanCount == 0) return;
  Side sides[kFaces];
  int places[kFaces];
  const int near = nearFace == NearFace::own && light.directionVs.z != 0.0 ? 1 : 0;
  const int count = findSides(region, light.directionVs, near == 1, sides, places);
  if (count == 0 || count + near > most) return;
  const DepthSpan all{region.spans[0].near, region.spans[region.spanCount - 1].far};
  const auto add = [&](const Wedge& wedge) {
    splits.slices[splits.count] = all;
    splits.wedges[splits.count++] = wedge;
  };
  if (near == 1) add(nearWedge(region, sides, places, count));
  int rows[kFaces] = {};
  for (int i = 0; i < count; ++i) rows[i] = inRows ? (most - near) / count : 1;
  for (int spare = inRows ? (most - near) % count : 0; spare > 0; --spare) {  // what is left goes to the sides that need most
    int neediest = 0;
    const auto need = [&](int i) { return sides[i].weight / rows[i]; };
    for (int i = 1; i < count; ++i)
      if (need(i) > need(neediest)) neediest = i;
    ++rows[neediest];
  }
  for (int i = 0; i < count; ++i) {
    const Side& side = sides[i];
    double from = near == 1 ? region.near : -kInfinity;
    for (int row = 1; row <= rows[i]; ++row) {
      const double to = row < rows[i] ? side.near * std::pow(side.far / side.near, static_cast<double>(row) / rows[i])
                                      : kInfinity;  // [Lloyd 2006, eq. 15, 16]
      if (to > from) add({side.left, side.right, {side.axis, 0.0}, from, to});
      from = std::max(from, to);
    }
  }
}

}  // namespace gnomon
