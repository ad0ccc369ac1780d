#include "gnomon/warp.h"

#include "numeric.h"

namespace gnomon {
namespace {

// w goes from 1 to e^kappa; where points far from the eye have w near 1 (light along the view), a float32 row leaves 8 % of it uncertain at
// this one, and maps grow by as much. Stronger warps could not be stored.
constexpr double kMostKappa = 12.0;

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

// The vertices that a map serves, as trial shapes meet them: what a shape shares with the one tried before it is kept.
class Trial {
 public:
  explicit Trial(const Served& served) noexcept : served_(served) {
    for (int i = 0; i < served.count; ++i) density_[i] = 1.0 / (served.pixels[i] * served.pixels[i]);
  }

  // The texels that a map of this shape needs.
  double texels(const WarpShape& shape) noexcept {
    if (shape.phi != phi_) turn(shape.phi);
    if (shape.kappa != kappa_) {
      kappa_ = shape.kappa;
      growth_ = shape.kappa == 0.0 ? 0.0 : std::exp(shape.kappa) - 1.0;
    }
    const double sigma = shape.sigma, tau = shape.tau, scale = 1.0 - sigma * tau;
    constexpr double kLeastScale = 0.02;  // sine-like: below it the map folds into a line
    if (!(length_ > 0.0) || !(std::abs(scale) > kLeastScale)) return kInfinity;
    const double d = growth_ / length_, dTau = d * tau, tauSquared = tau * tau;
    double leastS = kInfinity, mostS = -kInfinity, leastT = kInfinity, mostT = -kInfinity, widestS = 0.0, widestT = 0.0;
    for (int i = 0; i < served_.count; ++i) {
      const double along = along_[i], across = across_[i], w = 1.0 + d * along, perW = 1.0 / w, square = w * w;
      const double mapS = (along + tau * across) * perW, mapT = (across + sigma * along) * perW;
      leastS = mapS < leastS ? mapS : leastS;
      mostS = mapS > mostS ? mapS : mostS;
      leastT = mapT < leastT ? mapT : leastT;
      mostT = mapT > mostT ? mapT : mostT;
      // Edges of a unit square over the pixel's width, squared, but for 1 - sigma tau: x and y are w (1 - d mapS) and w (sigma - d mapT).
      const double x = 1.0 - dTau * across, y = sigma - d * across, weight = square * density_[i];
      const double edgeT = (x * x + tauSquared * square) * weight, edgeS = (y * y + square) * weight;
      widestS = edgeS > widestS ? edgeS : widestS;
      widestT = edgeT > widestT ? edgeT : widestT;
    }
    return (mostS - leastS) * (mostT - leastT) * std::sqrt(widestS * widestT) / (scale * scale);
  }

 private:
  void turn(double phi) noexcept {
    phi_ = phi;
    const double c = std::cos(phi), s = std::sin(phi);
    double from = kInfinity, to = -kInfinity;
    for (int i = 0; i < served_.count; ++i) {
      const glm::dvec3& p = served_.points[i];
      along_[i] = c * p.x + s * p.y;
      across_[i] = c * p.y - s * p.x;
      from = along_[i] < from ? along_[i] : from;
      to = along_[i] > to ? along_[i] : to;
    }
    for (int i = 0; i < served_.count; ++i) along_[i] -= from;
    length_ = to - from;
  }

  const Served& served_;
  double density_[kMaxHull], along_[kMaxHull], across_[kMaxHull];
  double phi_ = kInfinity, kappa_ = kInfinity;  // none yet
  double growth_ = 0.0, length_ = 0.0;
};

// Candidates, then a pattern search from the best few that differ in kind: the valleys of rectangles, one-point and two-point maps lie apart.
class Search {
 public:
  Search(const Served& served, const WarpShape& rectangle) noexcept : trial_(served) { consider(rectangle); }

  void consider(const WarpShape& shape) noexcept {
    Found found{shape, texels(shape)};
    const auto isAlike = [&](const Found& other) {
      return std::abs(found.shape.phi - other.shape.phi) < kAlike && std::abs(found.shape.tau - other.shape.tau) < kAlike &&
             (found.shape.kappa > 0.0) == (other.shape.kappa > 0.0);
    };
    for (int i = 0; i < count_; ++i) {  // sorted; takes the place of the first that is worse, and of any worse one of its kind
      if (!(found.texels < found_[i].texels)) {
        if (isAlike(found_[i])) return;
        continue;
      }
      const bool isReplaced = isAlike(found_[i]);
      std::swap(found, found_[i]);
      if (isReplaced) return;
    }
    if (count_ < kStarts) found_[count_++] = found;
  }

