#include "gnomon/footprint.h"

#include <bit>

#include "gnomon/camera.h"
#include "hull.h"
#include "numeric.h"

namespace gnomon {
namespace {

// A cell's vertex seen from the light: homogeneous, so that points between two of them may be interpolated before the division.
struct Seen {
  double x, y, depth, w, z;  // z: view depth
  double along;  // where slabs are cut: view depth for slices, a wedge's axis for its rows
};

// An edge that is not parallel to the slabs, from where `along` is less to where it is more.
struct Rising {
  std::uint8_t from, to;
  double start, end;  // `along` of both
  Seen slope;  // per unit of `along`
};

// A cell seen from the light.
struct SeenCell {
  int vertexCount = 0, risingCount = 0;
  std::uint64_t risingVertices = 0;  // bits: vertices of rising edges
  bool isFlat = false;  // some vertices are of no rising edge
  bool isAffine = true;  // w is 1: a directional light has no perspective
  Seen vertices[kMaxCellVertices];
  Rising rising[kMaxCellEdges];
};
static_assert(kMaxCellVertices <= 64);

void look(const Cell& cell, const glm::dmat4& lsFromView, const Plane& axis, SeenCell& seen) noexcept {
  seen.vertexCount = cell.vertexCount;
  seen.risingCount = 0;
  seen.risingVertices = 0;
  seen.isAffine = lsFromView[0][3] == 0.0 && lsFromView[1][3] == 0.0 && lsFromView[2][3] == 0.0 && lsFromView[3][3] == 1.0;
  double along[kMaxCellVertices];
  for (int v = 0; v < cell.vertexCount; ++v) {
    const glm::dvec3& vs = cell.vertices[v];
    along[v] = glm::dot(axis.normal, vs) + axis.offset;
    const auto rows = [&](int r) {
      const auto of = [&](int c) { return Pair{lsFromView[c][r], lsFromView[c][r + 1]}; };
      return of(0) * vs.x + of(1) * vs.y + of(2) * vs.z + of(3);
    };
    const Pair xy = rows(0), depthW = rows(2);
    seen.vertices[v] = {xy[0], xy[1], depthW[0], seen.isAffine ? 1.0 : depthW[1], vs.z, along[v]};
  }
  for (int i = 0; i < cell.edgeCount; ++i) {
    std::uint8_t from = cell.edges[i].from, to = cell.edges[i].to;
    if (along[from] == along[to]) continue;
    if (along[from] > along[to]) std::swap(from, to);
    const Seen &p = seen.vertices[from], &q = seen.vertices[to];
    const double perUnit = 1.0 / (along[to] - along[from]);
    seen.rising[seen.risingCount++] = {
        from,
        to,
        along[from],
        along[to],
        {(q.x - p.x) * perUnit, (q.y - p.y) * perUnit, (q.depth - p.depth) * perUnit, (q.w - p.w) * perUnit, (q.z - p.z) * perUnit, 1.0}};
    seen.risingVertices |= std::uint64_t{1} << from | std::uint64_t{1} << to;
  }
  seen.isFlat = std::popcount(seen.risingVertices) != seen.vertexCount;
}

// The points that one footprint must cover, before their hull.
struct Points {
  int count = 0;
  double depthNear = kInfinity, depthFar = -kInfinity;  // of those condensed
  glm::dvec3 ls[kMaxHull];

  void add(const glm::dvec3& point, double) noexcept {
    if (count == kMaxHull) condense();
    ls[count++] = point;
  }

  void clear() noexcept {
    count = 0;
    depthNear = kInfinity;
    depthFar = -kInfinity;
  }

  // What the points say of a footprint.
  void finish(Footprint& footprint) noexcept {
    footprint.count = makeHull(ls, count, footprint.hull);
    measureDepth();
    footprint.depthNear = depthNear;
    footprint.depthFar = depthFar;
  }

