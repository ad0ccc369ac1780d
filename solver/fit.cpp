#include "gnomon/fit.h"

#include "gnomon/camera.h"
#include "numeric.h"

namespace gnomon {
namespace {

double cross2(const glm::dvec2& a, const glm::dvec2& b) noexcept { return a.x * b.y - a.y * b.x; }

// Convex hull, counter-clockwise, in place. Returns the number of its vertices.  (Andrew's monotone chain)
int makeHull(glm::dvec2* points, int count) noexcept {
  for (int i = 1; i < count; ++i) {
    const glm::dvec2 p = points[i];
    int j = i;
    for (; j > 0 && (points[j - 1].x > p.x || (points[j - 1].x == p.x && points[j - 1].y > p.y)); --j) points[j] = points[j - 1];
    points[j] = p;
  }
  glm::dvec2 chain[2 * kMaxHull];
  int size = 0;
  const auto extend = [&](const glm::dvec2& p, int least) {
    for (; size >= least; --size) {
      const glm::dvec2 &a = chain[size - 2], &b = chain[size - 1];
      if ((b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x) > 0.0) break;
    }
    chain[size++] = p;
  };
  for (int i = 0; i < count; ++i) extend(points[i], 2);
  const int lower = size;
  for (int i = count - 2; i >= 0; --i) extend(points[i], lower + 1);
  if (size > 1) --size;  // the first point again
  if (size == 2 && chain[0] == chain[1]) size = 1;
  std::copy_n(chain, size, points);
  return size;
}

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

void add(Footprint& footprint, const Seen& point) noexcept {
  if (footprint.count == kMaxHull) {
    footprint.count = makeHull(footprint.hull, footprint.count);
    if (footprint.count > kMaxHull / 2) footprint.count = simplifyHull(footprint.hull, footprint.count);
  }
  double x = point.x, y = point.y, depth = point.depth;
  if (point.w != 1.0) {  // a directional light has no perspective
    x /= point.w;
    y /= point.w;
    depth /= point.w;
  }
  footprint.hull[footprint.count++] = {x, y};
  footprint.depthNear = depth < footprint.depthNear ? depth : footprint.depthNear;
  footprint.depthFar = depth > footprint.depthFar ? depth : footprint.depthFar;
}

// Adds the part of a cell between two view depths. Vertices of the cut are on the cell's edges.
void addSlab(Footprint& footprint, const Cell& cell, const Seen* seen, const DepthSpan& slab) noexcept {
  for (int i = 0; i < cell.vertexCount; ++i)
    if (seen[i].z >= slab.near && seen[i].z <= slab.far) add(footprint, seen[i]);
  for (int i = 0; i < cell.edgeCount; ++i) {
    const Seen *p = &seen[cell.edges[i].from], *q = &seen[cell.edges[i].to];
    if (p->z > q->z) std::swap(p, q);
    if (q->z <= slab.near || p->z >= slab.far) continue;
    const double perDepth = 1.0 / (q->z - p->z);
    for (const double z : {slab.near, slab.far}) {
      if (!(p->z < z && z < q->z)) continue;
      const double t = (z - p->z) * perDepth;
      add(footprint,
          {p->x + (q->x - p->x) * t, p->y + (q->y - p->y) * t, p->depth + (q->depth - p->depth) * t, p->w + (q->w - p->w) * t, z});
    }
  }
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
  return std::min(std::sqrt(x * x + y * y + z * z), region.reach);
}

// Extent of the hull along an axis.
DepthSpan extent(const Footprint& footprint, const glm::dvec2& axis) noexcept {
  DepthSpan span{kInfinity, -kInfinity};
  for (int i = 0; i < footprint.count; ++i) {
    const double x = glm::dot(footprint.hull[i], axis);
    span.near = std::min(span.near, x);
    span.far = std::max(span.far, x);
  }
  return span;
}

// The rectangle along an axis; no side shorter than a pixel.
void fitAlong(const Footprint& footprint, const glm::dvec2& axis, double pixel, MapFit& fit) noexcept {
  fit.axisX = axis;
  fit.axisY = {-axis.y, axis.x};
  const DepthSpan x = extent(footprint, fit.axisX), y = extent(footprint, fit.axisY);
  fit.size = {std::max(x.far - x.near, pixel), std::max(y.far - y.near, pixel)};
  fit.least = (glm::dvec2(x.near, y.near) + glm::dvec2(x.far, y.far) - fit.size) / 2.0;
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
    footprint.depthNear = kInfinity;
    footprint.depthFar = -kInfinity;
    footprint.padded = padSlice(region, splits, s, margin, byViewDepth);
    footprint.reach = farthestReach(region, footprint.padded);
  }
  Cell storage;
  Seen seen[kMaxCellVertices];
  const glm::dmat4& m = light.lsFromView;
  for (int i = 0; i < cellCount(region); ++i) {
    const Cell* cell = getCell(region, i, storage);
    if (!cell) continue;
    for (int v = 0; v < cell->vertexCount; ++v) {
      const glm::dvec3& vs = cell->vertices[v];
      const auto row = [&](int r) { return m[0][r] * vs.x + m[1][r] * vs.y + m[2][r] * vs.z + m[3][r]; };
      seen[v] = {row(0), row(1), row(2), row(3), vs.z};
    }
    for (int s = 0; s < splits.count; ++s) addSlab(footprints[s], *cell, seen, footprints[s].padded);
  }
  for (int s = 0; s < splits.count; ++s) {
    Footprint& footprint = footprints[s];
    footprint.count = makeHull(footprint.hull, footprint.count);
  }
}

MapFit fitSlice(const Region& region, const Footprint& footprint, FitMode mode, double pixel) noexcept {
  MapFit fit;
  fit.depthNear = footprint.depthNear;
  fit.depthFar = footprint.depthFar;
  fit.square = mode != FitMode::tight;
  fit.size = glm::dvec2(mode == FitMode::stable ? std::max(sliceDiameter(region, footprint.padded), pixel) : pixel);
  if (footprint.count == 0) return fit;
  if (mode != FitMode::tight || footprint.count < 2) {  // a point has no edge
    const glm::dvec2 size = fit.size;
    fitAlong(footprint, {1.0, 0.0}, pixel, fit);
    if (mode == FitMode::stable) fit.size = size;
    return fit;
  }
  // A rectangle of least area has a side on an edge of the hull (rotating calipers' theorem).
  double leastArea = kInfinity;
  for (int i = 0; i < footprint.count; ++i) {
    const glm::dvec2 from = footprint.hull[i], edge = footprint.hull[i + 1 < footprint.count ? i + 1 : 0] - from;
    const double squared = edge.x * edge.x + edge.y * edge.y;
    if (!(squared > 0.0)) continue;
    double least = 0.0, greatest = 0.0, height = 0.0;  // times the edge's length; the hull lies to the left of its edges
    for (int j = 0; j < footprint.count; ++j) {
      const double x = footprint.hull[j].x - from.x, y = footprint.hull[j].y - from.y;
      const double along = x * edge.x + y * edge.y, above = edge.x * y - edge.y * x;
      least = along < least ? along : least;
      greatest = along > greatest ? along : greatest;
      height = above > height ? above : height;
    }
    const double perLength = 1.0 / std::sqrt(squared);
    const glm::dvec2 span = glm::dvec2(greatest - least, height) * perLength, size(std::max(span.x, pixel), std::max(span.y, pixel));
    if (!(size.x * size.y < leastArea)) continue;
    leastArea = size.x * size.y;
    fit.axisX = edge * perLength;
    fit.axisY = {-fit.axisX.y, fit.axisX.x};
    fit.size = size;
    fit.least = glm::dvec2(glm::dot(from, fit.axisX) + least * perLength, glm::dot(from, fit.axisY)) - (size - span) / 2.0;
  }
  if (fit.size.x < fit.size.y) {  // lying rectangles shelve better: turn by a right angle
    fit.axisX = fit.axisY;
    fit.axisY = {-fit.axisX.y, fit.axisX.x};
    fit.least = {fit.least.y, -(fit.least.x + fit.size.x)};
    std::swap(fit.size.x, fit.size.y);
  }
  return fit;
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
  const double rounding = kFloatRounding * std::max(footprint.reach, worldReach) + region.unevenness;
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
