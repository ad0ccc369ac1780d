#include "gnomon/warp.h"

#include "numeric.h"

namespace gnomon {
namespace {

// How far the frame's centre lies, as kappa: e^kappa is w at the far end over w at the near one.
// e^kappa - 1 = D / n', with D / n = r - 1 and n' by eq. 11.
double kappaOf(const WarpSettings& settings, double ratio) noexcept {
  const double eta = settings.warp == Warp::lispsm ? 0.0 : settings.warp == Warp::psm ? 1.0 : settings.eta;
  if (settings.warp == Warp::none || !(ratio > 1.0)) return 0.0;
  if (settings.warp == Warp::tsm) {
    // s = U (1 + d L) / (L (1 + d U)) is 0.8 where U / L = 1 / (sqrt(r) + 1), the point of width sqrt(W0 W1).  [Lloyd 2006, sec. 4.1]
    return std::log1p(std::min(4.0 * std::sqrt(ratio) - 1.0, ratio - 1.0));
  }
  return std::log1p((ratio - 1.0) / warpDistance(eta, ratio));
}

// Frame of the vertices along an axis.
struct Ends {
  double least = kInfinity, most = -kInfinity;  // of U
  double nearWidth, farWidth;  // W0, W1
};

// The pixel widths at the ends of the frame. The vertex at an end decides, but a narrower one close by pulls the width down to a line of
// the frame's mean growth through it: else W0 would jump whenever another vertex comes to be the last.
Ends findEnds(const Served& served, const glm::dvec2& axis) noexcept {
  Ends ends;
  double narrowest = kInfinity, widest = 0.0;
  for (int i = 0; i < served.count; ++i) {
    const double u = glm::dot(axis, glm::dvec2(served.points[i]));
    ends.least = std::min(ends.least, u);
    ends.most = std::max(ends.most, u);
    narrowest = std::min(narrowest, served.pixels[i]);
    widest = std::max(widest, served.pixels[i]);
  }
  ends.nearWidth = ends.farWidth = widest;
  const double growth = (widest - narrowest) / (ends.most - ends.least);
  if (!std::isfinite(growth)) return ends;
  for (int i = 0; i < served.count; ++i) {
    const double u = glm::dot(axis, glm::dvec2(served.points[i]));
    ends.nearWidth = std::min(ends.nearWidth, served.pixels[i] + growth * (u - ends.least));
    ends.farWidth = std::min(ends.farWidth, served.pixels[i] + growth * (ends.most - u));
  }
  return ends;
}

// The wedge that the footprint fills, seen from the eye's projection (the origin).
struct Spread {
  bool isOneSided = false;  // the eye projects outside
  glm::dvec2 bisector{0.0};
  double halfTangent = 0.0;  // tangent of half its angle
};

Spread findSpread(const Footprint& footprint) noexcept {
  Spread spread;
  glm::dvec2 first = footprint.hull[0], last = first;
  for (int i = 0; i < footprint.count; ++i) {
    const glm::dvec2 p = footprint.hull[i], q = footprint.hull[i + 1 < footprint.count ? i + 1 : 0];
    spread.isOneSided |= cross2(p, q) < 0.0;
    if (cross2(first, p) < 0.0) first = p;
    if (cross2(last, p) > 0.0) last = p;
  }
  const double a = std::sqrt(glm::dot(first, first)), b = std::sqrt(glm::dot(last, last));
  if (!(a > 0.0 && b > 0.0)) return {};
  const glm::dvec2 sum = first / a + last / b;
  const double length = std::sqrt(glm::dot(sum, sum));
  spread.isOneSided &= length > 0.0;
  if (!spread.isOneSided) return spread;
  constexpr double kMostTangent = 8.238;  // of 1.45 radians
  spread.bisector = sum / length;
  spread.halfTangent = std::min(std::sqrt(std::max(4.0 - length * length, 0.0)) / length, kMostTangent);
  return spread;
}

double angleOf(const glm::dvec2& v) noexcept { return std::atan2(v.y, v.x); }

// Candidates, then a compass search from the best of them.
class Search {
 public:
  Search(const Served& served, double rectangleTexels, const WarpShape& rectangle) noexcept
      : served_(served), texels_(rectangleTexels), shape_(rectangle) {}