 private:
  void measureDepth() noexcept {
    for (int i = 0; i < count; ++i) {
      depthNear = std::min(depthNear, ls[i].z);
      depthFar = std::max(depthFar, ls[i].z);
    }
  }
  // Makes room where there is none: only the hull's vertices matter.
  void condense() noexcept {
    measureDepth();
    glm::dvec2 hull[kMaxHull];
    count = makeHull(ls, count, hull);
    count = simplifyHull(hull, count, kMaxHull / 2);
    for (int i = 0; i < count; ++i) ls[i] = glm::dvec3(hull[i], depthNear);
  }
};

// A footprint, and what tells how well those of other slabs are copies of it: between two vertices' `along` a cell is a bundle of edges.
struct Model {
  int slice = 0;
  double from = kInfinity, to = -kInfinity;  // where no other vertex lies between, and nothing but the edges counts
  double tolerance = 0.0;  // how far a copy's points may be off
  double atEye = 0.0,
         perUnit = 0.0;  // the greatest distance, in x, y and depth together, of an edge from the eye at `along` 0, and its slope
  double leastDepth = kInfinity, mostDepth = -kInfinity;  // per unit of `along`
};

Model makeModel(int slice, const SeenCell& seen, const DepthSpan& slab, double tolerance) noexcept {
  Model model;
  if (seen.isFlat || !seen.isAffine) return model;
  double from = -kInfinity, to = kInfinity;
  for (int i = 0; i < seen.vertexCount; ++i) {
    const double along = seen.vertices[i].along;
    if (along <= slab.near)
      from = std::max(from, along);
    else if (along >= slab.far)
      to = std::min(to, along);
    else
      return model;
  }
  for (int i = 0; i < seen.risingCount; ++i) {
    const Rising& edge = seen.rising[i];
    if (edge.start > from || edge.end < to) continue;
    const Seen &start = seen.vertices[edge.from], &slope = edge.slope;
    const auto atEye = [&](double at, double perUnit) { return std::abs(at - perUnit * edge.start); };
    model.atEye = std::max(model.atEye, atEye(start.x, slope.x) + atEye(start.y, slope.y) + atEye(start.depth, slope.depth));
    model.perUnit = std::max(model.perUnit, std::abs(slope.x) + std::abs(slope.y) + std::abs(slope.depth));
    model.leastDepth = std::min(model.leastDepth, slope.depth);
    model.mostDepth = std::max(model.mostDepth, slope.depth);
  }
  model.slice = slice;
  model.from = from;
  model.to = to;
  model.tolerance = tolerance;
  return model;
}

// Makes the footprint of a slab a copy of the model's. False where it is not one.
bool copyModel(const Model& model, const Footprint& other, Footprint& footprint) noexcept {
  const DepthSpan& slab = footprint.padded;
  if (!(slab.near >= model.from && slab.far <= model.to)) return false;
  const double scale = slab.far / other.padded.far;
  const double apart = std::abs(slab.near - other.padded.near * scale) * model.perUnit + std::abs(1.0 - scale) * model.atEye;
  if (!(apart <= model.tolerance * scale)) return false;
  footprint.like = model.slice;
  footprint.scale = scale;
  footprint.apart = apart;
  footprint.count = other.count;
  for (int i = 0; i < other.count; ++i) footprint.hull[i] = other.hull[i] * scale;
  footprint.depthNear = std::min(slab.near * model.leastDepth, slab.far * model.leastDepth) - model.atEye;
  footprint.depthFar = std::max(slab.near * model.mostDepth, slab.far * model.mostDepth) + model.atEye;
  return true;
}

// The vertices of what a map serves, with the width of a pixel at each.
struct ServedPoints {
  double pixelSlope, pixelBase;
  Served* served;

  void add(const glm::dvec3& ls, double z) noexcept {
    if (served->count == kMaxHull) condense();
    served->points[served->count] = ls;
    served->pixels[served->count++] = pixelSlope * z + pixelBase;
  }

 private:
  // Too many: the hulls of those alike in width, every vertex with the least width of its hull, need no fewer texels.
  void condense() noexcept {
    constexpr int kBands = 4, kMost = 10;
    static_assert(kBands * kMost < kMaxHull);
    const Served all = *served;
    const auto [least, most] = std::minmax_element(all.pixels, all.pixels + all.count);
    const double ratio = std::sqrt(std::sqrt(*most / *least));  // between bands
    served->count = 0;
    served->isCondensed = true;
    double from = 0.0, to = *least;
    for (int band = 0; band < kBands; ++band, from = to) {
      to = band + 1 < kBands ? to * ratio : kInfinity;
      glm::dvec3 points[kMaxHull];
      int count = 0;
      double width = kInfinity, depth = 0.0;
      for (int i = 0; i < all.count; ++i) {
        if (!(all.pixels[i] >= from && all.pixels[i] < to)) continue;
        points[count++] = all.points[i];
        width = std::min(width, all.pixels[i]);
        depth = all.points[i].z;
      }
      glm::dvec2 hull[kMaxHull];
      count = simplifyHull(hull, makeHull(points, count, hull), kMost);
      for (int i = 0; i < count; ++i) {
        served->points[served->count] = glm::dvec3(hull[i], depth);
        served->pixels[served->count++] = width;
      }
    }
  }
};

// What a wedge's map must hold is what it serves.
struct WedgePoints {
  Points& held;
  ServedPoints served;

