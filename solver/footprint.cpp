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

// True where the ring is the convex hull of these points too: it turns left everywhere, goes round once and holds the others. Writes its
// vertices.
bool isHull(const glm::dvec3* points, int count, const Ring& ring, glm::dvec2* hull) noexcept {
  if (ring.pointCount != count || ring.count < 3) return false;
  for (int i = 0; i < ring.count; ++i) hull[i] = glm::dvec2(points[ring.index[i]]);
  const glm::dvec2& end = hull[ring.count - 1];
  double least = kInfinity;  // turn
  int turns = 0;
  glm::dvec2 last = end - hull[ring.count - 2];
  for (int i = 0; i < ring.count; ++i) {
    const glm::dvec2 edge = hull[i] - (i > 0 ? hull[i - 1] : end);
    least = std::min(least, cross2(last, edge));
    turns += (last.x < 0.0) != (edge.x < 0.0);
    last = edge;
  }
  if (!(least > 0.0) || turns != 2) return false;
  for (int j = ring.count; j < count; ++j) {
    const glm::dvec2 inside(points[ring.index[j]]);
    glm::dvec2 from = end - inside;
    for (int i = 0; i < ring.count; ++i) {
      const glm::dvec2 to = hull[i] - inside;
      least = std::min(least, cross2(from, to));
      from = to;
    }
  }
  return least >= 0.0;
}

// Convex hull of the points' x and y; returns its vertices' number.  (Andrew's monotone chain)
int makeHull(const glm::dvec3* points, int count, Ring& ring, glm::dvec2* hull) noexcept {
  if (isHull(points, count, ring, hull)) return ring.count;
  std::uint8_t order[kMaxHull];
  for (int i = 0; i < count; ++i) {
    const glm::dvec2 p(points[i]);
    int j = i;
    for (; j > 0; --j) {
      const glm::dvec3& before = points[order[j - 1]];
      if (before.x < p.x || (before.x == p.x && before.y <= p.y)) break;
      order[j] = order[j - 1];
    }
    order[j] = static_cast<std::uint8_t>(i);
  }
  glm::dvec2 chain[kMaxHull + 1];
  int size = 0;
  const auto extend = [&](std::uint8_t index, int least) {
    const glm::dvec2 p(points[index]);
    while (size >= least && !(cross2(chain[size - 1] - chain[size - 2], p - chain[size - 2]) > 0.0)) --size;
    chain[size] = p;
    ring.index[size++] = index;
  };
  for (int i = 0; i < count; ++i) extend(order[i], 2);
  const int lower = size;
  for (int i = count - 2; i >= 0; --i) extend(order[i], lower + 1);
  if (size > 1) --size;  // the first point again
  if (size == 2 && chain[0] == chain[1]) size = 1;
  std::copy_n(chain, size, hull);
  ring.pointCount = count;
  ring.count = size;
  std::uint64_t isVertex = 0;
  for (int i = 0; i < ring.count; ++i) isVertex |= std::uint64_t{1} << ring.index[i];
  for (int i = 0; i < count; ++i)
    if (!(isVertex >> i & 1)) ring.index[size++] = static_cast<std::uint8_t>(i);
  return ring.count;
}
static_assert(kMaxHull <= 64);

// Makes a convex polygon of at most `most` vertices around one of more: edge by edge where it adds the least area, the neighbours of an
// edge are extended until they meet.
int simplifyHull(glm::dvec2* hull, int count, int most) noexcept {
  for (; count > most; --count) {
    const auto vertex = [&](int i) -> glm::dvec2& { return hull[i % count]; };
    int best = 0;
    double leastArea = kInfinity;
    glm::dvec2 apex = hull[0];
    for (int i = 0; i < count; ++i) {
      const glm::dvec2 before = vertex(i) - vertex(i + count - 1), edge = vertex(i + 1) - vertex(i), after = vertex(i + 2) - vertex(i + 1);
      const double turn = cross2(before, after);
      if (!(turn > 0.0)) continue;  // they never meet
      const double reach = cross2(edge, after) / turn, area = cross2(before, edge) * reach;
      if (!(area < leastArea)) continue;
      best = i;
      leastArea = area;
      apex = vertex(i) + before * reach;
    }
    if (!(leastArea < kInfinity)) return count;
    vertex(best) = apex;
    const int gone = (best + 1) % count;
    std::copy(hull + gone + 1, hull + count, hull + gone);
  }
  return count;
}