  void consider(const WarpShape& shape) noexcept {
    ++trials_;
    const double texels = shape.kappa >= 0.0 ? neededTexels(served_, shape) : kInfinity;
    if (!(texels < texels_)) return;
    texels_ = texels;
    shape_ = shape;
  }

  // Tries both ways along each parameter; moves to the best, and once more as far; halves the steps where nothing gains.
  void refine(double logRatio, int mostTrials) noexcept {
    WarpShape step{0.15, 0.08 * logRatio, 0.2, 0.15};
    constexpr double kLeastStep = 1e-3;  // radians: the optimum is flat
    constexpr double WarpShape::*kParameters[4] = {&WarpShape::phi, &WarpShape::kappa, &WarpShape::sigma, &WarpShape::tau};
    while (trials_ < mostTrials && step.phi > kLeastStep) {
      const WarpShape from = shape_;
      const double before = texels_;
      for (const auto parameter : kParameters)
        for (const double sign : {-1.0, 1.0}) {
          WarpShape shape = from;
          shape.*parameter += sign * (step.*parameter);
          consider(shape);
        }
      if (texels_ < before) {
        WarpShape beyond = shape_;
        for (const auto parameter : kParameters) beyond.*parameter += shape_.*parameter - from.*parameter;
        consider(beyond);
      } else {
        for (const auto parameter : kParameters) step.*parameter /= 2.0;
      }
    }
  }

  const WarpShape& shape() const noexcept { return shape_; }
  double texels() const noexcept { return texels_; }