  void add(const glm::dvec3& ls, double z) noexcept {
    held.add(ls, z);
    served.add(ls, z);
  }
};

// Gives the part of a cell inside a slab to the points: where its edges enter and leave it.
template <class Sink>
void addSlab(Sink& points, const SeenCell& seen, const DepthSpan& slab) noexcept {
  const auto add = [&](double x, double y, double depth, double w, double z) {
    if (seen.isAffine)
      points.add({x, y, depth}, z);
    else
      points.add(glm::dvec3(x, y, depth) / w, z);
  };
  std::uint64_t added = 0;
  const auto addVertex = [&](int i) {
    if (added >> i & 1) return;
    added |= std::uint64_t{1} << i;
    const Seen& v = seen.vertices[i];
    add(v.x, v.y, v.depth, v.w, v.z);
  };
  if (seen.isFlat)
    for (int i = 0; i < seen.vertexCount; ++i)
      if (const double along = seen.vertices[i].along; !(seen.risingVertices >> i & 1) && along >= slab.near && along <= slab.far)
        addVertex(i);
  const auto addBetween = [&](const Rising& edge, double along) {
    const Seen &from = seen.vertices[edge.from], &slope = edge.slope;
    const double t = along - edge.start;
    add(from.x + slope.x * t, from.y + slope.y * t, from.depth + slope.depth * t, from.w + slope.w * t, from.z + slope.z * t);
  };
  for (int i = 0; i < seen.risingCount; ++i) {
    const Rising& edge = seen.rising[i];
    if (edge.start > slab.far || edge.end < slab.near) continue;
    edge.start < slab.near ? addBetween(edge, slab.near) : addVertex(edge.from);
    edge.end > slab.far ? addBetween(edge, slab.far) : addVertex(edge.to);
  }
}

// Cuts a footprint to where the samples of its depths lie, the hull of their bounds: never beyond the plain one. None there: it vanishes.
void cutToBounds(const Region& region, const LightSpace& light, const DepthSpan& slice, Footprint& footprint) noexcept {
  if (footprint.count == 0) return;
  // A depth value may be off along its ray by what it cannot tell apart, and bounds are sums of float32 products.
  constexpr double kBoundsRounding = 1.0 / 1048576.0;  // 2^-20 of the distance from the eye
  const double far = footprint.padded.far,
               along = region.camera.projection == Projection::perspective && far > 0.0 ? footprint.reach / far : 1.0;
  const double room = region.latency + depthQuantum(region.camera, far) * along + kBoundsRounding * footprint.reach;
  const glm::dvec3 x = boundsAxis(light.directionWs, region.boundsRightWs), y = glm::cross(x, light.directionWs);
  const glm::dvec2 xLs(light.lsFromWorld * glm::dvec4(x, 0.0)), yLs(light.lsFromWorld * glm::dvec4(y, 0.0));
  Points corners;
  for (const SampleBounds& bounds : region.bounds) {
    // A depth value at the near plane may lie a rounding before it.
    const double end = std::max(bounds.far + region.latency, region.near);
    const double from = std::max(bounds.near - region.latency, slice.near), to = std::min(end, slice.far);
    const bool isPoint =
        bounds.near == bounds.far || end == region.near || slice.near == slice.far;  // others that only touch have nothing in common
    if (!(isPoint ? from <= to : from < to)) continue;
    // Farther than the footprint they say nothing, and huge ones would lose what their other side says.
    const glm::dvec2 limit(2.0 * footprint.reach);
    const glm::dvec2 least = glm::clamp(bounds.least - room, -limit, limit), most = glm::clamp(bounds.most + room, -limit, limit);
    for (const glm::dvec2& p : {least, most, glm::dvec2(least.x, most.y), glm::dvec2(most.x, least.y)})
      corners.add(glm::dvec3(xLs * p.x + yLs * p.y, 0.0), 0.0);
  }
  glm::dvec2 hull[kMaxHull], beyond[kMaxHull];
  const int count = corners.count > 0 ? makeHull(corners.ls, corners.count, hull) : 0;
  if (count == 0) footprint.count = 0;
  for (int i = 0; i < count && footprint.count > 0; ++i) {
    const glm::dvec2 edge = hull[i + 1 < count ? i + 1 : 0] - hull[i], inwards(-edge.y, edge.x);
    cutHull(footprint.hull, footprint.count, inwards, glm::dot(inwards, hull[i]), beyond);
  }
}

// Distance from the eye to the farthest corner of a view slice. sides: the farther of the camera's left and right, and of down and up.
double farthestReach(const Region& region, const glm::dvec2& sides, const DepthSpan& slab) noexcept {
  const double z = std::max(std::abs(slab.near), std::abs(slab.far)), k = region.camera.projection == Projection::perspective ? z : 1.0;
  const double x = k * sides.x, y = k * sides.y;
  return std::min(std::sqrt(x * x + y * y + z * z), region.reach);
}

// Cuts a cell to a wedge's sides. False where nothing is left.
bool cutToSides(Cell& cell, const Wedge& wedge) noexcept {
  for (const Plane& side : {wedge.left, wedge.right})
    if (side.normal != glm::dvec3(0.0) && cutCell(cell, side, std::abs(side.offset)) == Cut::outside) return false;
  return true;
}

bool isSame(const Plane& a, const Plane& b) noexcept { return a.normal == b.normal && a.offset == b.offset; }

// False where a receiver lies before or beyond all slices.
bool meetsSlices(const Region& region, const Box& box, const DepthSpan& covered) noexcept {
  const glm::dvec3 &forward = region.worldFromView[2], half = (box.maxWs - box.minWs) * 0.5, centre = box.minWs + half - region.eyeWs;
  const double depth = glm::dot(forward, centre);
  const glm::dvec3 magnitude = glm::abs(box.minWs) + glm::abs(box.maxWs) + glm::abs(region.eyeWs);
  const double reach = glm::dot(glm::abs(forward), half) + 1e-14 * (magnitude.x + magnitude.y + magnitude.z);
  return !(depth - reach > covered.far || depth + reach < covered.near);
}

// Calls visit(slice, cell seen from the light) for every slice and every part of the region that it may meet. Wedges that are rows
// between the same sides are slabs of one cell. covered: view depths that some slice covers.
template <class Visit>
void forEachCell(const Region& region, const LightSpace& light, const Splits& splits, const DepthSpan& covered, Visit&& visit) noexcept {
  Cell storage;
  SeenCell seen;
  for (int i = 0; i < cellCount(region); ++i) {
    if (!region.receivers.empty() && !meetsSlices(region, region.receivers[static_cast<std::size_t>(i)], covered)) continue;
    const Cell* cell = getCell(region, i, storage);
    if (!cell) continue;
    if (!splits.isWedged) look(*cell, light.lsFromView, {glm::dvec3(0.0, 0.0, 1.0), 0.0}, seen);
    bool isEmpty = false;
    for (int s = 0; s < splits.count; ++s) {
      const Wedge &wedge = splits.wedges[s], &before = splits.wedges[s > 0 ? s - 1 : 0];
      if (splits.isWedged &&
          (s == 0 || !isSame(wedge.axis, before.axis) || !isSame(wedge.left, before.left) || !isSame(wedge.right, before.right))) {
        const bool hasSides = wedge.left.normal != glm::dvec3(0.0) || wedge.right.normal != glm::dvec3(0.0);
        Cell part;
        if (hasSides) copyCell(*cell, part);
        isEmpty = hasSides && !cutToSides(part, wedge);
        if (!isEmpty) look(hasSides ? part : *cell, light.lsFromView, wedge.axis, seen);
      }
      if (!isEmpty) visit(s, seen);
    }
  }
}

// The footprints of rows that lie between the same sides of one convex cell: what lies between the sides, cut along the lines where rows
// begin. They run along the light: a directional one, whose light space is turned, no more. targets: each row's footprint; -1: it has other
// sides. whole: the region's, or null.
void addRows(const Cell& part, const Region& region, const LightSpace& light, const Rows& rows, const Wedge& sides, const int* targets,
             const Footprint* whole, Footprint* footprints, Served* served) noexcept {
  const glm::dmat3 lsFromView(light.lsFromView);
  const glm::dvec2 axis(lsFromView * rows.along.normal);
  struct Row {
    ServedPoints points;
    double near = kInfinity, far = -kInfinity;  // of light-space depth
  } made[kMaxPartitions];
  for (int i = 0; i < rows.count; ++i)
    made[i].points = {region.pixelSlope, region.pixelBase, targets[i] < 0 ? nullptr : &served[targets[i]]};
  const auto add = [&](int row, const glm::dvec3& ls, double z) {
    Row& to = made[row];
    if (!to.points.served) return;
    to.near = std::min(to.near, ls.z);
    to.far = std::max(to.far, ls.z);
    to.points.add(ls, z);
  };
  glm::dvec3 ls[kMaxCellVertices];
  double along[kMaxCellVertices];
  int rowOf[kMaxCellVertices];
  for (int v = 0; v < part.vertexCount; ++v) {
    ls[v] = lsFromView * part.vertices[v];
    along[v] = glm::dot(axis, glm::dvec2(ls[v]));
    int row = 0;
    while (row + 1 < rows.count && along[v] >= rows.rows[row + 1].start) ++row;
    rowOf[v] = row;
    add(row, ls[v], part.vertices[v].z);
    if (row > 0 && along[v] == rows.rows[row].start) add(row - 1, ls[v], part.vertices[v].z);
  }
  for (int i = 0; i < part.edgeCount; ++i) {
    int from = part.edges[i].from, to = part.edges[i].to;
    if (rowOf[from] == rowOf[to]) continue;
    if (rowOf[from] > rowOf[to]) std::swap(from, to);
    const double perUnit = 1.0 / (along[to] - along[from]);
    for (int row = rowOf[from] + 1; row <= rowOf[to]; ++row) {
      const double t = (rows.rows[row].start - along[from]) * perUnit;
      const glm::dvec3 p = ls[from] + (ls[to] - ls[from]) * t;
      const double z = part.vertices[from].z + (part.vertices[to].z - part.vertices[from].z) * t;
      add(row - 1, p, z);
      add(row, p, z);
    }
  }
  glm::dvec2 hull[kMaxHull], beyond[kMaxHull];
  int count = 0;
  if (whole) {
    count = whole->count;
    std::copy_n(whole->hull, count, hull);
    for (const Plane& side : {sides.left, sides.right})
      if (side.normal != glm::dvec3(0.0)) cutHull(hull, count, glm::dvec2(lsFromView * side.normal), -side.offset, beyond);
  } else {
    count = makeHull(ls, part.vertexCount, hull);
  }
  for (int i = 0; i < rows.count; ++i) {
    Footprint* footprint = targets[i] < 0 ? nullptr : &footprints[targets[i]];
    glm::dvec2* row = footprint ? footprint->hull : beyond;
    const int rowCount = i + 1 < rows.count ? cutHull(hull, count, axis, rows.rows[i + 1].start, row) : count;
    const Served* points = made[i].points.served;
    if (!points || points->count == 0) continue;  // sides are cut in space, hulls on the plane: rounding may leave one without the other
    if (i + 1 == rows.count) std::copy_n(hull, count, row);
    footprint->count = rowCount > 0 && !points->isCondensed ? rowCount : makeHull(points->points, points->count, row);
    footprint->depthNear = made[i].near;
    footprint->depthFar = made[i].far;
  }
}

// Those of all rows of a region of one convex cell: columns between the same sides are parts of one cell.
void addColumns(const Region& region, const LightSpace& light, const Splits& splits, const Footprint* whole, Footprint* footprints,
                Served* served) noexcept {
  Cell storage, part;
  const Cell* cell = getCell(region, 0, storage);
  std::uint64_t done = 0;
  for (int s = 0; s < splits.count && cell; ++s) {
    if (done >> s & 1) continue;
    const Wedge& wedge = splits.wedges[s];
    int targets[kMaxPartitions];
    for (int row = 0; row < splits.rows.count; ++row) {
      const Rows::Row& wedges = splits.rows.rows[row];
      targets[row] = -1;
      for (int i = std::max(s, wedges.first); i < wedges.first + wedges.columns; ++i) {
        if (!isSame(splits.wedges[i].left, wedge.left) || !isSame(splits.wedges[i].right, wedge.right)) continue;
        targets[row] = i;
        done |= std::uint64_t{1} << i;
      }
    }
    const bool hasSides = wedge.left.normal != glm::dvec3(0.0) || wedge.right.normal != glm::dvec3(0.0);
    if (hasSides) copyCell(*cell, part);
    if (hasSides && !cutToSides(part, wedge)) continue;
    addRows(hasSides ? part : *cell, region, light, splits.rows, wedge, targets, whole, footprints, served);
  }
}

// How far points may be from copies of a footprint's: a share of its width that makes no difference to the choice of an axis or a warp.
double copyTolerance(const Footprint& footprint) noexcept {
  constexpr double kAlike = 1e-4;
  double twiceArea = 0.0;
  for (int i = 0; i < footprint.count; ++i) twiceArea += cross2(footprint.hull[i], footprint.hull[i + 1 < footprint.count ? i + 1 : 0]);
  return kAlike * twiceArea / (4.0 * footprint.reach);  // half the area over half the width
}

}  // namespace

glm::dvec3 planeAxis(const glm::dvec3& directionWs) noexcept { return unit(glm::cross(directionWs, leastAxis(directionWs))); }

glm::dvec3 boundsAxis(const glm::dvec3& directionWs, const glm::dvec3& rightWs) noexcept {
  const glm::dvec3 right = unit(rightWs), across = right - directionWs * glm::dot(right, directionWs);
  constexpr double kAlong = 0.01;  // square of the sine below which right says little of the light plane
  return glm::dot(across, across) > kAlong ? unit(across) : planeAxis(directionWs);
}

void makeFootprints(const Region& region, const LightSpace& light, const Splits& splits, const Margin& margin, bool byViewDepth,
                    bool mayCopy, Footprint* footprints, Served* served, const Footprint* whole) noexcept {
  DepthSpan padded[kMaxPartitions];
  padSlices(region, splits, margin, byViewDepth, padded);
  const Camera& camera = region.camera;
  const glm::dvec2 sides(std::max(std::abs(camera.left), std::abs(camera.right)), std::max(std::abs(camera.down), std::abs(camera.up)));
  DepthSpan covered{kInfinity, -kInfinity};
  for (int s = 0; s < splits.count; ++s) {
    Footprint& footprint = footprints[s];
    covered = {std::min(covered.near, padded[s].near), std::max(covered.far, padded[s].far)};
    footprint.count = 0;
    footprint.depthNear = footprint.depthFar = 0.0;
    footprint.padded = padded[s];
    footprint.like = s;
    footprint.scale = 1.0;
    footprint.apart = 0.0;
    footprint.reach = farthestReach(region, sides, footprint.padded);
    if (served) {
      served[s].count = 0;
      served[s].isCondensed = false;
    }
  }
  const auto addServed = [&](int s, const SeenCell& seen) {
    if (!served) return;
    ServedPoints points{region.pixelSlope, region.pixelBase, &served[s]};
    addSlab(points, seen, splits.slices[s]);
  };
  const auto addSlice = [&](int s, const SeenCell& seen, Points& points) {
    if (splits.isWedged) {
      WedgePoints both{points, {region.pixelSlope, region.pixelBase, &served[s]}};
      addSlab(both, seen, {splits.wedges[s].start, splits.wedges[s].end});
    } else {
      addSlab(points, seen, padded[s]);
      addServed(s, seen);
    }
  };
  // A map holds what stands for the points it serves, too: beyond its hull a warp has no w.
  const auto finish = [&](int s, Points& points) {
    if (served && served[s].isCondensed)
      for (int i = 0; i < served[s].count; ++i) points.add(served[s].points[i], 0.0);
    if (points.count > 0) points.finish(footprints[s]);
  };
  const auto keep = [&] {
    for (int s = 0; s < splits.count && !region.bounds.empty(); ++s) {
      const DepthSpan& slice = splits.slices[s];
      cutToBounds(region, light, {margin.blend > 0.0 ? padded[s].near : slice.near, slice.far}, footprints[s]);
    }
  };
  if (splits.isWedged && splits.rows.count > 0 && cellCount(region) == 1) {
    addColumns(region, light, splits, whole, footprints, served);
    keep();
    return;
  }
  if (cellCount(region) == 1) {
    Points points;
    Model model;
    forEachCell(region, light, splits, covered, [&](int s, const SeenCell& seen) {
      if (copyModel(model, footprints[model.slice], footprints[s])) {
        addServed(s, seen);
        return;
      }
      points.clear();
      addSlice(s, seen, points);
      if (points.count == 0) return;
      finish(s, points);
      if (mayCopy && !splits.isWedged) model = makeModel(s, seen, footprints[s].padded, copyTolerance(footprints[s]));
    });
    keep();
    return;
  }
  Points points[kMaxPartitions];
  forEachCell(region, light, splits, covered, [&](int s, const SeenCell& seen) { addSlice(s, seen, points[s]); });
  for (int s = 0; s < splits.count; ++s) finish(s, points[s]);
  keep();
}

}  // namespace gnomon
