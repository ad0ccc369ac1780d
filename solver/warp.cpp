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

double angleOf(const glm::dvec2& v) noexcept { return std::atan2(v.y, v.x); }

constexpr double kRightAngle = 1.5707963267948966;

// The wedge that the footprint fills, seen from the eye's projection (the origin).
struct Spread {
  bool isOneSided = false;  // the eye projects outside
  double bisector = 0.0, halfAngle = 0.0;  // radians
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
  if (!spread.isOneSided) return spread;
  spread.bisector = angleOf(sum);
  spread.halfAngle = std::acos(std::min(std::sqrt(glm::dot(sum, sum)) / 2.0, 1.0));
  return spread;
}

// A projective map is the line of the light plane that it sends to infinity, w = 0, and the two directions in which s and t run once it is
// there: with U, v along and across the line, s = (x U + y v) / w. How far s ranges, times the widest that a unit of it is at a vertex, is
// a function F of (x, y) alone, and the texels needed are F of s times F of t over the square of their determinant. So a few values of F
// judge every pair of directions, and what is left to search has two parameters, not four.
class Search {
 public:
  Search(const Footprint& footprint, const Served& served) noexcept : footprint_(footprint), served_(served) {
    for (int i = 0; i < served.count; ++i) density_[i] = 1.0 / (served.pixels[i] * served.pixels[i]);
  }

  // Looks at the line at right angles to phi that lies 1 / (e^kappa - 1) of the footprint's length before it; keeps the best that differ in
  // kind.
  void consider(double phi, double kappa) noexcept {
    Found found = best(phi, kappa, count_ > 0 ? found_[0].squared : kInfinity, kRounds);
    for (int i = 0; i < count_; ++i) {  // sorted; takes the place of the first that is worse, and of any worse one of its kind
      const bool isAlike = std::abs(std::remainder(found.phi - found_[i].phi, 4.0 * kRightAngle)) < kAlike &&
                           std::abs(found.s.y / found.s.x - found_[i].s.y / found_[i].s.x) < kAlike;
      if (!(found.squared < found_[i].squared)) {
        if (isAlike) return;
        continue;
      }
      std::swap(found, found_[i]);
      if (isAlike) return;
    }
    if (count_ < kStarts) found_[count_++] = found;
  }

  // A simplex search from each of them.  [Nelder and Mead 1965]
  void refine(double phiStep, double kappaStep) noexcept {
    for (int i = 0; i < count_; ++i) {
      if (!(found_[i].squared < kHopelessStart * found_[0].squared)) break;
      const Found found = descend(found_[i], phiStep, kappaStep, kTrialsOf[i]);
      if (found.squared < found_[0].squared) found_[0] = found;
    }
    found_[0] = best(found_[0].phi, found_[0].kappa, kInfinity, kLastRounds);
  }

  // A simplex search from the best of them alone.
  void refineBest(double phiStep, double kappaStep, int trials) noexcept {
    if (const Found found = descend(found_[0], phiStep, kappaStep, trials); found.squared < found_[0].squared) found_[0] = found;
    found_[0] = best(found_[0].phi, found_[0].kappa, kInfinity, kLastRounds);
  }

  WarpShape shape() const noexcept {
    const Found& found = found_[0];
    return {found.phi, found.kappa, found.t.x / found.t.y, found.s.y / found.s.x};
  }

 private:
  struct Found {
    double phi, kappa;
    double squared;  // texels needed, squared
    glm::dvec2 s, t;  // the directions; s.x and t.y are not 0
  };
  static constexpr int kStarts = 3;
  static constexpr int kTrialsOf[kStarts] = {16, 8, 6};  // from the best on: 1 % above the optimum on average (tests/warp_test.cpp)
  static constexpr double kAlike = 0.05;  // radians, and of tau
  // Times the least so far, squared: what a simplex, the rounds about a fan's best pair and all but the first of them seldom gain.
  static constexpr double kHopelessStart = 1.3, kHopelessFan = 1.44, kHopelessRound = 1.1;
  static constexpr int kRounds = 2, kLastRounds = 4;