 private:
  const Served& served_;
  double texels_;
  WarpShape shape_;
  int trials_ = 0;
};

// One-point maps along an axis, and for a footprint to one side of the eye two-point ones whose apex lies on it.
void considerAxis(Search& search, const glm::dvec2& axis, const Spread& spread, double logRatio) noexcept {
  const double phi = angleOf(axis);
  for (const double share : {0.47, 0.55, 0.65}) search.consider({phi, share * logRatio, 0.0, 0.0});
  if (!spread.isOneSided) return;
  for (const double share : {1.0, 1.8, 2.6}) {
    const double x = std::max(spread.halfTangent * share, 0.2);
    for (const double sigma : {x, -x})
      for (const double kappa : {0.53, 0.6}) search.consider({phi, kappa * logRatio, sigma, x > 0.45 ? -1.0 / sigma : -0.9 * sigma});
  }
}

// The recipe's candidates: the projected view direction, the wedge's bisector, and the normals of the image's projected sides.
void considerAll(Search& search, const LightSpace& light, const Spread& spread, double logRatio) noexcept {
  const glm::dvec2 view(light.lsFromView[2]);
  const double length = std::sqrt(glm::dot(view, view));
  if (length > 0.0) considerAxis(search, view / length, spread, logRatio);
  if (spread.isOneSided) considerAxis(search, spread.bisector, spread, logRatio);
  for (int side = 0; side < 2; ++side) {
    glm::dvec2 normal(-light.lsFromView[side].y, light.lsFromView[side].x);
    if (glm::dot(normal, view) < 0.0) normal = -normal;
    if (!(glm::dot(normal, normal) > 0.0)) continue;
    const double phi = angleOf(normal);
    if (spread.isOneSided)
      for (const double share : {0.5, 0.65}) search.consider({phi, share * logRatio, 0.0, 0.0});
    else
      for (const double share : {0.12, 0.25, 0.4, 0.55}) search.consider({phi, share * logRatio, 0.0, 0.0});
  }
  if (!spread.isOneSided && length > 0.0)
    for (const double share : {0.12, 0.25, 0.37}) search.consider({angleOf(view), share * logRatio, 0.0, 0.0});
}

bool isWarp(const WarpShape& shape) noexcept { return shape.kappa > 0.0 || shape.sigma != 0.0 || shape.tau != 0.0; }

// The rows of a shape, and its extent over the footprint.
void shapeFit(const WarpShape& shape, const Footprint& footprint, const Served& served, MapFit& fit) noexcept {
  const glm::dvec2 along(std::cos(shape.phi), std::sin(shape.phi)), across(-along.y, along.x);
  double from = kInfinity, to = -kInfinity;
  for (int i = 0; i < footprint.count; ++i) {
    const double u = glm::dot(along, footprint.hull[i]);
    from = std::min(from, u);
    to = std::max(to, u);
  }
  const double d = std::expm1(shape.kappa) / (to - from);
  fit.isWarped = true;
  fit.w = glm::dvec3(along * d, 1.0 - d * from);
  fit.s = glm::dvec3(along + across * shape.tau, -from);
  fit.t = glm::dvec3(across + along * shape.sigma, -shape.sigma * from);
  if (1.0 - shape.sigma * shape.tau < 0.0) fit.t = -fit.t;
  const auto extent = [&] {
    glm::dvec2 least(kInfinity), most(-kInfinity);
    for (int i = 0; i < footprint.count; ++i) {
      const glm::dvec3 p(footprint.hull[i], 1.0);
      const glm::dvec2 st = glm::dvec2(glm::dot(fit.s, p), glm::dot(fit.t, p)) / glm::dot(fit.w, p);
      least = glm::min(least, st);
      most = glm::max(most, st);
    }
    fit.least = least;
    fit.size = most - least;
  };
  extent();
  // Edges of a unit of s and of t: w |w grad t - t grad w| / det and the same with s, on the light plane.
  const double determinant = glm::dot(glm::cross(fit.s, fit.t), fit.w);
  glm::dvec2 widest(0.0), stretch(0.0);
  for (int i = 0; i < served.count; ++i) {
    const glm::dvec3 p(served.points[i].x, served.points[i].y, 1.0);
    const double w = glm::dot(fit.w, p);
    const glm::dvec3 s = w * fit.s - glm::dot(fit.s, p) * fit.w, t = w * fit.t - glm::dot(fit.t, p) * fit.w;
    const glm::dvec2 edge = glm::dvec2(std::hypot(t.x, t.y), std::hypot(s.x, s.y)) * (w / determinant);
    stretch = glm::max(stretch, edge);
    widest = glm::max(widest, edge / served.pixels[i]);
  }
  fit.stretch = stretch;
  fit.aspect = widest.x * fit.size.x / (widest.y * fit.size.y);
  if (fit.aspect >= 1.0) return;
  // Lying rectangles shelve better: turn by a right angle.
  const glm::dvec3 s = fit.s;
  fit.s = fit.t;
  fit.t = -s;
  fit.least = {fit.least.y, -(fit.least.x + fit.size.x)};
  fit.size = {fit.size.y, fit.size.x};
  fit.stretch = {fit.stretch.y, fit.stretch.x};
  fit.aspect = 1.0 / fit.aspect;
}

}  // namespace

Status validate(const WarpSettings& settings, double& value) noexcept {
  value = settings.eta;
  return settings.eta >= -1.0 && settings.eta <= 1.0 ? Status::ok : Status::warpEta;
}

double neededTexels(const Served& served, const WarpShape& shape) noexcept {
  const double c = std::cos(shape.phi), s = std::sin(shape.phi);
  double u[kMaxHull];
  double from = kInfinity, to = -kInfinity;
  for (int i = 0; i < served.count; ++i) {
    u[i] = c * served.points[i].x + s * served.points[i].y;
    from = u[i] < from ? u[i] : from;
    to = u[i] > to ? u[i] : to;
  }
  const double scale = 1.0 - shape.sigma * shape.tau;
  constexpr double kLeastScale = 0.02;  // sine-like: below it the map folds into a line
  if (!(to > from) || !(std::abs(scale) > kLeastScale)) return kInfinity;
  const double d = (shape.kappa == 0.0 ? 0.0 : std::exp(shape.kappa) - 1.0) / (to - from);
  double leastS = kInfinity, mostS = -kInfinity, leastT = kInfinity, mostT = -kInfinity, widestS = 0.0, widestT = 0.0;
  for (int i = 0; i < served.count; ++i) {
    const double along = u[i] - from, across = c * served.points[i].y - s * served.points[i].x;
    const double w = 1.0 + d * along, perW = 1.0 / w;
    const double mapS = (along + shape.tau * across) * perW, mapT = (across + shape.sigma * along) * perW;
    leastS = mapS < leastS ? mapS : leastS;
    mostS = mapS > mostS ? mapS : mostS;
    leastT = mapT < leastT ? mapT : leastT;
    mostT = mapT > mostT ? mapT : mostT;
    // Edges of a unit square, squared, but for w^2 / (1 - sigma tau).
    const double x = 1.0 - mapS * d, y = shape.sigma - mapT * d, grow = w * w / served.pixels[i], square = grow * grow;
    const double edgeT = (x * x + shape.tau * shape.tau) * square, edgeS = (y * y + 1.0) * square;
    widestS = edgeS > widestS ? edgeS : widestS;
    widestT = edgeT > widestT ? edgeT : widestT;
  }
  return (mostS - leastS) * (mostT - leastT) * std::sqrt(widestS * widestT) / (scale * scale);
}

double warpDistance(double eta, double alpha) noexcept {
  const double root = std::sqrt(alpha);
  if (eta <= 0.0) return eta > -1.0 ? ((root + 1.0) - eta * (alpha - 1.0)) / (eta + 1.0) : kInfinity;  // [Lloyd 2006, eq. 11 corrected]
  return (root + 1.0) / (eta * root + 1.0);
}

double warpEta(double distance, double alpha) noexcept {
  const double root = std::sqrt(alpha);
  if (!std::isfinite(distance)) return -1.0;
  return distance > root + 1.0 ? (root + 1.0 - distance) / (distance + alpha - 1.0) : ((root + 1.0) / distance - 1.0) / root;
}

glm::dvec2 overheadErrors(double alpha, double halfFovTangent, double distance) noexcept {
  const double share = std::isfinite(distance) ? distance / (distance + alpha - 1.0) : 1.0;  // n' / (n' + f - n)
  const double length = (alpha - 1.0) / (2.0 * halfFovTangent);
  return {alpha * share, length * (distance > std::sqrt(alpha) + 1.0 ? share : 1.0 / (share * alpha))};
}

WarpShape warpFit(const WarpSettings& settings, const LightSpace& light, const Footprint& footprint, const Served& served,
                  const glm::dvec2& axis, const WarpShape* known, MapFit& fit) noexcept {
  const WarpShape rectangle{angleOf(glm::dvec2(fit.s)), 0.0, 0.0, 0.0};
  const double thin = std::min(fit.size.x, fit.size.y);
  double narrowest = kInfinity, widest = 0.0;
  for (int i = 0; i < served.count; ++i) {
    narrowest = std::min(narrowest, served.pixels[i]);
    widest = std::max(widest, served.pixels[i]);
  }
  // A line, a point, or pixels of one width: nothing to gain.
  if (settings.warp == Warp::none || footprint.count < 3 || served.count < 3 || !(thin > 2.0 * narrowest) || !(widest > narrowest))
    return rectangle;
  if (known) {
    if (isWarp(*known)) shapeFit(*known, footprint, served, fit);
    return *known;
  }
  const double logRatio = std::log(widest / narrowest);
  Search search(served, neededTexels(served, rectangle), rectangle);
  if (settings.warp == Warp::least) {
    constexpr int kTrials = 64;  // 2 % above the optimum on average
    considerAll(search, light, findSpread(footprint), logRatio);
    search.refine(logRatio, kTrials);
  } else if (axis != glm::dvec2(0.0)) {
    const Ends ends = findEnds(served, axis);
    const bool isForward = ends.nearWidth <= ends.farWidth;
    const double ratio = isForward ? ends.farWidth / ends.nearWidth : ends.nearWidth / ends.farWidth;
    search.consider({angleOf(isForward ? axis : -axis), kappaOf(settings, ratio), 0.0, 0.0});
  }
  const WarpShape& shape = search.shape();
  if (isWarp(shape)) shapeFit(shape, footprint, served, fit);
  return shape;
}

}  // namespace gnomon
