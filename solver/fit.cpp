#include "gnomon/fit.h"

#include <bit>

#include "gnomon/camera.h"
#include "numeric.h"

namespace gnomon {
namespace {

double cross2(const glm::dvec2& a, const glm::dvec2& b) noexcept { return a.x * b.y - a.y * b.x; }

// Which points are the hull's vertices, counter-clockwise, and behind them those inside. Slices of one cell give alike sets of
// points, so the hull of the last one is a good first guess for the next.
struct Ring {
  int pointCount = 0, count = 0;
  std::uint8_t index[2 * kMaxHull];
};

// True where the ring is the convex hull of these points too: it turns left everywhere, goes round once and holds the others.
bool isHull(const glm::dvec2* points, int count, const Ring& ring) noexcept {
  if (ring.pointCount != count || ring.count < 3) return false;
  glm::dvec2 from = points[ring.index[ring.count - 1]], last = from - points[ring.index[ring.count - 2]];
  int turns = 0;
  for (int i = 0; i < ring.count; ++i) {
    const glm::dvec2 to = points[ring.index[i]], edge = to - from;
    if (!(cross2(last, edge) > 0.0)) return false;
    turns += (last.x < 0.0) != (edge.x < 0.0);
    for (int j = ring.count; j < count; ++j)
      if (!(cross2(edge, points[ring.index[j]] - from) >= 0.0)) return false;
    from = to;
    last = edge;
  }
  return turns == 2;
}

// Convex hull.  (Andrew's monotone chain)
void makeHull(const glm::dvec2* points, int count, Ring& ring) noexcept {
  if (isHull(points, count, ring)) return;
  std::uint8_t order[kMaxHull];
  for (int i = 0; i < count; ++i) {
    const glm::dvec2& p = points[i];
    int j = i;
    for (; j > 0; --j) {
      const glm::dvec2& before = points[order[j - 1]];
      if (before.x < p.x || (before.x == p.x && before.y <= p.y)) break;
      order[j] = order[j - 1];
    }
    order[j] = static_cast<std::uint8_t>(i);
  }
  int size = 0;
  const auto extend = [&](std::uint8_t index, int least) {
    const glm::dvec2& p = points[index];
    for (; size >= least; --size) {
      const glm::dvec2 &a = points[ring.index[size - 2]], &b = points[ring.index[size - 1]];
      if ((b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x) > 0.0) break;
    }
    ring.index[size++] = index;
  };
  for (int i = 0; i < count; ++i) extend(order[i], 2);
  const int lower = size;
  for (int i = count - 2; i >= 0; --i) extend(order[i], lower + 1);
  if (size > 1) --size;  // the first point again
  if (size == 2 && points[ring.index[0]] == points[ring.index[1]]) size = 1;
  ring.pointCount = count;
  ring.count = size;
  std::uint64_t isVertex = 0;
  for (int i = 0; i < size; ++i) isVertex |= std::uint64_t{1} << ring.index[i];
  for (int i = 0; i < count; ++i)
    if (!(isVertex >> i & 1)) ring.index[size++] = static_cast<std::uint8_t>(i);
}
static_assert(kMaxHull <= 64);

// Replaces a hull of many vertices by a polygon of kSides sides around it.
int simplifyHull(glm::dvec2* points, int count) noexcept {
  constexpr int kSides = 32;
  static_assert(2 * kSides <= kMaxHull);
  constexpr double kTurn = 6.283185307179586 / kSides;
  double support[kSides];
  glm::dvec2 normal[kSides];
  for (int k = 0; k < kSides; ++k) {
    normal[k] = {std::cos(kTurn * k), std::sin(kTurn * k)};
    support[k] = -kInfinity;
    for (int i = 0; i < count; ++i) support[k] = std::max(support[k], glm::dot(normal[k], points[i]));
  }
  for (int k = 0; k < kSides; ++k) {
    const int next = (k + 1) % kSides;
    points[k] =
        glm::dvec2(support[k] * normal[next].y - support[next] * normal[k].y, support[next] * normal[k].x - support[k] * normal[next].x) /
        cross2(normal[k], normal[next]);
  }
  return kSides;
}

// A cell's vertex seen from the light: homogeneous, so that points between two of them may be interpolated before the division.
struct Seen {
  double x, y, depth, w, z;  // z: view depth
};

// An edge that is not parallel to the image, from its nearer vertex to its farther one.
struct Rising {
  std::uint8_t from, to;
  Seen slope;  // per unit of view depth
};

// A cell seen from the light.
struct SeenCell {
  int vertexCount = 0, risingCount = 0;
  std::uint64_t risingVertices = 0;  // bits: vertices of rising edges; all of them but in a flat cell
  Seen vertices[kMaxCellVertices];
  Rising rising[kMaxCellEdges];
};
static_assert(kMaxCellVertices <= 64);

void look(const Cell& cell, const glm::dmat4& lsFromView, SeenCell& seen) noexcept {
  seen.vertexCount = cell.vertexCount;
  seen.risingCount = 0;
  seen.risingVertices = 0;
  for (int v = 0; v < cell.vertexCount; ++v) {
    const glm::dvec3& vs = cell.vertices[v];
    const auto row = [&](int r) { return lsFromView[0][r] * vs.x + lsFromView[1][r] * vs.y + lsFromView[2][r] * vs.z + lsFromView[3][r]; };
    seen.vertices[v] = {row(0), row(1), row(2), row(3), vs.z};
  }
  for (int i = 0; i < cell.edgeCount; ++i) {
    std::uint8_t from = cell.edges[i].from, to = cell.edges[i].to;
    if (seen.vertices[from].z == seen.vertices[to].z) continue;
    if (seen.vertices[from].z > seen.vertices[to].z) std::swap(from, to);
    const Seen &p = seen.vertices[from], &q = seen.vertices[to];
    const double perDepth = 1.0 / (q.z - p.z);
    seen.rising[seen.risingCount++] = {
        from, to, {(q.x - p.x) * perDepth, (q.y - p.y) * perDepth, (q.depth - p.depth) * perDepth, (q.w - p.w) * perDepth, 1.0}};
    seen.risingVertices |= std::uint64_t{1} << from | std::uint64_t{1} << to;
  }
}

// The points of one footprint, before the hull.
struct Points {
  int count = 0;
  double depthNear = kInfinity, depthFar = -kInfinity;
  glm::dvec2 xy[kMaxHull];
  Ring ring;
};

// Makes room where there is none: only the hull's vertices matter.
void condense(Points& points) noexcept {
  makeHull(points.xy, points.count, points.ring);
  glm::dvec2 hull[kMaxHull];
  for (int i = 0; i < points.ring.count; ++i) hull[i] = points.xy[points.ring.index[i]];
  points.count = points.ring.count;
  std::copy_n(hull, points.count, points.xy);
  if (points.count > kMaxHull / 2) points.count = simplifyHull(points.xy, points.count);
}

inline void add(Points& points, double x, double y, double depth, double w) noexcept {
  if (points.count == kMaxHull) condense(points);
  if (w != 1.0) {  // a directional light has no perspective
    x /= w;
    y /= w;
    depth /= w;
  }
  points.xy[points.count++] = {x, y};
  points.depthNear = depth < points.depthNear ? depth : points.depthNear;
  points.depthFar = depth > points.depthFar ? depth : points.depthFar;
}

// Adds the part of a cell between two view depths: where its edges enter and leave the slab. All slices of a view volume get
// their points in the same order.
void addSlab(Points& points, const SeenCell& seen, const DepthSpan& slab) noexcept {
  std::uint64_t added = seen.risingVertices;
  const auto addVertex = [&](const Seen& v) { add(points, v.x, v.y, v.depth, v.w); };
  if (std::popcount(added) != seen.vertexCount)
    for (int i = 0; i < seen.vertexCount; ++i)
      if (!(added >> i & 1) && seen.vertices[i].z >= slab.near && seen.vertices[i].z <= slab.far) addVertex(seen.vertices[i]);
  added = 0;
  const auto addEnd = [&](const Rising& edge, int end, double z) {
    if (seen.vertices[end].z == z) {
      if (!(added >> end & 1)) addVertex(seen.vertices[end]);
      added |= std::uint64_t{1} << end;
      return;
    }
    const Seen& from = seen.vertices[edge.from];
    const double t = z - from.z;
    add(points, from.x + edge.slope.x * t, from.y + edge.slope.y * t, from.depth + edge.slope.depth * t, from.w + edge.slope.w * t);
  };
  for (int i = 0; i < seen.risingCount; ++i) {
    const Rising& edge = seen.rising[i];
    const double from = seen.vertices[edge.from].z, to = seen.vertices[edge.to].z;
    if (from > slab.far || to < slab.near) continue;
    addEnd(edge, edge.from, from < slab.near ? slab.near : from);
    addEnd(edge, edge.to, to > slab.far ? slab.far : to);
  }
}

// What the gathered points say of a footprint.
void finish(Points& points, Footprint& footprint) noexcept {
  makeHull(points.xy, points.count, points.ring);
  footprint.count = points.ring.count;
  for (int i = 0; i < footprint.count; ++i) footprint.hull[i] = points.xy[points.ring.index[i]];
  footprint.depthNear = points.depthNear;
  footprint.depthFar = points.depthFar;
}

// The width of the widest part of a view slice: any rotation of it fits a square of this side.
double sliceDiameter(const Region& region, const DepthSpan& slab) noexcept {
  const Camera& camera = region.camera;
  const bool isPerspective = camera.projection == Projection::perspective;
  glm::dvec3 corners[8];
  for (int i = 0; i < 8; ++i) {
    const double z = (i & 4) ? slab.far : slab.near, k = isPerspective ? z : 1.0;
    corners[i] = {((i & 1) ? camera.right : -camera.left) * k, ((i & 2) ? camera.up : -camera.down) * k, z};
  }
  double squared = 0.0;
  for (int i = 0; i < 8; ++i)
    for (int j = 0; j < i; ++j) squared = std::max(squared, glm::dot(corners[i] - corners[j], corners[i] - corners[j]));
  return std::sqrt(squared);
}

// Distance from the eye to the farthest corner of a view slice.
double farthestReach(const Region& region, const DepthSpan& slab) noexcept {
  const Camera& camera = region.camera;
  const double z = std::max(std::abs(slab.near), std::abs(slab.far)), k = camera.projection == Projection::perspective ? z : 1.0;
  const double x = k * std::max(std::abs(camera.left), std::abs(camera.right)),
               y = k * std::max(std::abs(camera.down), std::abs(camera.up));
  return std::sqrt(x * x + y * y + z * z);
}

// The rectangle along an axis; no side shorter than a pixel.
void fitAlong(const Footprint& footprint, glm::dvec2 axis, double pixel, MapFit& fit) noexcept {
  fit.axisX = axis;
  fit.axisY = {-axis.y, axis.x};
  glm::dvec2 least(kInfinity), most(-kInfinity);
  for (int i = 0; i < footprint.count; ++i) {
    const glm::dvec2& p = footprint.hull[i];
    const double x = p.x * axis.x + p.y * axis.y, y = axis.x * p.y - axis.y * p.x;
    least = {x < least.x ? x : least.x, y < least.y ? y : least.y};
    most = {x > most.x ? x : most.x, y > most.y ? y : most.y};
  }
  fit.size = {std::max(most.x - least.x, pixel), std::max(most.y - least.y, pixel)};
  fit.least = (least + most - fit.size) / 2.0;
}

// The rectangle of least area: it has a side on an edge of the hull (rotating calipers' theorem).
void fitLeast(const Footprint& footprint, double pixel, MapFit& fit) noexcept {
  double leastArea = kInfinity;
  const glm::dvec2* hull = footprint.hull;
  glm::dvec2 tried[kMaxHull];
  int triedCount = 0;
  for (int i = 0; i < footprint.count; ++i) {
    const glm::dvec2 from = hull[i], edge = hull[i + 1 < footprint.count ? i + 1 : 0] - from;
    const double squared = edge.x * edge.x + edge.y * edge.y;
    if (!(squared > 0.0)) continue;
    constexpr double kParallel = 1e-12;  // sine below which a direction is one already tried: a frustum's near and far sides
    const double perLength = 1.0 / std::sqrt(squared);
    const glm::dvec2 axis = edge * perLength;
    bool isTried = false;
    for (int j = 0; j < triedCount && !isTried; ++j) isTried = std::abs(cross2(tried[j], axis)) < kParallel;
    if (isTried) continue;
    tried[triedCount++] = axis;
    const double x0 = glm::dot(hull[0], axis), y0 = cross2(axis, hull[0]);
    double left = x0, right = x0, low = y0, high = y0;
    for (int j = 1; j < footprint.count; ++j) {
      const double x = hull[j].x * axis.x + hull[j].y * axis.y, y = axis.x * hull[j].y - axis.y * hull[j].x;
      left = x < left ? x : left;
      right = x > right ? x : right;
      low = y < low ? y : low;
      high = y > high ? y : high;
    }
    const glm::dvec2 span(right - left, high - low), size(std::max(span.x, pixel), std::max(span.y, pixel));
    if (!(size.x * size.y < leastArea)) continue;
    leastArea = size.x * size.y;
    fit.axisX = axis;
    fit.axisY = {-axis.y, axis.x};
    fit.size = size;
    fit.least = glm::dvec2(left, low) - (size - span) / 2.0;
  }
}

// True where b is a, scaled about the eye, as near as makes no difference to the choice of an axis: so are the slices of equal
// ratio of a whole perspective view.
bool isScaled(const Footprint& a, const Footprint& b) noexcept {
  constexpr double kAlike = 1e-4;  // of the size
  if (a.count != b.count || a.count < 3) return false;
  const double scale = b.padded.far / a.padded.far, most = kAlike * b.reach;
  for (int i = 0; i < a.count; ++i) {
    const glm::dvec2 apart = b.hull[i] - a.hull[i] * scale;
    if (!(std::abs(apart.x) <= most && std::abs(apart.y) <= most)) return false;
  }
  return true;
}

// The unit axis least along v.
glm::dvec3 farthestAxis(const glm::dvec3& v) noexcept {
  const glm::dvec3 a = glm::abs(v);
  if (a.x <= a.y && a.x <= a.z) return {1.0, 0.0, 0.0};
  return a.y <= a.z ? glm::dvec3(0.0, 1.0, 0.0) : glm::dvec3(0.0, 0.0, 1.0);
}

constexpr double kFloatRounding = 1.0 / 2097152.0;  // 2^-21: four rounded terms of a float32 row, twice over

}  // namespace

Status makeLightSpace(const DirectionalLight& light, const Region& region, FitMode mode, LightSpace& out) noexcept {
  const glm::dvec3 z = unit(light.directionWs);
  if (!isFinite(light.directionWs) || !(glm::dot(z, z) > 0.0)) return Status::lightDirection;
  const glm::dvec3 zVs = z * region.worldFromView;
  out.directionWs = z;
  out.directionVs = zVs;
  // x, y and z are right, up and forward of one who looks along the light: y = x cross z in a right-handed world.
  glm::dvec3 x;
  if (mode == FitMode::stable) {
    x = unit(glm::cross(z, farthestAxis(z)));
  } else if (mode == FitMode::tight) {
    x = region.worldFromView * unit(glm::cross(zVs, farthestAxis(zVs)));
  } else {
    constexpr double kAlongView = 0.9;  // beyond this cosine the projected view direction says little: the camera's up serves
    const glm::dvec3 along = region.worldFromView[std::abs(zVs.z) < kAlongView ? 2 : 1];
    x = unit(glm::cross(z, along));
  }
  const glm::dvec3 y = glm::cross(x, z);
  const glm::dmat3 lsFromWorld = glm::transpose(glm::dmat3(x, y, z));
  out.lsFromWorld = glm::dmat4(lsFromWorld);
  out.lsFromView = glm::dmat4(lsFromWorld * region.worldFromView);
  return Status::ok;
}

void makeFootprints(const Region& region, const LightSpace& light, const Splits& splits, const Margin& margin, bool byViewDepth,
                    Footprint* footprints) noexcept {
  for (int s = 0; s < splits.count; ++s) {
    Footprint& footprint = footprints[s];
    footprint.count = 0;
    footprint.padded = padSlice(region, splits, s, margin, byViewDepth);
    footprint.reach = farthestReach(region, footprint.padded);
  }
  Cell storage;
  SeenCell seen;
  if (cellCount(region) == 1) {
    const Cell* cell = getCell(region, 0, storage);
    if (!cell) return;
    look(*cell, light.lsFromView, seen);
    Points points;
    for (int s = 0; s < splits.count; ++s) {
      points.count = 0;
      points.depthNear = kInfinity;
      points.depthFar = -kInfinity;
      addSlab(points, seen, footprints[s].padded);
      finish(points, footprints[s]);
    }
    return;
  }
  Points points[kMaxPartitions];
  for (int i = 0; i < cellCount(region); ++i) {
    const Cell* cell = getCell(region, i, storage);
    if (!cell) continue;
    look(*cell, light.lsFromView, seen);
    for (int s = 0; s < splits.count; ++s) addSlab(points[s], seen, footprints[s].padded);
  }
  for (int s = 0; s < splits.count; ++s) finish(points[s], footprints[s]);
}

void fitSlices(const Region& region, const Footprint* footprints, int count, FitMode mode, const double* pixels, MapFit* fits) noexcept {
  for (int i = 0; i < count; ++i) {
    const Footprint& footprint = footprints[i];
    MapFit& fit = fits[i];
    fit.depthNear = footprint.depthNear;
    fit.depthFar = footprint.depthFar;
    fit.square = mode != FitMode::tight;
    fit.size = glm::dvec2(mode == FitMode::stable ? std::max(sliceDiameter(region, footprint.padded), pixels[i]) : pixels[i]);
    if (footprint.count == 0) continue;
    if (mode == FitMode::stable) {
      const glm::dvec2 size = fit.size;
      fitAlong(footprint, {1.0, 0.0}, pixels[i], fit);
      fit.size = size;
    } else if (mode == FitMode::slice || footprint.count < 2) {  // a point has no edge
      fitAlong(footprint, {1.0, 0.0}, pixels[i], fit);
    } else if (i > 0 && isScaled(footprints[i - 1], footprint)) {  // one search serves them all
      fitAlong(footprint, fits[i - 1].axisX, pixels[i], fit);
    } else {
      fitLeast(footprint, pixels[i], fit);
      if (fit.size.x < fit.size.y) fitAlong(footprint, fit.axisY, pixels[i], fit);  // lying rectangles shelve better
    }
  }
}

Status growToViewport(const Frame& frame, const Region& region, const LightSpace& light, const Footprint& footprint, FitMode mode,
                      const glm::ivec4& viewport, MapFit& fit, std::uint32_t& warnings) noexcept {
  const double margin = frame.margin.filter + frame.margin.normalOffset;
  const glm::dvec2 texels(viewport.z, viewport.w);
  const bool isStable = mode == FitMode::stable;
  const glm::dvec2 inner = texels - 2.0 * margin - (isStable ? 1.0 : 0.0);  // stable gives one texel to the snap
  if (!(inner.x >= 1.0 && inner.y >= 1.0) && !(margin == 0.0 && !isStable)) return Status::marginTexels;
  // World-space input is as large as the world position; its rounding is part of the map's.
  const double worldReach = frame.worldSpace ? footprint.reach + std::sqrt(glm::dot(region.eyeWs, region.eyeWs)) : 0.0;
  const double rounding = kFloatRounding * std::max(footprint.reach, worldReach);
  glm::dvec2 texel;
  if (isStable) {
    // Rounding by a bound that depends on the projection alone, so that the size does.
    const double size = fit.size.x + 2.0 * kFloatRounding * farthestReach(region, footprint.padded);
    texel = glm::dvec2(size / inner.x);
    const glm::dvec2 eye(light.lsFromWorld * glm::dvec4(region.eyeWs, 0.0));  // the world origin's texel grid decides the phase
    const glm::dvec2 slack = (glm::dvec2(size) - fit.size) / 2.0;
    const glm::dvec2 snapped = glm::floor((eye + fit.least - slack) / texel) * texel - eye;
    fit.least = snapped - margin * texel;
  } else {
    fit.least -= rounding;
    fit.size += 2.0 * rounding;
    texel = fit.size / inner;
    fit.least -= margin * texel;
  }
  fit.size = texel * texels;
  const double room = rounding + margin * std::max(texel.x, texel.y);
  fit.depthNear -= room;
  fit.depthFar += room;
  const double thickness = fit.depthFar - fit.depthNear, leastThickness = std::min(texel.x, texel.y);
  if (!(thickness >= leastThickness)) {
    fit.depthNear -= (leastThickness - thickness) / 2.0;
    fit.depthFar += (leastThickness - thickness) / 2.0;
  }
  constexpr double kTenth = 0.1;  // of a texel
  if (frame.worldSpace && kFloatRounding / 4.0 * worldReach > kTenth * std::min(texel.x, texel.y)) {
    if (isStable) return Status::stableWorldSpace;
    warnings |= static_cast<std::uint32_t>(Warning::worldSpacePrecision);
    if (rounding * 4.0 > std::min(fit.size.x, fit.size.y)) return Status::worldSpacePrecision;
  }
  return Status::ok;
}

glm::dmat4 cropMatrix(const Frame& frame, const LightSpace& light, const glm::dvec3& eyeMinusOriginWs, const MapFit& fit) noexcept {
  const glm::dmat4 rows = glm::transpose(light.lsFromWorld);  // rows of light space, from world - eye
  const double flip = frame.shadowMap.style == ClipStyle::vulkan ? -1.0 : 1.0;
  const glm::dvec2 scale = 2.0 / fit.size;
  const glm::dvec4 x = (rows[0] * fit.axisX.x + rows[1] * fit.axisX.y) * scale.x - rows[3] * (fit.least.x * scale.x + 1.0);
  const glm::dvec4 y = (rows[0] * fit.axisY.x + rows[1] * fit.axisY.y) * scale.y - rows[3] * (fit.least.y * scale.y + 1.0);
  glm::dvec4 z = (rows[2] - rows[3] * fit.depthNear) / (fit.depthFar - fit.depthNear);
  if (frame.shadowMap.depth == DepthConvention::negativeOneToOne) z = 2.0 * z - rows[3];
  if (frame.shadowMap.depth == DepthConvention::reversedZeroToOne) z = rows[3] - z;
  glm::dmat4 crop = glm::transpose(glm::dmat4(x, flip * y, z, rows[3]));
  if (eyeMinusOriginWs != glm::dvec3(0.0)) crop[3] -= glm::dmat4(glm::dmat3(crop)) * glm::dvec4(eyeMinusOriginWs, 0.0);
  return crop;
}

}  // namespace gnomon