  Found descend(const Found& start, double phiStep, double kappaStep, int trials) noexcept {
    Found corners[3] = {start, {}, {}};  // from the best on
    const auto insert = [&](const Found& found, int last) {
      int i = last;
      for (; i > 0 && found.squared < corners[i - 1].squared; --i) corners[i] = corners[i - 1];
      corners[i] = found;
    };
    const auto attempt = [&](double phi, double kappa) {
      --trials;
      return best(phi, kappa, corners[0].squared, kRounds);
    };
    insert(attempt(start.phi + phiStep, start.kappa), 1);
    insert(attempt(start.phi, start.kappa + kappaStep), 2);
    while (trials > 0) {
      const Found top = corners[0], middle = corners[1], worst = corners[2];
      const double phi = (top.phi + middle.phi) / 2.0, kappa = (top.kappa + middle.kappa) / 2.0;
      const auto beyond = [&](double far) { return attempt(phi + far * (phi - worst.phi), kappa + far * (kappa - worst.kappa)); };
      const auto towardsTop = [&](const Found& from) { return attempt((top.phi + from.phi) / 2.0, (top.kappa + from.kappa) / 2.0); };
      const Found mirrored = beyond(1.0);
      Found next = mirrored;
      if (mirrored.squared < top.squared) {
        if (const Found farther = beyond(2.0); farther.squared < mirrored.squared) next = farther;
      } else if (!(mirrored.squared < middle.squared)) {
        next = beyond(mirrored.squared < worst.squared ? 0.5 : -0.5);
        if (!(next.squared < std::min(mirrored.squared, worst.squared))) {
          insert(towardsTop(middle), 1);
          next = towardsTop(worst);
        }
      }
      insert(next, 2);
    }
    return corners[0];
  }

  // In coordinates where F is the same along the line and across it.
  struct Direction {
    double x, y;
    double squared;  // F squared
  };

  // The best pair of directions for a line, infinite where there is none. A fan of them is tried, then some about its best two, for as long
  // as those come near the least so far.
  Found best(double phi, double kappa, double least, int rounds) noexcept {
    Found found{phi, kappa, kInfinity, {1.0, 0.0}, {0.0, 1.0}};
    if (!(kappa >= 0.0 && kappa <= kMostKappa)) return found;
    place(phi, kappa);
    constexpr int kFan = 8;
    constexpr double kSine[] = {0.0, 0.38268343236508977, 0.70710678118654752, 0.92387953251128674, 1.0};
    Direction fan[kFan];
    fan[0] = {1.0, 0.0, even_};
    fan[kFan / 2] = {0.0, 1.0, even_};
    for (int i = 1; i < kFan / 2; ++i) {
      const double c = kSine[kFan / 2 - i], d = kSine[i], y = d * stretch_;
      const Pair across = {y, y}, along = {c, -c}, squared = measure(along, across);
      fan[i] = {c, d, squared[0]};
      fan[kFan - i] = {-c, d, squared[1]};
    }
    int first = 0, second = 0;
    for (int gap = kFan / 2 - 1; gap <= kFan / 2 + 1; ++gap) {
      const double perSine = gap == kFan / 2 ? 1.0 : 1.3725830020304792;  // sine^-4
      for (int i = 0; i + gap < kFan; ++i) {
        const double squared = fan[i].squared * fan[i + gap].squared * perSine;
        if (!(squared < found.squared)) continue;
        found.squared = squared;
        first = i;
        second = i + gap;
      }
    }
    if (!(found.squared < kInfinity)) return found;
    Direction a[3] = {fan[first], {}, {}}, b[3] = {fan[second], {}, {}};
    constexpr glm::dvec2 kTurns[kLastRounds] = {{0.9914448613738104, 0.13052619222005157},  // cosine and sine of a third of the fan's step
                                                {0.9990482215818578, 0.043619387365336},  // and each of a third of the one before
                                                {0.9998942319271075, 0.014543897651582654},
                                                {0.9999882478077495, 0.004848117819001859}};
    double hopeless = kHopelessFan * least;
    for (int round = 0; round < rounds && found.squared < hopeless; ++round, hopeless = kHopelessRound * least) {
      for (Direction* around : {a, b}) {
        const double c = kTurns[round].x, d = kTurns[round].y, px = c * around->x, py = c * around->y, qx = -d * around->y,
                     qy = d * around->x;
        const Pair x = {px + qx, px - qx}, y = {py + qy, py - qy}, squared = measure(x, y * stretch_);
        around[1] = {x[0], y[0], squared[0]};
        around[2] = {x[1], y[1], squared[1]};
      }
      int bestA = 0, bestB = 0;
      for (int k = 1; k < 5; ++k) {  // first a, then b
        const int i = k < 3 ? k : bestA, j = k < 3 ? 0 : k - 2;
        const double sine = a[i].x * b[j].y - a[i].y * b[j].x, square = sine * sine, product = a[i].squared * b[j].squared;
        if (!(product < found.squared * (square * square))) continue;
        found.squared = product / (square * square);
        bestA = i;
        bestB = j;
      }
      a[0] = a[bestA];
      b[0] = b[bestB];
    }
    const bool isSwapped = std::abs(a[0].x) < std::abs(b[0].x);
    const Direction &s = isSwapped ? b[0] : a[0], &t = isSwapped ? a[0] : b[0];
    found.s = {s.x, s.y * stretch_};
    found.t = {t.x, t.y * stretch_};
    return found;
  }