// A cell's vertex seen from the light: homogeneous, so that points between two of them may be interpolated before the division.
struct Seen {
  double x, y, depth, w, z;  // z: view depth
  double along;  // where slabs are cut: view depth for slices, a wedge's axis for its rows
};

// An edge that is not parallel to the slabs, from where `along` is less to where it is more.
struct Rising {
  std::uint8_t from, to;
  Seen start, slope;  // where it rises from; per unit of `along`
  double end;  // `along` of the other vertex
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
  for (int v = 0; v < cell.vertexCount; ++v) {
    const glm::dvec3& vs = cell.vertices[v];
    const auto row = [&](int r) { return lsFromView[0][r] * vs.x + lsFromView[1][r] * vs.y + lsFromView[2][r] * vs.z + lsFromView[3][r]; };
    seen.vertices[v] = {row(0), row(1), row(2), seen.isAffine ? 1.0 : row(3), vs.z, glm::dot(axis.normal, vs) + axis.offset};
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
        p,
        {(q.x - p.x) * perUnit, (q.y - p.y) * perUnit, (q.depth - p.depth) * perUnit, (q.w - p.w) * perUnit, (q.z - p.z) * perUnit, 1.0},
        q.along};
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
  void finish(Ring& ring, Footprint& footprint) noexcept {
    footprint.count = makeHull(ls, count, ring, footprint.hull);
    measureDepth();
    footprint.depthNear = depthNear;
    footprint.depthFar = depthFar;
  }

  // Makes the footprint a copy of an earlier one where the points are copies of its. False where they are not.
  bool finishCopy(const Points& others, const Footprint& other, double tolerance, int like, Footprint& footprint) noexcept {
    if (count != others.count) return false;
    const double scale = footprint.padded.far / other.padded.far;
    double apart = 0.0;
    for (int i = 0; i < count; ++i) {
      const glm::dvec3 gap = glm::abs(ls[i] - others.ls[i] * scale);
      apart = std::max(apart, gap.x + gap.y + gap.z);
      if (!(apart <= tolerance * scale)) return false;
    }
    footprint.like = like;
    footprint.scale = scale;
    footprint.apart = apart;
    footprint.count = other.count;
    for (int i = 0; i < other.count; ++i) footprint.hull[i] = other.hull[i] * scale;
    measureDepth();
    footprint.depthNear = depthNear;
    footprint.depthFar = depthFar;
    return true;
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
    Ring ring;
    glm::dvec2 hull[kMaxHull];
    count = makeHull(ls, count, ring, hull);
    count = simplifyHull(hull, count, kMaxHull / 2);
    for (int i = 0; i < count; ++i) ls[i] = glm::dvec3(hull[i], depthNear);
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
  // Too many: the hulls of those alike in width, every vertex with the least width of its hull, need no fewer texels.
  void condense() noexcept {
    constexpr int kBands = 4, kMost = 10;
    static_assert(kBands * kMost < kMaxHull);
    const Served all = *served;
    const auto [least, most] = std::minmax_element(all.pixels, all.pixels + all.count);
    const double ratio = std::sqrt(std::sqrt(*most / *least));  // between bands
    served->count = 0;
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
      Ring ring;
      glm::dvec2 hull[kMaxHull];
      count = simplifyHull(hull, makeHull(points, count, ring, hull), kMost);
      for (int i = 0; i < count; ++i) {
        served->points[served->count] = glm::dvec3(hull[i], depth);
        served->pixels[served->count++] = width;
      }
    }
  }
};

