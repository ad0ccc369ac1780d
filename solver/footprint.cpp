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

// Gives the part of a cell between two view depths to the points: where its edges enter and leave the slab. All slices of a view
// volume give their points in the same order.
template <class Sink>
void addSlab(Sink& points, const SeenCell& seen, const DepthSpan& slab) noexcept {
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
    add(from.x + edge.slope.x * t, from.y + edge.slope.y * t, from.depth + edge.slope.depth * t, from.w + edge.slope.w * t, z);
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

// Keeps of a convex polygon what lies at dot(normal, p) >= offset. At most one vertex more.  [Sutherland and Hodgman 1974]
int clipHull(glm::dvec2* hull, int count, const glm::dvec2& normal, double offset) noexcept {
  glm::dvec2 kept[kMaxHull];
  int size = 0;
  for (int i = 0; i < count; ++i) {
    const glm::dvec2 &p = hull[i], &q = hull[i + 1 < count ? i + 1 : 0];
    const double atP = glm::dot(normal, p) - offset, atQ = glm::dot(normal, q) - offset;
    if (size + 2 > kMaxHull) return count;  // no room: it covers more
    if (atP >= 0.0) kept[size++] = p;
    if ((atP >= 0.0) != (atQ >= 0.0)) kept[size++] = p + (q - p) * (atP / (atP - atQ));
  }
  std::copy_n(kept, size, hull);
  return size;
}

// Cuts a footprint to where the samples of its depths lie: never beyond the plain one. None there: it vanishes.
void cutToBounds(const Region& region, const LightSpace& light, const DepthSpan& slice, Footprint& footprint) noexcept {
  glm::dvec2 least(kInfinity), most(-kInfinity);
  for (const SampleBounds& bounds : region.bounds) {
    const double from = std::max(bounds.near - region.latency, slice.near), to = std::min(bounds.far + region.latency, slice.far);
    const bool isPoint = bounds.near == bounds.far || slice.near == slice.far;  // intervals that only touch have nothing in common
    if (!(isPoint ? from <= to : from < to)) continue;
    least = glm::min(least, bounds.least);
    most = glm::max(most, bounds.most);
  }
  // A depth value may be off along its ray by what it cannot tell apart, and bounds are sums of float32 products.
  constexpr double kBoundsRounding = 1.0 / 1048576.0;  // 2^-20 of the distance from the eye
  const double far = footprint.padded.far,
               along = region.camera.projection == Projection::perspective && far > 0.0 ? footprint.reach / far : 1.0;
  const double room = region.latency + depthQuantum(region.camera, far) * along + kBoundsRounding * footprint.reach;
  const glm::dvec3 x = planeAxis(light.directionWs), y = glm::cross(x, light.directionWs);
  for (int axis = 0; axis < 2 && footprint.count > 0; ++axis) {
    const glm::dvec2 normal(light.lsFromWorld * glm::dvec4(axis == 0 ? x : y, 0.0));
    footprint.count = clipHull(footprint.hull, footprint.count, normal, least[axis] - room);
    footprint.count = clipHull(footprint.hull, footprint.count, -normal, -(most[axis] + room));
  }
}

// Distance from the eye to the farthest corner of a view slice.
double farthestReach(const Region& region, const DepthSpan& slab) noexcept {
  const Camera& camera = region.camera;
  const double z = std::max(std::abs(slab.near), std::abs(slab.far)), k = camera.projection == Projection::perspective ? z : 1.0;
  const double x = k * std::max(std::abs(camera.left), std::abs(camera.right)),
               y = k * std::max(std::abs(camera.down), std::abs(camera.up));
  return std::min(std::sqrt(x * x + y * y + z * z), region.reach);
}

// Cuts a cell to a wedge of the light plane. False where nothing is left.
bool cutToWedge(Cell& cell, const Wedge& wedge) noexcept {
  const auto cut = [&](const glm::dvec3& normal, double offset) {
    return cutCell(cell, {normal, offset}, std::abs(offset)) != Cut::outside;
  };
  for (const Plane& side : {wedge.left, wedge.right})
    if (side.normal != glm::dvec3(0.0) && !cut(side.normal, side.offset)) return false;
  if (wedge.start > -kInfinity && !cut(wedge.axis.normal, wedge.axis.offset - wedge.start)) return false;
  return !(wedge.end < kInfinity) || cut(-wedge.axis.normal, wedge.end - wedge.axis.offset);
}

// Calls visit(slice, cell seen from the light) for every slice and every part of the region that it may meet.
template <class Visit>
void forEachCell(const Region& region, const LightSpace& light, const Splits& splits, Visit&& visit) noexcept {
  Cell storage;
  SeenCell seen;
  for (int i = 0; i < cellCount(region); ++i) {
    const Cell* cell = getCell(region, i, storage);
    if (!cell) continue;
    if (!splits.isWedged) look(*cell, light.lsFromView, seen);
    for (int s = 0; s < splits.count; ++s) {
      if (splits.isWedged) {
        Cell part;
        copyCell(*cell, part);
        if (!cutToWedge(part, splits.wedges[s])) continue;
        look(part, light.lsFromView, seen);
      }
      visit(s, seen);
    }
  }
}

}  // namespace

glm::dvec3 planeAxis(const glm::dvec3& directionWs) noexcept { return unit(glm::cross(directionWs, leastAxis(directionWs))); }

void makeFootprints(const Region& region, const LightSpace& light, const Splits& splits, const Margin& margin, bool byViewDepth,
                    Footprint* footprints) noexcept {
  for (int s = 0; s < splits.count; ++s) {
    Footprint& footprint = footprints[s];
    footprint.count = 0;
    footprint.depthNear = footprint.depthFar = 0.0;
    footprint.padded = padSlice(region, splits, s, margin, byViewDepth);
    footprint.reach = farthestReach(region, footprint.padded);
  }
  const auto keep = [&] {
    for (int s = 0; s < splits.count && !region.bounds.empty(); ++s) {
      const DepthSpan &slice = splits.slices[s], &padded = footprints[s].padded;
      cutToBounds(region, light, {margin.blend > 0.0 ? padded.near : slice.near, slice.far}, footprints[s]);
    }
  };
  if (cellCount(region) == 1) {
    Points points;
    forEachCell(region, light, splits, [&](int s, const SeenCell& seen) {
      points.clear();
      addSlab(points, seen, footprints[s].padded);
      finish(points, footprints[s]);
    });
    keep();
    return;
  }
  Points points[kMaxPartitions];
  forEachCell(region, light, splits, [&](int s, const SeenCell& seen) { addSlab(points[s], seen, footprints[s].padded); });
  for (int s = 0; s < splits.count; ++s) finish(points[s], footprints[s]);
  keep();
}

void gatherServed(const Region& region, const LightSpace& light, const Splits& splits, Served* served) noexcept {
  for (int s = 0; s < splits.count; ++s) served[s].count = 0;
  forEachCell(region, light, splits, [&](int s, const SeenCell& seen) {
    ServedPoints points{region.pixelSlope, region.pixelBase, &served[s]};
    addSlab(points, seen, splits.slices[s]);
  });
}

}  // namespace gnomon