  // Sends a line to infinity.
  void place(double phi, double kappa) noexcept {
    const double c = std::cos(phi), s = std::sin(phi);
    double alongs[kMaxHull], from = kInfinity, to = -kInfinity;
    for (int i = 0; i < footprint_.count; ++i) {
      const double along = alongs[i] = c * footprint_.hull[i].x + s * footprint_.hull[i].y;
      from = from < along ? from : along;
      to = to > along ? to : along;
    }
    const double d = (kappa == 0.0 ? 0.0 : std::exp(kappa) - 1.0) / (to - from);
    double rangeU = 0.0, leastV = kInfinity, mostV = -kInfinity, widestU = 0.0, widestV = 0.0;
    for (int i = 0; i < footprint_.count; ++i) {
      const double along = alongs[i] - from, perW = 1.0 / (1.0 + d * along);
      const double u = along * perW, v = (c * footprint_.hull[i].y - s * footprint_.hull[i].x) * perW;
      u_[i] = both(u);
      v_[i] = both(v);
      rangeU = rangeU > u ? rangeU : u;
      leastV = leastV < v ? leastV : v;
      mostV = mostV > v ? mostV : v;
    }
    // The square of w^2 grad s w over the pixel's width: but for the determinant, the edge that s leaves to t.
    for (int i = 0; i < served_.count; ++i) {
      const glm::dvec3& p = served_.points[i];
      const double w = 1.0 + d * (c * p.x + s * p.y - from), square = w * w, slope = d * (c * p.y - s * p.x), xx = square * density_[i];
      const double yy = (slope * slope + square) * xx;
      xx_[i] = both(xx);
      xy_[i] = both(-2.0 * slope * xx);
      yy_[i] = both(yy);
      widestU = widestU > xx ? widestU : xx;
      widestV = widestV > yy ? widestV : yy;
    }
    const double alongU = rangeU * rangeU * widestU, alongV = (mostV - leastV) * (mostV - leastV) * widestV;
    even_ = std::sqrt(alongU * alongV);
    perRatio_ = even_ / alongU;
    stretch_ = std::sqrt(1.0 / perRatio_);
  }

  // F squared of two directions, whose y is stretched.
  Pair measure(Pair x, Pair y) const noexcept {
    Pair least = {kInfinity, kInfinity}, most = {-kInfinity, -kInfinity}, widest = {0.0, 0.0};
    for (int i = 0; i < footprint_.count; ++i) {
      const Pair s = x * u_[i] + y * v_[i];
      least = lesser(least, s);
      most = greater(most, s);
    }
    const Pair xx = x * x, xy = x * y, yy = y * y;
    for (int i = 0; i < served_.count; ++i) widest = greater(widest, xx * xx_[i] + xy * xy_[i] + yy * yy_[i]);
    const Pair range = most - least;
    return range * range * widest * perRatio_;
  }