// Gives the part of a cell inside a slab to the points: where its edges enter and leave it. All slices of a view volume give their
// points in the same order.
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
    const Seen &from = edge.start, &slope = edge.slope;
    const double t = along - from.along;
    add(from.x + slope.x * t, from.y + slope.y * t, from.depth + slope.depth * t, from.w + slope.w * t, from.z + slope.z * t);
  };
  for (int i = 0; i < seen.risingCount; ++i) {
    const Rising& edge = seen.rising[i];
    if (edge.start.along > slab.far || edge.end < slab.near) continue;
    edge.start.along < slab.near ? addBetween(edge, slab.near) : addVertex(edge.from);
    edge.end > slab.far ? addBetween(edge, slab.far) : addVertex(edge.to);
  }
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
  Ring ring;
  glm::dvec2 hull[kMaxHull];
  const int count = corners.count > 0 ? makeHull(corners.ls, corners.count, ring, hull) : 0;
  if (count == 0) footprint.count = 0;
  for (int i = 0; i < count && footprint.count > 0; ++i) {
    const glm::dvec2 edge = hull[i + 1 < count ? i + 1 : 0] - hull[i], inwards(-edge.y, edge.x);
    footprint.count = clipHull(footprint.hull, footprint.count, inwards, glm::dot(inwards, hull[i]));
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

// Cuts a cell to a wedge's sides. False where nothing is left.
bool cutToSides(Cell& cell, const Wedge& wedge) noexcept {
  for (const Plane& side : {wedge.left, wedge.right})
    if (side.normal != glm::dvec3(0.0) && cutCell(cell, side, std::abs(side.offset)) == Cut::outside) return false;
  return true;
}

bool isSame(const Plane& a, const Plane& b) noexcept { return a.normal == b.normal && a.offset == b.offset; }

// Calls visit(slice, cell seen from the light) for every slice and every part of the region that it may meet. Wedges that are rows
// between the same sides are slabs of one cell.
template <class Visit>
void forEachCell(const Region& region, const LightSpace& light, const Splits& splits, Visit&& visit) noexcept {
  Cell storage;
  SeenCell seen;
  for (int i = 0; i < cellCount(region); ++i) {
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
                    bool mayCopy, Footprint* footprints, Served* served) noexcept {
  DepthSpan padded[kMaxPartitions];
  padSlices(region, splits, margin, byViewDepth, padded);
  for (int s = 0; s < splits.count; ++s) {
    Footprint& footprint = footprints[s];
    footprint.count = 0;
    footprint.depthNear = footprint.depthFar = 0.0;
    footprint.padded = padded[s];
    footprint.like = s;
    footprint.scale = 1.0;
    footprint.apart = 0.0;
    footprint.reach = farthestReach(region, footprint.padded);
    if (served) served[s].count = 0;
  }
  const auto slabOf = [&](int s, const DepthSpan& slice) {
    return splits.isWedged ? DepthSpan{splits.wedges[s].start, splits.wedges[s].end} : slice;
  };
  const auto addServed = [&](int s, const SeenCell& seen) {
    if (!served) return;
    ServedPoints points{region.pixelSlope, region.pixelBase, &served[s]};
    addSlab(points, seen, slabOf(s, splits.slices[s]));
  };
  Ring ring;
  const auto keep = [&] {
    for (int s = 0; s < splits.count && !region.bounds.empty(); ++s) {
      const DepthSpan& slice = splits.slices[s];
      cutToBounds(region, light, {margin.blend > 0.0 ? padded[s].near : slice.near, slice.far}, footprints[s]);
    }
  };
  if (cellCount(region) == 1) {
    Points points[2];
    Points *now = &points[0], *model = &points[1];
    int like = -1;
    double tolerance = 0.0;
    forEachCell(region, light, splits, [&](int s, const SeenCell& seen) {
      now->clear();
      addSlab(*now, seen, slabOf(s, footprints[s].padded));
      if (now->count == 0) return;
      addServed(s, seen);
      if (like >= 0 && now->finishCopy(*model, footprints[like], tolerance, like, footprints[s])) return;
      now->finish(ring, footprints[s]);
      if (!mayCopy) return;
      like = s;
      tolerance = copyTolerance(footprints[s]);
      std::swap(now, model);
    });
    keep();
    return;
  }
  Points points[kMaxPartitions];
  forEachCell(region, light, splits, [&](int s, const SeenCell& seen) {
    addSlab(points[s], seen, slabOf(s, footprints[s].padded));
    addServed(s, seen);
  });
  for (int s = 0; s < splits.count; ++s)
    if (points[s].count > 0) points[s].finish(ring, footprints[s]);
  keep();
}

}  // namespace gnomon
