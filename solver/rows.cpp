#include "gnomon/rows.h"

#include "numeric.h"

namespace gnomon {
namespace {

constexpr Plane kUnbounded{glm::dvec3(0.0), 0.0};

// The least pixel width along an axis: the lower hull of the points' widths over their coordinates.
struct Profile {
  int count = 0;
  glm::dvec2 points[kMaxHull];  // coordinate, width; coordinates rise
};

// Widths never fall: a point adds to an end of the hull, or lies above it.
void makeProfile(const RowPlane& plane, const glm::dvec2& axis, Profile& profile) noexcept {
  glm::dvec2 chain[2 * kMaxHull];
  int first = kMaxHull, last = kMaxHull;
  const auto pointOf = [&](const glm::dvec3& p) { return glm::dvec2(axis.x * p.x + axis.y * p.y, p.z); };
  const auto turn = [&](int a, int b, const glm::dvec2& p) { return cross2(chain[b] - chain[a], p - chain[a]); };
  chain[first] = pointOf(plane.seen[0]);
  for (int i = 1; i < plane.count; ++i) {
    const glm::dvec2 p = pointOf(plane.seen[i]);
    if (p.x > chain[last].x) {
      while (first < last && turn(last - 1, last, p) <= 0.0) --last;
      chain[++last] = p;
    } else if (p.x < chain[first].x) {
      while (first < last && turn(first + 1, first, p) >= 0.0) ++first;
      chain[--first] = p;
    }
  }
  profile.count = last + 1 - first;
  std::copy_n(chain + first, profile.count, profile.points);
}

// Ends of rows with equal shares of the integral of 1 / width; between two points of the profile w grows by g = dw/du and the integral from
// the first to u is log1p(g (u - u_0) / w_0) / g.
void errorRows(const RowPlane& plane, int count, RowSize* rows) noexcept {
  const Trapezoid& shape = plane.shape;
  Profile profile;
  makeProfile(plane, shape.axis, profile);
  double whole[kMaxHull] = {};
  for (int i = 1; i < profile.count; ++i) {
    const glm::dvec2 d = profile.points[i] - profile.points[i - 1];
    const double grown = d.y / profile.points[i - 1].y;
    whole[i] = whole[i - 1] + d.x / profile.points[i - 1].y * (grown == 0.0 ? 1.0 : std::log1p(grown) / grown);
  }
  double from = 0.0;
  for (int row = 0, i = 1; row < count; ++row) {
    const double share = whole[profile.count - 1] * (row + 1) / count;
    while (i + 1 < profile.count && whole[i] < share) ++i;
    double to = shape.length;
    if (row + 1 < count && i < profile.count) {
      const glm::dvec2 &a = profile.points[i - 1], d = profile.points[i] - a;
      const double g = d.y / d.x, part = share - whole[i - 1];
      to = a.x - shape.from + (g == 0.0 ? a.y * part : a.y * std::expm1(g * part) / g);
    }
    to = std::clamp(to, from, shape.length);
    rows[row] = {to - from, shape.base + 2.0 * shape.tangent * to};
    from = to;
  }
}

// The integral of 1 / width^2 along the axis, and its centre.
struct Weight {
  double sum = 0.0, centre = 0.0;
};

Weight weigh(const Profile& profile, double least) noexcept {
  const glm::dvec2& first = profile.points[0];
  Weight weight;
  double moment = 0.0;  // about the first point
  for (int i = 1; i < profile.count; ++i) {
    const glm::dvec2 &a = profile.points[i - 1], &b = profile.points[i], d = b - a;
    const double grown = d.y / a.y, share = d.x / (a.y * b.y);
    constexpr double kFlat = 1e-5;  // relative growth below which the closed form is lost in rounding
    weight.sum += share;
    moment += share * (a.x - first.x) +
              (std::abs(grown) < kFlat ? share * d.x / 2.0 : (std::log1p(grown) - grown / (1.0 + grown)) * (d.x * d.x) / (d.y * d.y));
  }
  weight.centre = first.x + (weight.sum > 0.0 ? moment / weight.sum : 0.0);
  weight.sum = std::max(weight.sum, least / (first.y * first.y));
  return weight;
}

Status makeLayout(const RowSettings& settings, const RowPlane& plane, int most, RowLayout& layout) noexcept {
  const int rows = std::min(settings.maxRows, most);
  const Trapezoid& shape = layout.shape = plane.shape;
  if (settings.rule == RowRule::error) {
    const int columns = std::min(settings.maxColumns, most);
    layout.count = std::min(rows, most / columns);
    errorRows(plane, layout.count, layout.sizes);
    std::fill_n(layout.columns, layout.count, columns);
  } else {
    layout.count = (settings.rule == RowRule::paper ? paperRows : fittedRows)(shape, settings.zeta, rows, layout.sizes);
    int total = 0;
    for (int columns = settings.maxColumns; columns > 0; --columns) {  // they give way until all fit
      total = 0;
      for (int i = 0; i < layout.count; ++i) total += layout.columns[i] = columnCount(layout.sizes[i], settings.sigma, columns);
      if (total <= most) break;
    }
  }
  layout.waste = 0.0;
  double reached = 0.0;
  for (int i = 0; i < layout.count; ++i) {
    layout.waste = std::max(layout.waste, wasteOf(layout.sizes[i], shape.tangent));
    reached += layout.sizes[i].height;
  }
  constexpr double kRounding = 1.0 - 1e-12;
  return settings.rule == RowRule::paper && !(reached >= shape.length * kRounding) ? Status::rowsReach : Status::ok;
}

void writeWedges(const Region& region, const LightSpace& light, const RowSettings& settings, const RowLayout& layout,
                 Splits& splits) noexcept {
  const Trapezoid& shape = layout.shape;
  const glm::dmat3 viewFromLs = glm::transpose(glm::dmat3(light.lsFromView));
  Rows& rows = splits.rows;
  rows.count = layout.count;
  rows.along = {viewFromLs * glm::dvec3(shape.axis, 0.0), 0.0};
  rows.across = {viewFromLs * glm::dvec3(-shape.axis.y, shape.axis.x, 0.0), 0.0};
  rows.from = shape.from;
  rows.slope = 2.0 * shape.tangent / shape.base;
  rows.growth = 0.0;
  const DepthSpan all{region.spans[0].near, region.spans[region.spanCount - 1].far};
  double start = shape.from;
  for (int i = 0; i < layout.count; ++i) {
    const RowSize& size = layout.sizes[i];
    const int columns = layout.columns[i];
    const double end = start + size.height, column = size.width / columns, left = shape.centre - size.width / 2.0;
    rows.rows[i] = {start, left, column, columns, splits.count};
    for (int c = 0; c < columns; ++c) {
      Wedge& wedge = splits.wedges[splits.count];
      rows.cells[splits.count] = splits.count;
      splits.slices[splits.count++] = all;
      wedge = {kUnbounded, kUnbounded, rows.along, i > 0 ? start : -kInfinity, i + 1 < layout.count ? end : kInfinity};
      const auto border = [&](int n) { return shape.centre + column * (n - columns / 2.0); };  // the middle one is the same in all rows
      if (c > 0) wedge.left = {rows.across.normal, -border(c)};
      if (c + 1 < columns) wedge.right = {-rows.across.normal, border(c + 1)};
    }
    start = end;
  }
  if (settings.rule == RowRule::error) return;
  rows.growth = std::log1p(rows.slope * layout.sizes[0].height);
}

}  // namespace

Trapezoid leastTrapezoid(const glm::dvec2* hull, int count, const glm::dvec2& axis, double centre, double least) noexcept {
  glm::dvec2 p[kMaxHull];  // along and across
  Pair lowest = both(kInfinity), highest = both(-kInfinity);
  int start = 0;
  for (int i = 0; i < count; ++i) {
    const Pair at = Pair{axis.x, -axis.y} * hull[i].x + Pair{axis.y, axis.x} * hull[i].y;
    p[i] = {at[0], at[1]};
    if (at[0] > highest[0]) start = i;
    lowest = lesser(at, lowest);
    highest = greater(at, highest);
  }
  const double from = lowest[0], to = highest[0], at = std::clamp(centre, from, to);  // samples' bounds may leave it outside
  // Between sides of slope m and -m it is A + B + 2 m u wide at u, where A is the greatest v - m u and B the greatest -v - m u: convex and
  // piecewise linear in m. As m rises, the vertices that the sides touch move from the greatest u to the least, edge by edge, and the width
  // falls while their mean is beyond the centre, and stays while it is there.
  const auto after = [&](int i) { return i + 1 < count ? i + 1 : 0; };
  const auto before = [&](int i) { return i > 0 ? i - 1 : count - 1; };
  const auto slopeTo = [&](int i, int j, double side) {
    const double x = p[j].x - p[i].x;
    return x < 0.0 ? side * (p[j].y - p[i].y) / x : x > 0.0 ? kInfinity : -kInfinity;
  };
  int upper = start, lower = start;
  double m = 0.0, onUpper = slopeTo(upper, after(upper), 1.0), onLower = slopeTo(lower, before(lower), -1.0);
  while (from < to && p[upper].x + p[lower].x >= 2.0 * at) {
    const double next = std::min(onUpper, onLower);
    if (!(next < kInfinity)) break;
    m = next;
    if (onUpper < onLower) {
      upper = after(upper);
      onUpper = slopeTo(upper, after(upper), 1.0);
    } else {
      lower = before(lower);
      onLower = slopeTo(lower, before(lower), -1.0);
    }
  }
  Pair most = both(-kInfinity);  // over all of them: next to edges across the axis m is all rounding
  for (int i = 0; i < count; ++i) {
    const Pair sides = {p[i].y, -p[i].y};
    most = greater(sides - both(m * p[i].x), most);
  }
  double slope = m, top = most[0], bottom = most[1];
  if (!(top + bottom + 2.0 * m * at < highest[1] - lowest[1])) {  // no less than a rectangle
    slope = 0.0;
    top = highest[1];
    bottom = -lowest[1];
  }
  const bool isTurned = slope < 0.0;  // it narrows
  const double middle = (top - bottom) / 2.0, base = top + bottom + 2.0 * slope * (isTurned ? to : from);
  return {isTurned ? -axis : axis,     isTurned ? -to : from, std::max(to - from, least),
          isTurned ? -middle : middle, std::max(base, least), std::abs(slope)};
}

int paperRows(const Trapezoid& shape, double zeta, int most, RowSize* rows) noexcept {
  const bool isNarrow = shape.tangent < zeta;  // theta < arctan(zeta)
  double width = shape.base, reached = 0.0;
  int count = 0;
  while (count < most && reached < shape.length) {
    width /= 1.0 - 2.0 * (isNarrow ? shape.tangent : zeta);
    rows[count] = {isNarrow ? width : width * zeta / shape.tangent, width};  // [Tang 2017, eq. 1]
    reached += rows[count++].height;
  }
  return count;
}

int fittedRows(const Trapezoid& shape, double zeta, int most, RowSize* rows) noexcept {
  const double slope = 2.0 * shape.tangent / shape.base, grown = std::log1p(slope * shape.length);  // of the width, its logarithm
  // Rows of eq. 1 have one ratio of width too: the whole over one is how many of them reach.
  const double one = -std::log1p(-2.0 * std::min(shape.tangent, zeta));
  constexpr double kRounding = 1.0 - 1e-12;
  const double reach = shape.tangent > 0.0 ? grown / one : shape.length / shape.base;
  const int count = std::clamp(static_cast<int>(std::min(std::ceil(reach * kRounding), static_cast<double>(most))), 1, most);
  const double growth = std::expm1(grown / count);
  double from = 0.0, height = slope > 0.0 ? growth / slope : shape.length / count;
  for (int i = 1; i <= count; ++i, height += growth * height) {
    const double to = i < count ? from + height : shape.length;
    rows[i - 1] = {to - from, shape.base + 2.0 * shape.tangent * to};
    from = to;
  }
  return count;
}

int columnCount(const RowSize& row, double sigma, int most) noexcept {
  constexpr double kRounding = 1.0 - 1e-12;
  int columns = 1;
  while (columns < most && row.height * (1.0 + sigma) * columns < row.width * kRounding) ++columns;
  return columns;
}

double wasteOf(const RowSize& row, double tangent) noexcept { return row.height * tangent / row.width; }

Status validate(const RowSettings& settings, double& value) noexcept {
  if (value = settings.zeta; !(settings.zeta > 0.0 && settings.zeta < 0.5)) return Status::rowsZeta;
  if (value = settings.sigma; !(settings.sigma > 0.0 && std::isfinite(settings.sigma))) return Status::rowsSigma;
  if (value = settings.maxRows; settings.maxRows < 1 || settings.maxRows > kMaxPartitions) return Status::rowsMaxRows;
  if (value = settings.maxColumns; settings.maxColumns < 1 || settings.maxColumns > kMaxPartitions) return Status::rowsMaxColumns;
  return Status::ok;
}

void makeRowPlane(const Region& region, const LightSpace& light, RowPlane& plane) noexcept {
  plane.count = 0;
  if (region.spanCount == 0) return;
  Splits whole;
  whole.count = 1;
  whole.isWedged = true;
  whole.rows.count = 1;
  whole.rows.along = kUnbounded;
  whole.rows.rows[0] = {-kInfinity, 0.0, 0.0, 1, 0};
  whole.slices[0] = {region.spans[0].near, region.spans[region.spanCount - 1].far};
  whole.wedges[0] = {kUnbounded, kUnbounded, kUnbounded, -kInfinity, kInfinity};
  Footprint& footprint = plane.whole;
  Served served;
  makeFootprints(region, light, whole, Margin{}, false, false, &footprint, &served);
  if (footprint.count == 0 || served.count == 0) return;
  plane.count = served.count;
  for (int i = 0; i < served.count; ++i) {
    int j = i;
    for (; j > 0 && served.pixels[i] < plane.seen[j - 1].z; --j) plane.seen[j] = plane.seen[j - 1];
    plane.seen[j] = glm::dvec3(glm::dvec2(served.points[i]), served.pixels[i]);
  }
  const double pixel = plane.seen[0].z;
  double least = kInfinity;
  for (const int side : {2, 0, 1}) {  // the view direction, the image's right and up
    const glm::dvec2 seen(light.lsFromView[side]);
    const double squared = glm::dot(seen, seen);
    if (!(squared > 0.0)) continue;
    const glm::dvec2 axis = seen / std::sqrt(squared);
    Profile profile;
    makeProfile(plane, axis, profile);
    const Weight weight = weigh(profile, pixel);
    const Trapezoid shape = leastTrapezoid(footprint.hull, footprint.count, axis, weight.centre, pixel);
    const double turn = glm::dot(shape.axis, axis) < 0.0 ? -1.0 : 1.0;
    const double along = std::clamp(turn * weight.centre - shape.from, 0.0, shape.length);
    const double texels = (shape.base + 2.0 * shape.tangent * along) * weight.sum;
    if (!(texels < least)) continue;
    least = texels;
    plane.shape = shape;
  }
}

Status splitRows(const Region& region, const LightSpace& light, const RowPlane& plane, const RowSettings& settings, int most,
                 Splits& splits, RowLayout& layout) noexcept {
  splits.count = splits.rows.count = layout.count = 0;
  splits.isWedged = true;
  if (plane.count == 0) return Status::ok;
  const Status status = makeLayout(settings, plane, most, layout);
  if (status == Status::ok) writeWedges(region, light, settings, layout, splits);
  splits.isWedged = splits.count > 1;  // one that nothing bounds is a slice, which depth selects too
  return status;
}

}  // namespace gnomon
