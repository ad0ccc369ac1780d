#include "gnomon/footprint.h"

#include <bit>

#include "gnomon/camera.h"
#include "numeric.h"

namespace gnomon {
namespace {

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
  double along;  // where slabs are cut: view depth for slices, a wedge's axis for its rows
};

// An edge that is not parallel to the slabs, from where `along` is less to where it is more.
struct Rising {
  std::uint8_t from, to;
  Seen slope;  // per unit of `along`
};

// A cell seen from the light.
struct SeenCell {
  int vertexCount = 0, risingCount = 0;
  std::uint64_t risingVertices = 0;  // bits: vertices of rising edges; all of them but in a flat cell
  Seen vertices[kMaxCellVertices];
  Rising rising[kMaxCellEdges];
};
static_assert(kMaxCellVertices <= 64);

void look(const Cell& cell, const glm::dmat4& lsFromView, const Plane& axis, SeenCell& seen) noexcept {
  seen.vertexCount = cell.vertexCount;
  seen.risingCount = 0;
  seen.risingVertices = 0;
  for (int v = 0; v < cell.vertexCount; ++v) {
    const glm::dvec3& vs = cell.vertices[v];
    const auto row = [&](int r) { return lsFromView[0][r] * vs.x + lsFromView[1][r] * vs.y + lsFromView[2][r] * vs.z + lsFromView[3][r]; };
    seen.vertices[v] = {row(0), row(1), row(2), row(3), vs.z, glm::dot(axis.normal, vs) + axis.offset};
  }
  for (int i = 0; i < cell.edgeCount; ++i) {
    std::uint8_t from = cell.edges[i].from, to = cell.edges[i].to;
    if (seen.vertices[from].along == seen.vertices[to].along) continue;
    if (seen.vertices[from].along > seen.vertices[to].along) std::swap(from, to);
    const Seen &p = seen.vertices[from], &q = seen.vertices[to];
    const double perUnit = 1.0 / (q.along - p.along);
    seen.rising[seen.risingCount++] = {
        from,
        to,
        {(q.x - p.x) * perUnit, (q.y - p.y) * perUnit, (q.depth - p.depth) * perUnit, (q.w - p.w) * perUnit, (q.z - p.z) * perUnit, 1.0}};
    seen.risingVertices |= std::uint64_t{1} << from | std::uint64_t{1} << to;
  }
}

// The points that one footprint must cover, before their hull.
struct Points {
  int count = 0;
  double depthNear = kInfinity, depthFar = -kInfinity;
  glm::dvec2 xy[kMaxHull];
  Ring ring;

  void clear() noexcept {
    count = 0;
    depthNear = kInfinity;
    depthFar = -kInfinity;
  }
  void add(const glm::dvec3& ls, double) noexcept {
    if (count == kMaxHull) condense();
    xy[count++] = {ls.x, ls.y};
    depthNear = ls.z < depthNear ? ls.z : depthNear;
    depthFar = ls.z > depthFar ? ls.z : depthFar;
  }

 private:
  // Makes room where there is none: only the hull's vertices matter.
  void condense() noexcept {
    makeHull(xy, count, ring);
    glm::dvec2 hull[kMaxHull];
    for (int i = 0; i < ring.count; ++i) hull[i] = xy[ring.index[i]];
    count = ring.count;
    std::copy_n(hull, count, xy);
    if (count > kMaxHull / 2) count = simplifyHull(xy, count);
  }
};

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
  // Too many: their hull, every vertex with the least width of all, needs no fewer texels.
  void condense() noexcept {
    glm::dvec2 xy[kMaxHull];
    double least = kInfinity, depth = 0.0;
    for (int i = 0; i < served->count; ++i) {
      xy[i] = glm::dvec2(served->points[i]);
      least = std::min(least, served->pixels[i]);
      depth += served->points[i].z / served->count;
    }
    Ring ring;
    makeHull(xy, served->count, ring);
    glm::dvec2 hull[kMaxHull];
    int count = ring.count;
    for (int i = 0; i < count; ++i) hull[i] = xy[ring.index[i]];
    if (count > kMaxHull / 2) count = simplifyHull(hull, count);
    served->count = count;
    for (int i = 0; i < count; ++i) {
      served->points[i] = glm::dvec3(hull[i], depth);
      served->pixels[i] = least;
    }
  }
};