  const Footprint& footprint_;
  const Served& served_;
  double density_[kMaxHull];
  Pair u_[kMaxHull], v_[kMaxHull], xx_[kMaxHull], xy_[kMaxHull], yy_[kMaxHull];  // each twice
  double even_ = 0.0, perRatio_ = 1.0, stretch_ = 1.0;  // F squared along the line and across it; what scales it there
  Found found_[kStarts];
  int count_ = 0;
};

// Lines across the least rectangle's sides, which footprints that a box has cut go by, and across the wedge's bisector or, where the wedge
// is all around, the projected view direction. The shares of the pixels' ratio are where optima lie.
WarpShape searchLeast(double rectangle, const LightSpace& light, const Footprint& footprint, const Served& served, double logRatio,
                      const WarpHint* hint) noexcept {
  if (hint && hint->trials == 0 && !hint->isThorough)
    return {hint->shape.phi, std::min(hint->shape.kappa * logRatio, kMostKappa), hint->shape.sigma, hint->shape.tau};
  Search search(footprint, served);
  search.consider(rectangle, 0.0);
  const Spread spread = findSpread(footprint);
  const double room = std::max(kRightAngle - spread.halfAngle, 0.3);  // how far w may turn and still grow along the wedge
  const double phiStep = 0.2 * room, kappaStep = 0.08 * logRatio;
  for (int side = 0; side < 4; ++side) search.consider(rectangle + side * kRightAngle, 0.35 * logRatio);
  if (hint) {
    search.consider(hint->shape.phi, hint->shape.kappa * logRatio);
    if (!hint->isThorough) {
      search.refineBest(phiStep, kappaStep, hint->trials);
      return search.shape();
    }
  }
  if (spread.isOneSided) {
    search.consider(angleOf(glm::dvec2(light.lsFromView[2])), 0.55 * logRatio);
    for (const double turn : {-0.4, 0.0, 0.4})
      for (const double share : {0.52, 0.68}) search.consider(spread.bisector + turn * room, share * logRatio);
  } else {
    for (const double share : {0.1, 0.3, 0.5}) search.consider(angleOf(glm::dvec2(light.lsFromView[2])), share * logRatio);
  }
  search.refine(phiStep, kappaStep);
  return search.shape();
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
  const auto rectangle = [&]() -> WarpShape { return {angleOf(glm::dvec2(fit.s)), 0.0, 0.0, 0.0}; };
  const double thin = std::min(fit.size.x, fit.size.y);
  double narrowest = kInfinity, widest = 0.0;
  for (int i = 0; i < served.count; ++i) {
    narrowest = std::min(narrowest, served.pixels[i]);
    widest = std::max(widest, served.pixels[i]);
  }
  // A line, a point, or pixels of one width: nothing to gain.
  if (settings.warp == Warp::none || footprint.count < 3 || served.count < 3 || !(thin > 2.0 * narrowest) || !(widest > narrowest))
    return rectangle();
  WarpShape shape{};
  if (settings.warp == Warp::least) {
    shape = searchLeast(angleOf(glm::dvec2(fit.s)), light, footprint, served, std::log(widest / narrowest), hint);
  } else if (axis != glm::dvec2(0.0)) {
    const Ends ends = findEnds(served, axis);
    const bool isForward = ends.nearWidth <= ends.farWidth;
    const double ratio = isForward ? ends.farWidth / ends.nearWidth : ends.nearWidth / ends.farWidth;
    shape = {angleOf(isForward ? axis : -axis), std::min(kappaOf(settings, ratio), kMostKappa), 0.0, 0.0};
  }
  if (!isWarp(shape)) return rectangle();
  MapFit warped = fit;
  shapeFit(shape, footprint, served, warped);
  if (!(warped.needed < fit.needed)) return rectangle();
  // Light nearly along the view brings far points to where w is near 1: a row of w that rounds to more than a share of that would be no
  // map.
  constexpr double kMostLost = 0.125;
  const double slope = std::sqrt(warped.w.x * warped.w.x + warped.w.y * warped.w.y);
  if (!(kFloatRounding * (slope * footprint.reach + std::abs(warped.w.z)) < kMostLost)) return rectangle();
  fit = warped;
  return shape;
}

}  // namespace gnomon