  // Tries each parameter both ways, the way that gained last first; moves on as far again where a round gained; halves the steps where none did.
  void refine(double logRatio) noexcept {
    for (int i = 0; i < count_; ++i) {
      if (!(found_[i].texels < kHopelessStart * found_[0].texels)) return;
      refine(logRatio, found_[i], kTrialsOf[i]);
      if (found_[i].texels < found_[0].texels) std::swap(found_[0], found_[i]);
    }
  }

  void refineBest(double logRatio, int trials) noexcept { refine(logRatio, found_[0], trials); }

  const WarpShape& shape() const noexcept { return found_[0].shape; }

 private:
  struct Found {
    WarpShape shape;
    double texels;
  };
  static constexpr int kStarts = 3;
  static constexpr int kTrialsOf[kStarts] = {60, 40, 20};  // from the best on: 2 % above the optimum on average (tests/warp_test.cpp)
  static constexpr double kAlike = 0.2;  // in phi and tau
  static constexpr double kHopelessStart = 1.25;  // times the best: what a refinement seldom gains

  double texels(const WarpShape& shape) noexcept {
    return shape.kappa >= 0.0 && shape.kappa <= kMostKappa ? trial_.texels(shape) : kInfinity;
  }

  void refine(double logRatio, Found& best, int trials) noexcept {
    constexpr double WarpShape::*kParameters[4] = {&WarpShape::kappa, &WarpShape::sigma, &WarpShape::tau, &WarpShape::phi};
    // Steps in proportion: a two-point map's far apex moves a lot for a little of its angle.
    const double wide = std::max(1.0, std::abs(best.shape.sigma));
    double step[4] = {0.08 * logRatio, 0.2 * wide, 0.15 / wide, 0.15 / wide};
    const auto attempt = [&](const WarpShape& shape) {
      --trials;
      const double found = texels(shape);
      if (!(found < best.texels)) return false;
      best = {shape, found};
      return true;
    };
    while (trials > 0) {
      const WarpShape from = best.shape;
      for (int i = 0; i < 4; ++i) {
        WarpShape shape = best.shape;
        shape.*kParameters[i] += step[i];
        if (attempt(shape)) continue;
        step[i] = -step[i];
        shape = best.shape;
        shape.*kParameters[i] += step[i];
        (void)attempt(shape);
      }
      WarpShape beyond = best.shape;
      bool isMoved = false;
      for (const auto parameter : kParameters) {
        isMoved |= best.shape.*parameter != from.*parameter;
        beyond.*parameter += best.shape.*parameter - from.*parameter;
      }
      if (isMoved)
        (void)attempt(beyond);
      else
        for (double& s : step) s /= 2.0;
    }
  }