// Gives the part of a cell inside a slab to the points: where its edges enter and leave it. All slices of a view volume give their
// points in the same order.
template <class Sink>
void addSlab(Sink& points, const SeenCell& seen, double slabNear, double slabFar) noexcept {
  const auto add = [&](double x, double y, double depth, double w, double z) {
    if (w == 1.0)  // a directional light has no perspective
      points.add({x, y, depth}, z);
    else
      points.add(glm::dvec3(x, y, depth) / w, z);
  };
  const auto addVertex = [&](const Seen& v) { add(v.x, v.y, v.depth, v.w, v.z); };
  std::uint64_t added = seen.risingVertices;
  if (std::popcount(added) != seen.vertexCount)
    for (int i = 0; i < seen.vertexCount; ++i)
      if (const double along = seen.vertices[i].along; !(added >> i & 1) && along >= slabNear && along <= slabFar)
        addVertex(seen.vertices[i]);
  added = 0;
  const auto addEnd = [&](const Rising& edge, int end, double along) {
    if (seen.vertices[end].along == along) {
      if (!(added >> end & 1)) addVertex(seen.vertices[end]);
      added |= std::uint64_t{1} << end;
      return;
    }
    const Seen& from = seen.vertices[edge.from];
    const double t = along - from.along;
    add(from.x + edge.slope.x * t, from.y + edge.slope.y * t, from.depth + edge.slope.depth * t, from.w + edge.slope.w * t,
        from.z + edge.slope.z * t);
  };
  for (int i = 0; i < seen.risingCount; ++i) {
    const Rising& edge = seen.rising[i];
    const double from = seen.vertices[edge.from].along, to = seen.vertices[edge.to].along;
    if (from > slabFar || to < slabNear) continue;
    addEnd(edge, edge.from, from < slabNear ? slabNear : from);
    addEnd(edge, edge.to, to > slabFar ? slabFar : to);
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

// Distance from the eye to the farthest corner of a view slice.
double farthestReach(const Region& region, const DepthSpan& slab) noexcept {
  const Camera& camera = region.camera;
  const double z = std::max(std::abs(slab.near), std::abs(slab.far)), k = camera.projection == Projection::perspective ? z : 1.0;
  const double x = k * std::max(std::abs(camera.left), std::abs(camera.right)),
               y = k * std::max(std::abs(camera.down), std::abs(camera.up));
  return std::min(std::sqrt(x * x + y * y + z * z), region.reach);
}

// Cuts a cell to a wedge's sides. False where nothing is left.
bool cutToSides(Cell& cell, const Wedge& wedge) noexcept {
  for (const Plane& side : {wedge.left, wedge.right})
    if (side.normal != glm::dvec3(0.0) && cutCell(cell, side, std::abs(side.offset)) == Cut::outside) return false;
  return true;
}

bool isSame(const Plane& a, const Plane& b) noexcept { return a.normal == b.normal && a.offset == b.offset; }

// Calls visit(slice, cell seen from the light, ends of the slab to cut it to) for every slice and every part of the region that it may
// meet. slabs: of view depth, for slices. Wedges that are rows between the same sides are slabs of one cell.
template <class Visit>
void forEachSlab(const Region& region, const LightSpace& light, const Splits& splits, const DepthSpan* slabs, Visit&& visit) noexcept {
  Cell storage;
  SeenCell seen;
  for (int i = 0; i < cellCount(region); ++i) {
    const Cell* cell = getCell(region, i, storage);
    if (!cell) continue;
    if (!splits.isWedged) look(*cell, light.lsFromView, {glm::dvec3(0.0, 0.0, 1.0), 0.0}, seen);
    bool isEmpty = false;
    for (int s = 0; s < splits.count; ++s) {
      if (!splits.isWedged) {
        visit(s, seen, slabs[s].near, slabs[s].far);
        continue;
      }
      const Wedge &wedge = splits.wedges[s], &before = splits.wedges[s > 0 ? s - 1 : 0];
      const bool hasSides = wedge.left.normal != glm::dvec3(0.0) || wedge.right.normal != glm::dvec3(0.0);
      if (s == 0 || !isSame(wedge.axis, before.axis) || !isSame(wedge.left, before.left) || !isSame(wedge.right, before.right)) {
        Cell part;
        if (hasSides) copyCell(*cell, part);
        isEmpty = hasSides && !cutToSides(part, wedge);
        if (!isEmpty) look(hasSides ? part : *cell, light.lsFromView, wedge.axis, seen);
      }
      if (!isEmpty) visit(s, seen, wedge.start, wedge.end);
    }
  }
}

}  // namespace

void makeFootprints(const Region& region, const LightSpace& light, const Splits& splits, const Margin& margin, bool byViewDepth,
                    Footprint* footprints) noexcept {
  for (int s = 0; s < splits.count; ++s) {
    Footprint& footprint = footprints[s];
    footprint.count = 0;
    footprint.depthNear = footprint.depthFar = 0.0;
    footprint.padded = padSlice(region, splits, s, margin, byViewDepth);
    footprint.reach = farthestReach(region, footprint.padded);
  }
  DepthSpan slabs[kMaxPartitions];
  for (int s = 0; s < splits.count; ++s) slabs[s] = footprints[s].padded;
  if (cellCount(region) == 1) {
    Points points;
    forEachSlab(region, light, splits, slabs, [&](int s, const SeenCell& seen, double near, double far) {
      points.clear();
      addSlab(points, seen, near, far);
      if (points.count > 0) finish(points, footprints[s]);
    });
    return;
  }
  Points points[kMaxPartitions];
  forEachSlab(region, light, splits, slabs,
              [&](int s, const SeenCell& seen, double near, double far) { addSlab(points[s], seen, near, far); });
  for (int s = 0; s < splits.count; ++s)
    if (points[s].count > 0) finish(points[s], footprints[s]);
}

void gatherServed(const Region& region, const LightSpace& light, const Splits& splits, Served* served) noexcept {
  for (int s = 0; s < splits.count; ++s) served[s].count = 0;
  forEachSlab(region, light, splits, splits.slices, [&](int s, const SeenCell& seen, double near, double far) {
    ServedPoints points{region.pixelSlope, region.pixelBase, &served[s]};
    addSlab(points, seen, near, far);
  });
}

}  // namespace gnomon
