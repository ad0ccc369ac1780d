#include "gnomon/error.h"

#include "numeric.h"

namespace gnomon {
namespace {

glm::dvec3 rowOf(const glm::mat4& m, int row) noexcept { return {m[0][row], m[1][row], m[2][row]}; }

// s and t: rows of the Jacobian, texels per world unit. Clip x and y run over 2 in width and height texels.
TexelError texelOf(const glm::dvec3& s, const glm::dvec3& t, const glm::dvec3& directionWs) noexcept {
  const glm::dvec3 sFlat = glm::cross(s, directionWs), tFlat = glm::cross(t, directionWs);  // lengths on the light plane
  const double determinant = std::abs(glm::dot(s, tFlat));
  if (!(determinant > 0.0)) return {kInfinity, kInfinity, kInfinity};
  // Edges of the parallelogram that the inverse Jacobian maps a texel to, and its largest singular value:
  // sigma_max of the Jacobian over the determinant. sigma_max^2 = (S + T + sqrt((S - T)^2 + 4 (s.t)^2)) / 2, S and T the squared lengths.
  const double ss = glm::dot(sFlat, sFlat), tt = glm::dot(tFlat, tFlat);
  const double st = glm::dot(sFlat, tFlat), root = std::sqrt((ss - tt) * (ss - tt) + 4.0 * st * st);
  const double perDeterminant = 1.0 / determinant;
  return {std::sqrt(tt) * perDeterminant, std::sqrt(ss) * perDeterminant, std::sqrt((ss + tt + root) / 2.0) * perDeterminant};
}

// A width and its logarithm.
struct Width {
  double value, log;
};

// The mean of 1/x between two widths: their logarithms' divided difference.
double meanInverse(const Width& a, const Width& b) noexcept {
  const double sum = a.value + b.value, x = (b.value - a.value) / sum, xx = x * x;
  constexpr double kSeries = 1e-3;  // of x^2: below it the logarithms cancel, and the series of 2 artanh x is exact to 1e-16
  if (xx > kSeries) return (b.log - a.log) / (b.value - a.value);
  return 2.0 / sum * (1.0 + xx * (1.0 / 3.0 + xx * (1.0 / 5.0 + xx * (1.0 / 7.0 + xx / 9.0))));
}

// The integral of 1/w^2 over a triangle on which w is linear, over twice its area: the second divided difference of -ln w at the
// corners (Hermite and Genocchi).
double meanInverseSquare(Width a, Width b, Width c) noexcept {
  if (b.value < a.value) std::swap(a, b);
  if (c.value < b.value) std::swap(b, c);
  if (b.value < a.value) std::swap(a, b);
  constexpr double kSeries = 1e-2;  // relative: above it the differences lose 1e-13, below it the series below is exact to 1e-14
  if (c.value - a.value > kSeries * a.value) return (meanInverse(a, b) - meanInverse(b, c)) / (c.value - a.value);
  // In deviations from the mean, whose sum is zero: -ln(1 + x) = sum of (-x)^j / j, each power giving the complete symmetric polynomial.
  const double mean = (a.value + b.value + c.value) / 3.0, perMean = 1.0 / mean;
  const double x = (a.value - mean) * perMean, y = (b.value - mean) * perMean, z = (c.value - mean) * perMean;
  const double square = (x * x + y * y + z * z) / 2.0, cube = x * y * z;
  return perMean * perMean * (0.5 + square / 4.0 - cube / 5.0 + square * square / 6.0 - square * cube * 2.0 / 7.0);
}

// What one convex cell needs, and the rectangle its shadow fills on the light plane.
struct CellLimit {
  glm::dvec2 least, most;
  double texels;
};

bool meet(const CellLimit& a, const CellLimit& b) noexcept {
  return a.least.x < b.most.x && b.least.x < a.most.x && a.least.y < b.most.y && b.least.y < a.most.y;
}

// View depth is linear along a light ray, so it is least on the faces that the ray enters by where it grows, else on those it leaves
// by; over each of them, in triangles, the integral of 1/w_i^2 is closed.
CellLimit limitOfCell(const Region& region, const LightSpace& light, const Cell& cell) noexcept {
  const auto widthAt = [&](int v) { return region.pixelBase + region.pixelSlope * cell.vertices[v].z; };
  double narrowest = kInfinity;
  for (int v = 0; v < cell.vertexCount; ++v) narrowest = std::min(narrowest, widthAt(v));
  const double scale = 1.0 / narrowest;  // all in units of the narrowest pixel: no square overflows
  glm::dvec2 at[kMaxCellVertices];
  Width widths[kMaxCellVertices];
  CellLimit limit{glm::dvec2(kInfinity), glm::dvec2(-kInfinity), 0.0};
  const glm::dvec2 x(light.lsFromView[0]), y(light.lsFromView[1]), z(light.lsFromView[2]);  // a directional light has no perspective
  for (int v = 0; v < cell.vertexCount; ++v) {
    const glm::dvec3& vs = cell.vertices[v];
    const glm::dvec2 ls = vs.x * x + vs.y * y + vs.z * z;
    limit.least = glm::min(limit.least, ls);
    limit.most = glm::max(limit.most, ls);
    at[v] = ls * scale;
    const double width = widthAt(v) * scale;
    widths[v] = {width, std::log(width)};
  }
  if (!cell.isExact) return limit;  // it holds more than it should: nothing is known of what must be shadowed
  const double sign = light.directionVs.z >= 0.0 ? 1.0 : -1.0;
  int corner[kMaxCellPlanes];  // of each face that counts, once one is known; kUnknown before
  constexpr int kUnknown = -1, kBehind = -2;
  for (int face = 0; face < cell.planeCount; ++face)
    corner[face] = glm::dot(cell.planes[face].normal, light.directionVs) * sign > 0.0 ? kUnknown : kBehind;
  for (int i = 0; i < cell.edgeCount; ++i) {
    const int from = cell.edges[i].from, to = cell.edges[i].to;
    for (const int face : {cell.edges[i].left, cell.edges[i].right}) {
      const int tip = corner[face];
      if (tip == kUnknown) corner[face] = from;
      if (tip < 0 || tip == from || tip == to) continue;
      const double twiceArea = std::abs(cross2(at[from] - at[tip], at[to] - at[tip]));
      limit.texels += twiceArea * meanInverseSquare(widths[tip], widths[from], widths[to]);
    }
  }
  return limit;
}

// The volume of a camera, that nothing cut.
bool isWhole(const Region& region) noexcept { return region.volume.isExact && region.volume.planeCount == 6 && region.reach == kInfinity; }

// The same for a whole view, closed: the image's cap, and the sides that count, on each of which the integral over depth is ln(f/n) in
// perspective.
double limitOfView(const Region& region, const LightSpace& light) noexcept {
  const Camera& camera = region.camera;
  const bool isPerspective = camera.projection == Projection::perspective;
  const double slope = isPerspective ? 1.0 : 0.0, perPixel = 1.0 / (region.pixelBase + region.pixelSlope);  // at depth 1
  const double width = (camera.left + camera.right) * perPixel, height = (camera.down + camera.up) * perPixel;
  const double length = (isPerspective ? std::log(region.far / region.near) : region.far - region.near) * perPixel;
  const glm::dvec3 l = light.directionVs.z >= 0.0 ? light.directionVs : -light.directionVs;
  const auto facing = [&](double across, double side) { return std::max(across + side * slope * l.z, 0.0); };
  const double sides =
      height * (facing(l.x, camera.left) + facing(-l.x, camera.right)) + width * (facing(l.y, camera.down) + facing(-l.y, camera.up));
  return width * height * l.z + length * sides;
}

// Cuts a cell to what a map serves, closed. False where nothing is left.
bool cutToMap(const Region& region, const Partition& map, Cell& cell) noexcept {
  if (cutCell(cell, {{0.0, 0.0, 1.0}, -map.near}, std::abs(map.near)) == Cut::outside) return false;
  if (cutCell(cell, {{0.0, 0.0, -1.0}, map.far}, std::abs(map.far)) == Cut::outside) return false;
  for (int i = 0; i < map.planeCount; ++i) {
    const glm::dvec3 normal(map.planes[i]);
    const double atEye = glm::dot(normal, region.eyeWs), size = std::abs(atEye) + std::abs(map.planes[i].w) + std::abs(region.far);
    constexpr double kRounding = 1e-12;  // two maps' planes are the same but for this
    if (cutCell(cell, {normal * region.worldFromView, atEye + map.planes[i].w + kRounding * size}, size) == Cut::outside) return false;
  }
  return true;
}

// True where points span no more than a line.
bool isLine(const glm::dvec3* points, int count) noexcept {
  constexpr double kThin = 1e-9;  // relative
  glm::dvec3 along(0.0);
  for (int i = 1; i < count; ++i)
    if (const glm::dvec3 d = points[i] - points[0]; glm::dot(d, d) > glm::dot(along, along)) along = d;
  double across = 0.0;
  for (int i = 1; i < count; ++i) {
    const glm::dvec3 area = glm::cross(along, points[i] - points[0]);
    across = std::max(across, glm::dot(area, area));
  }
  const double squared = glm::dot(along, along) * kThin;
  return !(across > squared * squared);
}

}  // namespace

TexelError texelSize(const glm::mat4& clipFromWorld, const glm::ivec4& viewport, const glm::dvec3& directionWs) noexcept {
  return texelOf(rowOf(clipFromWorld, 0) * (viewport.z / 2.0), rowOf(clipFromWorld, 1) * (viewport.w / 2.0), directionWs);
}

TexelError plainTexelSize(const glm::mat4& clipFromWorld, const glm::ivec4& viewport) noexcept {
  const auto edge = [&](int row, int texels) {
    const glm::dvec3 gradient = rowOf(clipFromWorld, row);
    return 2.0 / (texels * std::sqrt(glm::dot(gradient, gradient)));
  };
  const double s = edge(0, viewport.z), t = edge(1, viewport.w);
  return {s, t, std::max(s, t)};
}

TexelError texelSize(const glm::mat4& clipFromWorld, const glm::ivec4& viewport, const glm::dvec3& directionWs,
                     const glm::dvec3& point) noexcept {
  const glm::dvec4 clip = glm::dmat4(clipFromWorld) * glm::dvec4(point, 1.0);
  const glm::dvec3 wRow = rowOf(clipFromWorld, 3);
  const auto gradient = [&](int row, int texels) {
    return (rowOf(clipFromWorld, row) - wRow * (clip[row] / clip.w)) * (texels / (2.0 * clip.w));
  };
  return clip.w > 0.0 ? texelOf(gradient(0, viewport.z), gradient(1, viewport.w), directionWs)
                      : TexelError{kInfinity, kInfinity, kInfinity};
}

TexelError certify(const TexelError& size, double pixelWidthAtNear) noexcept {
  constexpr double kInflation = 1.0 + 1e-6;
  const double scale = kInflation / pixelWidthAtNear;
  return {size.s * scale, size.t * scale, size.extent * scale};
}

TexelError certify(const glm::mat4& clipFromWorld, const glm::ivec4& viewport, const LightSpace& light, const glm::dvec3& eyeMinusOriginWs,
                   const Served& served) noexcept {
  // The emitted rows in light space (from the eye), in texels.
  const glm::dmat3 lsFromWorld(light.lsFromWorld);
  const glm::dmat4 m(clipFromWorld);
  const auto row = [&](int r) {
    const glm::dvec3 ws(m[0][r], m[1][r], m[2][r]);
    return glm::dvec4(lsFromWorld * ws, m[3][r] + glm::dot(ws, eyeMinusOriginWs));
  };
  const glm::dvec4 s = row(0) * (viewport.z / 2.0), t = row(1) * (viewport.w / 2.0), wRow = row(3);
  // A texel's edges at a point are w a / D and w b / D, turned by a right angle, with the vectors a = w grad t - t grad w and
  // b = w grad s - s grad w, which are affine in the point like w and w_i, and D constant. Every point served is a mean of the
  // vertices, sum of c_i v_i, and w a = sum over i, j of c_i c_j (w_i a_j + w_j a_i) / 2
  // while w_i = sum of c_i c_j (pixel_i + pixel_j) / 2: so the greatest |w_i a_j + w_j a_i| / (pixel_i + pixel_j) over all pairs bounds
  // |w a| / w_i everywhere (Bernstein's form). i = j are the vertices themselves, and where w grows no faster than pixels they are the
  // greatest: of the square, at most w_i^2 |a_j|^2 + w_j^2 |a_i|^2 + 2 w_i |a_i| w_j |a_j|, the last term is at most
  // 2 m pixel_i pixel_j, m being the greatest over vertices.
  struct Vertex {
    glm::dvec2 a, b;
    glm::dvec3 norm;  // |a|^2, |b|^2 and the largest singular value of both, squared
    double w, wSquared, pixel, pixelSquared;
  };
  const auto normOf = [](const glm::dvec2& a, const glm::dvec2& b) {
    const double aa = glm::dot(a, a), bb = glm::dot(b, b), ab = glm::dot(a, b);
    return glm::dvec3(aa, bb, (aa + bb + std::sqrt((aa - bb) * (aa - bb) + 4.0 * ab * ab)) / 2.0);
  };
  Vertex vertices[kMaxHull];
  glm::dvec3 squared(0.0);
  double determinant = kInfinity;
  for (int i = 0; i < served.count; ++i) {
    const glm::dvec4 p(served.points[i], 1.0);
    Vertex& v = vertices[i];
    v.w = glm::dot(wRow, p);
    v.a = v.w * glm::dvec2(t) - glm::dot(t, p) * glm::dvec2(wRow);
    v.b = v.w * glm::dvec2(s) - glm::dot(s, p) * glm::dvec2(wRow);
    v.norm = normOf(v.a, v.b);
    v.wSquared = v.w * v.w;
    v.pixel = served.pixels[i];
    v.pixelSquared = v.pixel * v.pixel;
    squared = glm::max(squared, v.norm * (v.wSquared / v.pixelSquared));
    determinant = std::min(determinant, std::abs(v.b.x * v.a.y - v.b.y * v.a.x) / v.w);
    if (!(v.w > 0.0)) determinant = 0.0;
  }
  if (!(determinant > 0.0 && served.count > 0)) return {kInfinity, kInfinity, kInfinity};
  for (int i = 0; i < served.count; ++i)
    for (int j = 0; j < i; ++j) {
      const Vertex &v = vertices[i], &u = vertices[j];
      const glm::dvec3 most = v.wSquared * u.norm + u.wSquared * v.norm, enough = squared * (v.pixelSquared + u.pixelSquared);
      if (most.x <= enough.x && most.y <= enough.y && most.z <= enough.z) continue;
      const double pixels = v.pixel + u.pixel;
      squared = glm::max(squared, normOf(v.w * u.a + u.w * v.a, v.w * u.b + u.w * v.b) / (pixels * pixels));
    }
  constexpr double kInflation = 1.0 + 1e-6;
  squared = glm::sqrt(squared) * (kInflation / determinant);
  return {squared.x, squared.y, squared.z};
}

double limitTexels(const Region& region, const LightSpace& light) noexcept {
  if (region.volume.vertexCount == 0) return 0.0;
  if (region.receivers.empty()) return isWhole(region) ? limitOfView(region, light) : limitOfCell(region, light, region.volume).texels;
  // Of several cells: a set whose shadows do not meet, so that what each needs adds up. A cell that meets some of the set takes their
  // place where it needs more than all of them: the sum never falls, and no cell needs more than it.
  constexpr int kMost = 64;
  CellLimit apart[kMost];
  int count = 0;
  Cell storage;
  for (int i = 0; i < cellCount(region); ++i) {
    const Cell* cell = getCell(region, i, storage);
    if (!cell) continue;
    const CellLimit added = limitOfCell(region, light, *cell);
    double met = 0.0;
    for (int k = 0; k < count; ++k) met += meet(apart[k], added) ? apart[k].texels : 0.0;
    if (!(added.texels > met)) continue;
    CellLimit* const end = std::remove_if(apart, apart + count, [&](const CellLimit& each) { return meet(each, added); });
    count = static_cast<int>(end - apart);
    if (count < kMost) {
      apart[count++] = added;
      continue;
    }
    CellLimit* const least = std::min_element(apart, end, [](const CellLimit& a, const CellLimit& b) { return a.texels < b.texels; });
    if (added.texels > least->texels) *least = added;
  }
  double sum = 0.0;
  for (int k = 0; k < count; ++k) sum += apart[k].texels;
  return sum;
}

TexelCost texelCost(const Partition& map, const ImageSize& image) noexcept {
  const double texels = static_cast<double>(map.viewport.z) * map.viewport.w, widest = std::max(map.error.s, map.error.t);
  const double needed = map.error.s * map.error.t * texels;
  return {map.error.extent, needed, widest * widest * texels, needed / (image.width * image.height)};
}

TexelCost texelCost(const Solution& solution, const ImageSize& image) noexcept {
  TexelCost cost;
  double texels = 0.0;
  for (int i = 0; i < solution.partitionCount; ++i) {
    const Partition& map = solution.partitions[i];
    cost.extent = std::max(cost.extent, map.error.extent);
    texels += static_cast<double>(map.viewport.z) * map.viewport.w;
  }
  cost.needed = solution.neededTexels;
  cost.spent = texels * solution.maxError * solution.maxError;
  cost.storageFactor = cost.needed / (image.width * image.height);
  return cost;
}

double seamJump(const Frame& frame, const Solution& solution, int first, int second) noexcept {
  const int last = std::max(first, second);
  if (!(std::min(first, second) >= 0 && last < solution.partitionCount) || first == second) return 0.0;
  Region region;
  int index = 0;
  double value = 0.0, most = 0.0;
  if (makeRegion(frame, region, index, value) != Status::ok) return 0.0;
  const glm::dvec3 directionWs = unit(frame.light.directionWs), eyeMinusOrigin = region.eyeWs - solution.originWs;
  const Partition *a = &solution.partitions[first], *b = &solution.partitions[second];
  const auto consider = [&](const glm::dvec3& vs) {
    const glm::dvec3 point = region.worldFromView * vs + eyeMinusOrigin;
    const auto widest = [&](const Partition& map) {
      const TexelError texel = texelSize(map.clipFromWorld, map.viewport, directionWs, point);
      return std::max(texel.s, texel.t);
    };
    const double ratio = widest(*a) / widest(*b);  // a pixel's width is the same on both sides
    if (std::isfinite(ratio) && ratio > 0.0) most = std::max({most, ratio, 1.0 / ratio});
  };
  Cell storage, seam;
  for (int i = 0; i < cellCount(region); ++i) {
    const Cell* cell = getCell(region, i, storage);
    if (!cell) continue;
    copyCell(*cell, seam);
    if (!cutToMap(region, *a, seam) || !cutToMap(region, *b, seam) || isLine(seam.vertices, seam.vertexCount)) continue;
    for (int v = 0; v < seam.vertexCount; ++v) {
      consider(seam.vertices[v]);
      for (int u = 0; u < v; ++u)
        for (const double share : {0.0625, 0.125, 0.25, 0.5, 0.75, 0.875, 0.9375})
          consider(seam.vertices[u] + (seam.vertices[v] - seam.vertices[u]) * share);
    }
  }
  return most;
}

}  // namespace gnomon