  Trial trial_;
  Found found_[kStarts];
  int count_ = 0;
};

// One-point maps along an axis, and for a footprint to one side of the eye two-point ones whose apex lies on it.
void considerAxis(Search& search, const glm::dvec2& axis, const Spread& spread, double logRatio) noexcept {
  const double phi = angleOf(axis);
  for (const double share : {0.47, 0.55, 0.65}) search.consider({phi, share * logRatio, 0.0, 0.0});
  if (!spread.isOneSided) return;
  constexpr double kFarSigma = 5.0;  // an apex far off: what broad wedges of a great ratio take
  for (const double sigma : {kFarSigma, -kFarSigma}) search.consider({phi, 0.65 * logRatio, sigma, -1.0 / sigma});
  for (const double share : {1.0, 1.8, 2.6}) {
    const double x = std::max(spread.halfTangent * share, 0.2);
    for (const double sigma : {x, -x})
      for (const double kappa : {0.53, 0.6}) search.consider({phi, kappa * logRatio, sigma, x > 0.45 ? -1.0 / sigma : -0.9 * sigma});
  }
}

// The recipe's candidates: the projected view direction, the wedge's bisector, and the normals of the image's projected sides; and the sides of the
// rectangle, for footprints that a box has cut.
void considerAll(Search& search, const WarpShape& rectangle, const LightSpace& light, const Spread& spread, double logRatio) noexcept {
  constexpr double kQuarter = 1.5707963267948966;
  for (int side = 0; side < 4; ++side) search.consider({rectangle.phi + side * kQuarter, 0.3 * logRatio, 0.0, 0.0});
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

// Stored depth is (d - c) / w but for a constant: where d is not c it changes with w across a texel, which holds one depth for all of
// its area, and the bias pays for it. The centre c that makes the greatest |d - c| / w least, by exchange: the two worst vertices
// of each sign are made equal until no other is worse.
double depthCentre(const Served& served, const glm::dvec3& wRow) noexcept {
  constexpr int kExchanges = 4;  // what is left after them is small, and any centre will do
  double centre = served.points[0].z;
  for (int k = 0; k < kExchanges; ++k) {
    double above = 0.0, below = 0.0, aboveW = 1.0, belowW = 1.0, aboveD = centre, belowD = centre;
    for (int i = 0; i < served.count; ++i) {
      const double w = glm::dot(wRow, glm::dvec3(served.points[i].x, served.points[i].y, 1.0)), d = served.points[i].z;
      const double reach = (d - centre) / w;
      if (reach > above) above = reach, aboveW = w, aboveD = d;
      if (reach < below) below = reach, belowW = w, belowD = d;
    }
    centre = (aboveD * belowW + belowD * aboveW) / (aboveW + belowW);
  }
  return centre;
}

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
  glm::dvec2 widest(0.0), stretch(0.0);  // squared
  for (int i = 0; i < served.count; ++i) {
    const glm::dvec3 p(served.points[i].x, served.points[i].y, 1.0);
    const double w = glm::dot(fit.w, p), perPixel = 1.0 / served.pixels[i];
    const glm::dvec2 s = glm::dvec2(w * fit.s - glm::dot(fit.s, p) * fit.w), t = glm::dvec2(w * fit.t - glm::dot(fit.t, p) * fit.w);
    const glm::dvec2 edge = glm::dvec2(glm::dot(t, t), glm::dot(s, s)) * (w * w);
    stretch = glm::max(stretch, edge);
    widest = glm::max(widest, edge * (perPixel * perPixel));
  }
  fit.stretch = glm::sqrt(stretch) / determinant;
  widest = glm::sqrt(widest) / determinant;
  fit.needed = widest.x * fit.size.x * widest.y * fit.size.y;
  fit.depthCentre = depthCentre(served, fit.w);
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

double neededTexels(const Served& served, const WarpShape& shape) noexcept { return Trial(served).texels(shape); }

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
                  const glm::dvec2& axis, MapFit& fit, const WarpHint* hint) noexcept {
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
  const double logRatio = std::log(widest / narrowest);
  Search search(served, rectangle);
  const bool isLeast = settings.warp == Warp::least;
  if (isLeast && !hint) {
    considerAll(search, rectangle, light, findSpread(footprint), logRatio);
    search.refine(logRatio);
  } else if (axis != glm::dvec2(0.0)) {
    const Ends ends = findEnds(served, axis);
    const bool isForward = ends.nearWidth <= ends.farWidth;
    const double ratio = isForward ? ends.farWidth / ends.nearWidth : ends.nearWidth / ends.farWidth;
    search.consider({angleOf(isForward ? axis : -axis), std::min(kappaOf(settings, ratio), kMostKappa), 0.0, 0.0});
  }
  if (isLeast && hint) {
    WarpShape shape = hint->shape;
    shape.kappa *= logRatio;
    search.consider(shape);
    if (hint->isThorough) considerAll(search, rectangle, light, findSpread(footprint), logRatio);
    search.refineBest(logRatio, hint->trials);
  }
  const WarpShape& shape = search.shape();
  if (!isWarp(shape)) return rectangle;
  MapFit warped = fit;
  shapeFit(shape, footprint, served, warped);
  // Light nearly along the view brings far points to where w is near 1: a row of w that rounds to more than a share of that would be no map.
  constexpr double kMostLost = 0.125;
  const double slope = std::sqrt(warped.w.x * warped.w.x + warped.w.y * warped.w.y);
  if (!(kFloatRounding * (slope * footprint.reach + std::abs(warped.w.z)) < kMostLost)) return rectangle;
  fit = warped;
  return shape;
}

}  // namespace gnomon
