#include "gnomon/region.h"

#include "gnomon/camera.h"
#include "numeric.h"

namespace gnomon {
namespace {

constexpr double kVertexRounding = 16.0 * std::numeric_limits<double>::epsilon();

// A hexahedron from its eight corners: bit 0 of the index is +x, bit 1 +y, bit 2 +z. Planes: -x, +x, -y, +y, -z, +z.
void hexahedron(Cell& cell) noexcept {
  static constexpr Cell::Edge kEdges[12] = {{0, 1, 2, 4}, {2, 3, 3, 4}, {4, 5, 2, 5}, {6, 7, 3, 5}, {0, 2, 0, 4}, {1, 3, 1, 4},
                                            {4, 6, 0, 5}, {5, 7, 1, 5}, {0, 4, 0, 2}, {1, 5, 1, 2}, {2, 6, 0, 3}, {3, 7, 1, 3}};
  cell.vertexCount = 8;
  cell.edgeCount = 12;
  cell.planeCount = 6;
  cell.isExact = true;
  cell.reach = 0.0;
  std::copy(std::begin(kEdges), std::end(kEdges), cell.edges);
}

void viewVolume(const Camera& camera, double near, double far, Cell& cell) noexcept {
  hexahedron(cell);
  const bool isPerspective = camera.projection == Projection::perspective;
  for (int i = 0; i < 8; ++i) {
    const double z = (i & 4) ? far : near, k = isPerspective ? z : 1.0;
    cell.vertices[i] = glm::dvec3(((i & 1) ? camera.right : -camera.left) * k, ((i & 2) ? camera.up : -camera.down) * k, z);
  }
  const double slope = isPerspective ? 1.0 : 0.0, flat = isPerspective ? 0.0 : 1.0;
  cell.planes[0] = {{1.0, 0.0, camera.left * slope}, camera.left * flat};
  cell.planes[1] = {{-1.0, 0.0, camera.right * slope}, camera.right * flat};
  cell.planes[2] = {{0.0, 1.0, camera.down * slope}, camera.down * flat};
  cell.planes[3] = {{0.0, -1.0, camera.up * slope}, camera.up * flat};
  cell.planes[4] = {{0.0, 0.0, 1.0}, -near};
  cell.planes[5] = {{0.0, 0.0, -1.0}, far};
}

// The volume of eight corners, in view space. False where they do not bound one. unevenness: how far its faces are from flat.
bool cornerVolume(const glm::dvec3* corners, Cell& cell, double& unevenness) noexcept {
  constexpr double kFlat = 1e-4;  // of the volume's size: what float32 matrices leave of a far corner
  hexahedron(cell);
  std::copy_n(corners, 8, cell.vertices);
  glm::dvec3 centre(0.0);
  for (int i = 0; i < 8; ++i) centre += corners[i] / 8.0;
  double size = 0.0;
  for (int i = 0; i < 8; ++i) size = std::max(size, std::sqrt(glm::dot(corners[i] - centre, corners[i] - centre)));
  unevenness = 0.0;
  for (int face = 0; face < 6; ++face) {
    const int axis = 1 << face / 2, u = axis == 1 ? 2 : 1, v = axis == 4 ? 2 : 4, first = face % 2 ? axis : 0;
    const glm::dvec3 *a = &corners[first], *b = &corners[first + u], *c = &corners[first + u + v], *d = &corners[first + v];
    glm::dvec3 normal = unit(glm::cross(*c - *a, *d - *b));  // of the quadrilateral a b c d: its diagonals' product
    const glm::dvec3 middle = (*a + *b + *c + *d) / 4.0;
    double depth = glm::dot(normal, centre - middle);
    if (depth < 0.0) {
      normal = -normal;
      depth = -depth;
    }
    if (!(depth > kFlat * size)) return false;  // no inside
    double least = 0.0;
    for (int i = 0; i < 8; ++i) {
      const double distance = glm::dot(normal, corners[i] - middle);
      const bool isOnFace = ((i & axis) != 0) == (face % 2 == 1);
      if (!(distance >= -kFlat * size) || (isOnFace && !(distance <= kFlat * size))) return false;
      if (isOnFace) unevenness = std::max(unevenness, std::abs(distance));
      least = std::min(least, distance);
    }
    cell.planes[face] = {normal, -glm::dot(normal, middle) - least};
  }
  return true;
}

// Moves a camera's sides out to hold a volume ahead of it.
void widen(const Cell& volume, Camera& camera) noexcept {
  for (int i = 0; i < volume.vertexCount; ++i) {
    const glm::dvec3& v = volume.vertices[i];
    const double k = camera.projection == Projection::perspective ? v.z : 1.0;
    camera.left = std::max(camera.left, -v.x / k);
    camera.right = std::max(camera.right, v.x / k);
    camera.down = std::max(camera.down, -v.y / k);
    camera.up = std::max(camera.up, v.y / k);
  }
}

DepthSpan depthsOf(const Cell& cell) noexcept {
  DepthSpan span{kInfinity, -kInfinity};
  for (int i = 0; i < cell.vertexCount; ++i) {
    span.near = std::min(span.near, cell.vertices[i].z);
    span.far = std::max(span.far, cell.vertices[i].z);
  }
  return span;
}

// How much two spans are apart, as the split would see it: a ratio's logarithm would do the same, so compare ratios.
double gap(const Region& region, const DepthSpan& before, const DepthSpan& after) noexcept {
  return region.camera.projection == Projection::perspective ? after.near / before.far : after.near - before.far;
}

void addSpan(Region& region, double near, double far) noexcept {
  DepthSpan* spans = region.spans;
  int count = region.spanCount, first = 0;
  while (first < count && spans[first].far < near) ++first;
  int last = first;  // [first, last) touch the added one
  for (; last < count && spans[last].near <= far; ++last) {
    near = std::min(near, spans[last].near);
    far = std::max(far, spans[last].far);
  }
  if (last == first && count == kMaxSpans) {  // no room: join across the narrowest gap, the added span's own gaps included
    int narrowest = -1;
    double least = kInfinity;
    for (int i = 0; i + 1 < count; ++i)
      if (const double g = gap(region, spans[i], spans[i + 1]); i + 1 != first && g < least) least = g, narrowest = i;
    if (first > 0 && gap(region, spans[first - 1], {near, far}) <= least) {
      spans[first - 1].far = far;
      return;
    }
    if (first < count && gap(region, {near, far}, spans[first]) <= least) {
      spans[first].near = near;
      return;
    }
    spans[narrowest].far = spans[narrowest + 1].far;
    std::copy(spans + narrowest + 2, spans + count, spans + narrowest + 1);
    --count;
    if (first > narrowest) --first;
    last = first;
  }
  if (last == first)
    std::copy_backward(spans + first, spans + count, spans + count + 1);
  else
    std::copy(spans + last, spans + count, spans + first + 1);
  spans[first] = {near, far};
  region.spanCount = count - (last - first) + 1;
}

// Errors: samples*.
Status validateSamples(const Samples& samples, int& index, double& value) noexcept {
  const bool hasBins = !samples.histogram.empty();
  value = samples.near;
  const bool isNothing = samples.near == kInfinity && samples.far == -kInfinity;
  if (!isNothing && (!std::isfinite(samples.near) || (hasBins && !(samples.near > 0.0)))) return Status::samplesNear;
  if (value = samples.far; !isNothing && !(std::isfinite(samples.far) && samples.far >= samples.near)) return Status::samplesFar;
  if (value = samples.latency; !(samples.latency >= 0.0 && std::isfinite(samples.latency))) return Status::samplesLatency;
  value = static_cast<double>(samples.weights.size());
  if (!samples.weights.empty() && samples.weights.size() != samples.histogram.size()) return Status::samplesWeights;
  for (std::size_t i = 0; i < samples.weights.size(); ++i) {
    index = static_cast<int>(i);
    value = samples.weights[i];
    if (!(samples.weights[i] >= 0.0 && std::isfinite(samples.weights[i]))) return Status::samplesWeights;
  }
  if (value = firstBad(samples.rightWs, 0.0); !isFinite(samples.rightWs)) return Status::samplesBounds;
  for (std::size_t i = 0; i < samples.bounds.size(); ++i) {
    index = static_cast<int>(i);
    const SampleBounds& bounds = samples.bounds[i];
    for (const glm::dvec2& pair :
         {glm::dvec2(bounds.near, bounds.far), glm::dvec2(bounds.least.x, bounds.most.x), glm::dvec2(bounds.least.y, bounds.most.y)}) {
      value = std::isfinite(pair.x) ? pair.y : pair.x;
      if (!(pair.x <= pair.y && std::isfinite(pair.x) && std::isfinite(pair.y))) return Status::samplesBounds;
    }
  }
  index = -1;
  value = 0.0;
  return Status::ok;
}

// Keeps of the region's spans what was sampled.
void keepSampled(const Samples& samples, Region& region) noexcept {
  DepthSpan spans[kMaxSpans];
  const int count = region.spanCount;
  std::copy_n(region.spans, count, spans);
  region.spanCount = 0;
  const auto keep = [&](double near, double far) {
    // A single depth is an interval as wide as what the depth buffer cannot tell from it.
    const double room = samples.latency + (near == far ? depthQuantum(region.camera, near) : 0.0);
    for (int i = 0; i < count; ++i) {
      const DepthSpan span{std::max(near - room, spans[i].near), std::min(far + room, spans[i].far)};
      if (span.near <= span.far) addSpan(region, span.near, span.far);
    }
  };
  const int bins = static_cast<int>(samples.histogram.size());
  if (bins == 0) keep(samples.near, samples.far);
  for (int i = 0; i < bins; ++i) {
    const int first = i;
    while (i < bins && samples.histogram[static_cast<std::size_t>(i)] > 0) ++i;
    if (i == first) continue;
    // Who counts compares depth values: beside an empty bin a sample may lie across the border by what they cannot tell.
    const double near = binEdge(samples, first), far = binEdge(samples, i);
    keep(first > 0 ? std::max(near - depthQuantum(region.camera, near), samples.near) : near,
         i < bins ? std::min(far + depthQuantum(region.camera, far), samples.far) : far);
  }
}

// False where nothing is left.
bool cutToBox(Cell& cell, const Box& box, const Region& region) noexcept {
  const glm::dmat3 viewFromWorld = glm::transpose(region.worldFromView);
  for (int axis = 0; axis < 3; ++axis) {
    const double eye = region.eyeWs[axis], least = box.minWs[axis], greatest = box.maxWs[axis];
    if (cutCell(cell, {viewFromWorld[axis], eye - least}, std::abs(least) + std::abs(eye)) == Cut::outside) return false;
    if (cutCell(cell, {-viewFromWorld[axis], greatest - eye}, std::abs(greatest) + std::abs(eye)) == Cut::outside) return false;
  }
  return true;
}

enum class Where : std::uint8_t { outside, across, inside };

// Where a box lies to the volume, as its planes tell at a tenth of the price of cutting: surely beyond one, surely within all, or
// neither. centre, half: of the box, in view space from the eye and along the world's axes.
Where whereIs(const Box& box, const glm::dvec3& centre, const glm::dvec3& half, const Region& region) noexcept {
  const glm::dmat3 viewFromWorld = glm::transpose(region.worldFromView);
  const glm::dvec3 positions = glm::abs(box.minWs) + glm::abs(box.maxWs) + 2.0 * glm::abs(region.eyeWs);
  const double magnitude = positions.x + positions.y + positions.z;
  Where where = Where::inside;
  for (int i = 0; i < region.volume.planeCount; ++i) {
    const Plane& plane = region.volume.planes[i];
    const glm::dvec3 normal = glm::abs(plane.normal), along = glm::abs(plane.normal * viewFromWorld);
    const double distance = glm::dot(plane.normal, centre) + plane.offset, reach = glm::dot(along, half),
                 rounding = kVertexRounding * (std::abs(plane.offset) + (normal.x + normal.y + normal.z) * magnitude);
    if (distance + reach < -rounding) return Where::outside;
    if (!(distance - reach > rounding)) where = Where::across;
  }
  return where;
}

// What of the volume lies in the i-th of several receivers; no vertices: nothing.
void makePart(const Region& region, int i, Cell& part) noexcept {
  const Box& box = region.receivers[static_cast<std::size_t>(i)];
  const glm::dvec3 least = box.minWs - region.eyeWs, greatest = box.maxWs - region.eyeWs, half = greatest * 0.5 - least * 0.5,
                   centre = (least + half) * region.worldFromView;
  const Where where = whereIs(box, centre, half, region);
  constexpr double kThin = 1e-6;  // of its length: what is thinner is cut, which knows what is flat
  const bool isThick = std::min({half.x, half.y, half.z}) > kThin * std::max({half.x, half.y, half.z});
  part.vertexCount = 0;
  if (where == Where::outside) return;
  if (where == Where::inside && isThick) {
    boxCell(least, greatest, glm::transpose(region.worldFromView), part);
    return;
  }
  copyCell(region.volume, part);
  if (!cutToBox(part, box, region)) part.vertexCount = 0;
}

// True where a float32 matrix can hold every length, from the narrowest pixel to the farthest corner: no square of one leaves double's
// range.
bool fitsFloat(const Region& region, double& value) noexcept {
  const Camera& camera = region.camera;
  const double depth = std::max(std::abs(region.near), std::abs(region.far)),
               k = camera.projection == Projection::perspective ? depth : 1.0;
  const double widest = std::max({std::abs(camera.left), std::abs(camera.right), std::abs(camera.down), std::abs(camera.up)});
  using Float = std::numeric_limits<float>;
  value = std::max(depth, widest * k);
  if (!(value <= static_cast<double>(Float::max()))) return false;
  value = region.pixelBase + region.pixelSlope * region.near;
  return value >= static_cast<double>(Float::min()) && value <= static_cast<double>(Float::max());
}

// What a scene and its samples are refused for.
Status validateScene(const Frame& frame, int& index, double& value) noexcept {
  index = badBox(frame.scene.receivers, value);
  if (index >= 0) return Status::receiverBox;
  index = badBox(frame.scene.casters, value);
  if (index >= 0) return Status::casterBox;
  for (std::size_t i = 0; i < frame.scene.planes.size(); ++i) {
    const glm::dvec4& p = frame.scene.planes[i];
    const glm::dvec3 normal(p);
    index = static_cast<int>(i);
    value = firstBad(normal, p.w);
    if (!isFinite(normal) || !std::isfinite(p.w) || !(glm::dot(unit(normal), unit(normal)) > 0.0)) return Status::halfSpace;
  }
  index = -1;
  value = 0.0;
  return frame.samples ? validateSamples(*frame.samples, index, value) : Status::ok;
}

// Makes the volume of the frame's corners. False where they are none of a convex volume.
bool readCorners(std::span<const glm::dvec3> cornersWs, Region& region, double& value) noexcept {
  glm::dvec3 corners[8];
  value = static_cast<double>(cornersWs.size());
  if (cornersWs.size() != 8) return false;
  for (std::size_t i = 0; i < 8; ++i) {
    value = firstBad(cornersWs[i], 0.0);
    if (!isFinite(cornersWs[i])) return false;
    corners[i] = (cornersWs[i] - region.eyeWs) * region.worldFromView;
  }
  return cornerVolume(corners, region.volume, region.unevenness);
}

// Cuts the volume of corners to the camera's depths, and the depths to it. False where nothing is left.
bool cutToDepths(Region& region) noexcept {
  for (const Plane& plane : {Plane{{0.0, 0.0, 1.0}, -region.near}, Plane{{0.0, 0.0, -1.0}, region.far}})
    if (cutCell(region.volume, plane, std::abs(plane.offset)) == Cut::outside) return false;
  const DepthSpan depths = depthsOf(region.volume);
  region.near = std::max(region.near, depths.near);
  region.far = std::min(region.far, depths.far);
  widen(region.volume, region.camera);
  region.reach = 0.0;
  for (int i = 0; i < region.volume.vertexCount; ++i)
    region.reach = std::max(region.reach, std::sqrt(glm::dot(region.volume.vertices[i], region.volume.vertices[i])));
  return true;
}

// Cuts the volume to the depths that are sampled and to the half-spaces. False where nothing is left.
bool cutToScene(const Frame& frame, Region& region) noexcept {
  if (frame.samples) {  // with room for what a depth value cannot tell apart; the spans are exact
    const double near = frame.samples->near - region.latency, far = frame.samples->far + region.latency;
    const auto room = [&](double z) { return std::max(depthQuantum(region.camera, z), viewQuantum(region.camera, z)); };
    if (!(near <= far) || cutCell(region.volume, {{0.0, 0.0, 1.0}, -(near - room(near))}, std::abs(near)) == Cut::outside ||
        cutCell(region.volume, {{0.0, 0.0, -1.0}, far + room(far)}, std::abs(far)) == Cut::outside)
      return false;
  }
  for (const glm::dvec4& p : frame.scene.planes) {
    const glm::dvec3 normal(p);
    const double atEye = glm::dot(normal, region.eyeWs);
    const Plane plane{normal * region.worldFromView, atEye + p.w};
    const double magnitude = glm::dot(glm::abs(normal), glm::abs(region.eyeWs)) + std::abs(p.w);
    const Cut cut = cutCell(region.volume, plane, magnitude);
    if (cut == Cut::kept) region.warnings |= static_cast<std::uint32_t>(Warning::regionSimplified);
    if (cut == Cut::outside) return false;
  }
  return true;
}

}  // namespace

double depthBetween(double near, double far, int i, int count, bool isRatio) noexcept {
  if (i <= 0 || i >= count) return i <= 0 ? near : far;
  const double share = static_cast<double>(i) / count;
  return isRatio ? near * std::pow(far / near, share) : near + (far - near) * share;
}

double binEdge(const Samples& samples, int i) noexcept {
  return depthBetween(samples.near, samples.far, i, static_cast<int>(samples.histogram.size()), true);
}

void copyCell(const Cell& from, Cell& to) noexcept {
  to.vertexCount = from.vertexCount;
  to.edgeCount = from.edgeCount;
  to.planeCount = from.planeCount;
  to.isExact = from.isExact;
  to.reach = from.reach;
  std::copy_n(from.vertices, from.vertexCount, to.vertices);
  std::copy_n(from.edges, from.edgeCount, to.edges);
  std::copy_n(from.planes, from.planeCount, to.planes);
}

Cut cutCell(Cell& cell, const Plane& plane, double magnitude) noexcept {
  double distance[kMaxCellVertices];
  const double slope = std::abs(plane.normal.x) + std::abs(plane.normal.y) + std::abs(plane.normal.z);
  bool isInside[kMaxCellVertices];
  for (int i = 0; i < cell.vertexCount; ++i)
    for (int axis = 0; axis < 3; ++axis) cell.reach = std::max(cell.reach, std::abs(cell.vertices[i][axis]));
  const double tolerance = kVertexRounding * (magnitude + slope * cell.reach);
  int kept = 0;
  for (int i = 0; i < cell.vertexCount; ++i) {
    distance[i] = glm::dot(plane.normal, cell.vertices[i]) + plane.offset;
    isInside[i] = !(distance[i] < -tolerance);
    kept += isInside[i];
  }
  if (kept == cell.vertexCount) return Cut::inside;
  if (kept == 0) return Cut::outside;
  if (*std::max_element(distance, distance + cell.vertexCount) <= tolerance) {
    // It only touches the cell. Of what is hardly larger than rounding, faces of any direction seem to lie on one plane.
    constexpr double kLarge = 1e6;
    double size = 0.0;
    for (int i = 0, first = -1; i < cell.vertexCount; ++i) {
      if (!isInside[i]) continue;
      if (first < 0) first = i;
      const glm::dvec3 apart = glm::abs(cell.vertices[i] - cell.vertices[first]);
      size = std::max({size, apart.x, apart.y, apart.z});
    }
    if (size < kLarge * tolerance) cell.isExact = false;
  }

  int crossings = 0, keptEdges = 0;
  for (int i = 0; i < cell.edgeCount; ++i) {
    const int inside = isInside[cell.edges[i].from] + isInside[cell.edges[i].to];
    crossings += inside == 1;
    keptEdges += inside > 0;
  }
  const auto keep = [&] {
    cell.isExact = false;
    return Cut::kept;
  };
  // A convex face is crossed twice or not at all; each crossed face adds one edge, so there are as many as crossings.
  if (kept + crossings > kMaxCellVertices || keptEdges + crossings > kMaxCellEdges || cell.planeCount == kMaxCellPlanes) return keep();
  std::uint8_t onFace[kMaxCellPlanes][2];
  std::uint8_t faceCrossings[kMaxCellPlanes] = {};
  for (int i = 0, v = kept; i < cell.edgeCount; ++i) {
    const Cell::Edge& edge = cell.edges[i];
    if (isInside[edge.from] == isInside[edge.to]) continue;
    for (const int face : {edge.left, edge.right}) {
      if (faceCrossings[face] == 2) return keep();  // rounding bent a face across the plane
      onFace[face][faceCrossings[face]++] = static_cast<std::uint8_t>(v);
    }
    ++v;
  }
  for (int face = 0; face < cell.planeCount; ++face)
    if (faceCrossings[face] == 1) return keep();

  std::uint8_t moved[kMaxCellVertices];
  glm::dvec3 fresh[kMaxCellVertices];
  int keptSoFar = 0;
  for (int i = 0; i < cell.vertexCount; ++i)
    if (isInside[i]) moved[i] = static_cast<std::uint8_t>(keptSoFar++);
  int edges = 0, added = 0;
  const auto newFace = static_cast<std::uint8_t>(cell.planeCount);
  for (int i = 0; i < cell.edgeCount; ++i) {
    Cell::Edge edge = cell.edges[i];
    const bool fromInside = isInside[edge.from], toInside = isInside[edge.to];
    if (!fromInside && !toInside) continue;
    if (fromInside != toInside) {
      const int in = fromInside ? edge.from : edge.to, out = fromInside ? edge.to : edge.from;
      const double inDistance = std::max(distance[in], 0.0);
      const double t = inDistance / (inDistance - distance[out]);
      const glm::dvec3 &p = cell.vertices[in], &q = cell.vertices[out];
      // Towards the end the point is nearer to, so that rounding scales with the shorter part.
      fresh[added] = t <= 0.5 ? p + (q - p) * t : q + (p - q) * (distance[out] / (distance[out] - inDistance));
      const auto vertex = static_cast<std::uint8_t>(kept + added++);
      edge.from = moved[in];
      edge.to = vertex;
    } else {
      edge.from = moved[edge.from];
      edge.to = moved[edge.to];
    }
    cell.edges[edges++] = edge;
  }
  for (int i = 0; i < cell.vertexCount; ++i)
    if (isInside[i]) cell.vertices[moved[i]] = cell.vertices[i];
  std::copy_n(fresh, added, cell.vertices + kept);
  for (int face = 0; face < cell.planeCount; ++face)
    if (faceCrossings[face] == 2) cell.edges[edges++] = {onFace[face][0], onFace[face][1], static_cast<std::uint8_t>(face), newFace};
  cell.planes[cell.planeCount++] = plane;
  cell.vertexCount = kept + added;
  cell.edgeCount = edges;
  return Cut::cut;
}

void boxCell(const glm::dvec3& least, const glm::dvec3& greatest, const glm::dmat3& axes, Cell& cell) noexcept {
  hexahedron(cell);
  for (int i = 0; i < 8; ++i)
    cell.vertices[i] = axes * glm::dvec3((i & 1) ? greatest.x : least.x, (i & 2) ? greatest.y : least.y, (i & 4) ? greatest.z : least.z);
  for (int axis = 0; axis < 3; ++axis) {
    Plane* pair = cell.planes + axis + axis;
    pair[0] = {axes[axis], -least[axis]};
    pair[1] = {-axes[axis], greatest[axis]};
  }
}

int badBox(std::span<const Box> boxes, double& value) noexcept {
  for (std::size_t i = 0; i < boxes.size(); ++i)
    for (int axis = 0; axis < 3; ++axis) {
      const double least = boxes[i].minWs[axis], greatest = boxes[i].maxWs[axis];
      if (std::isfinite(least) && std::isfinite(greatest) && least <= greatest) continue;
      value = std::isfinite(least) ? greatest : least;
      return static_cast<int>(i);
    }
  return -1;
}

Status makeRegion(const Frame& frame, Region& region, int& index, double& value) noexcept {
  const Camera& camera = frame.camera;
  region.camera = camera;
  region.pixelBase = pixelWidth(camera, frame.image, 0.0);
  region.pixelSlope = pixelWidth(camera, frame.image, 1.0) - region.pixelBase;
  region.receivers = {};
  region.eyeWs = camera.positionWs;
  region.near = camera.near;
  region.far = shadowFar(camera);
  region.spanCount = 0;
  region.warnings = 0;
  region.bounds = {};
  region.latency = 0.0;
  region.reach = kInfinity;
  region.unevenness = 0.0;
  region.volume.vertexCount = 0;
  region.worldFromView = viewAxes(camera.forwardWs, camera.upWs);

  if (const Status status = validateScene(frame, index, value); status != Status::ok) return status;
  if (frame.samples) {
    const glm::dvec3& right = frame.samples->rightWs;
    region.bounds = frame.samples->bounds;
    region.boundsRightWs = right == glm::dvec3(0.0) ? region.worldFromView[0] : right;
    region.latency = frame.samples->latency;
  }
  const bool hasCorners = !frame.cornersWs.empty();
  if (hasCorners && !readCorners(frame.cornersWs, region, value)) {
    region.volume.vertexCount = 0;
    return Status::corners;
  }
  const bool hasDepth = region.far > region.near;
  if (hasDepth && !fitsFloat(region, value)) return Status::floatRange;
  value = 0.0;
  if (hasDepth && !hasCorners) viewVolume(camera, region.near, region.far, region.volume);
  if (!hasDepth || (hasCorners && !cutToDepths(region)) || !cutToScene(frame, region)) {
    region.volume.vertexCount = 0;
    return Status::ok;
  }
  if (frame.scene.receivers.size() == 1) {
    if (!cutToBox(region.volume, frame.scene.receivers[0], region)) region.volume.vertexCount = 0;
  } else {
    region.receivers = frame.scene.receivers;
  }
  const int kept = std::min(static_cast<int>(region.receivers.size()), kMaxKeptCells);
  for (int i = 0; i < kept; ++i) makePart(region, i, region.parts[i]);
  Cell storage;
  for (int i = 0; i < cellCount(region); ++i) {
    const Cell* cell = getCell(region, i, storage);
    if (!cell) continue;
    const DepthSpan span = depthsOf(*cell);
    addSpan(region, std::clamp(span.near, region.near, region.far), std::clamp(span.far, region.near, region.far));
  }
  if (frame.samples) keepSampled(*frame.samples, region);
  return Status::ok;
}

int cellCount(const Region& region) noexcept { return region.receivers.empty() ? 1 : static_cast<int>(region.receivers.size()); }

const Cell* getCell(const Region& region, int i, Cell& storage) noexcept {
  if (region.volume.vertexCount == 0) return nullptr;
  if (region.receivers.empty()) return &region.volume;
  if (i >= kMaxKeptCells) makePart(region, i, storage);
  const Cell& part = i < kMaxKeptCells ? region.parts[i] : storage;
  return part.vertexCount > 0 ? &part : nullptr;
}

}  // namespace gnomon
