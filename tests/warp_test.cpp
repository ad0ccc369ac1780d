#include <algorithm>
#include <fstream>

#include <nlohmann/json.hpp>

#include "support.h"

#include "gnomon/lloyd.h"
#include "gnomon/maps.h"
#include "gnomon/warp.h"

namespace gnomon::test {
namespace {

// [Lloyd 2006, eq. 9 to 11 corrected] at 40 digits, rounded to double.
struct Known {
  double alpha, halfFov, eta, distance, errorX, errorZ;
};
constexpr Known kKnown[] = {{10.0, 15.0, -1.0, kInfinity, 10.0, 16.794228634059948},
                            {10.0, 30.0, 0.0, 4.162277660168379, 3.1622776601683795, 2.4647515087732477},
                            {500.0, 30.0, 0.0, 23.360679774997898, 22.360679774997898, 19.32618689757501},
                            {1000.0, 30.0, 0.0, 32.622776601683796, 31.622776601683793, 27.358741747383046}};

TEST(Warp, ClosedForms) {
  for (const Known& k : kKnown) {
    EXPECT_EQ(std::isfinite(warpDistance(k.eta, k.alpha)), std::isfinite(k.distance));
    if (std::isfinite(k.distance)) {
      EXPECT_NEAR(warpDistance(k.eta, k.alpha) / k.distance, 1.0, 1e-12);
    }
    EXPECT_NEAR(warpEta(k.distance, k.alpha), k.eta, 1e-12);
    const glm::dvec2 errors = overheadErrors(k.alpha, std::tan(k.halfFov * kPi / 180.0), k.distance);
    EXPECT_NEAR(errors.x / k.errorX, 1.0, 1e-12);
    EXPECT_NEAR(errors.y / k.errorZ, 1.0, 1e-12);
  }
  for (const double eta : {-0.99, -0.5, -0.1, 0.0, 0.3, 1.0}) EXPECT_NEAR(warpEta(warpDistance(eta, 50.0), 50.0), eta, 1e-12);
}

TEST(Warp, ClosedFormsOfTheReferenceFile) {
  const std::string path = std::string(GNOMON_EXTRA_DATA) + "/reference/closed_forms.json";
  std::ifstream file(path);
  if (!file) GTEST_SKIP() << "GNOMON_EXTRA_DATA has no reference/closed_forms.json";
  const auto forms = nlohmann::json::parse(file);
  for (const auto& row : forms["warp"]) {
    const double alpha = row["far"].get<double>() / row["near"].get<double>(), eta = row["eta"],
                 tangent = std::tan(row["half_fov_degrees"].get<double>() * kPi / 180.0);
    const double distance = warpDistance(eta, alpha);
    if (row["n_prime"].is_null())
      EXPECT_EQ(distance, kInfinity);
    else
      EXPECT_NEAR(distance * row["near"].get<double>() / row["n_prime"].get<double>(), 1.0, 1e-12) << row;
    const glm::dvec2 errors = overheadErrors(alpha, tangent, distance);
    EXPECT_NEAR(errors.x / row["M_x"].get<double>(), 1.0, 1e-12) << row;
    EXPECT_NEAR(errors.y / row["M_z"].get<double>(), 1.0, 1e-12) << row;
  }
  for (const auto& row : forms["storage"]) {
    const double alpha = row["far_over_near"], tangent = std::tan(row["half_fov_degrees"].get<double>() * kPi / 180.0);
    const int k = row["partitions"];
    EXPECT_NEAR(storageOverheadZp(alpha, tangent, k) / row["overhead_zp"].get<double>(), 1.0, 1e-12) << row;
    EXPECT_NEAR(storageOverheadZpW(alpha, tangent, k) / row["overhead_zp_w"].get<double>(), 1.0, 1e-12) << row;
    EXPECT_NEAR(storageOverheadOptimal(alpha, tangent) / row["overhead_optimal"].get<double>(), 1.0, 1e-12) << row;
    EXPECT_NEAR(storageBehindZp(alpha, k) / row["behind_zp"].get<double>(), 1.0, 1e-12) << row;
    EXPECT_NEAR(storageBehindFpZpW(alpha, k) / row["behind_fp_zp_w"].get<double>(), 1.0, 1e-12) << row;
  }
}

// One warped map under an overhead light, its widths measured on the emitted matrix by central differences along the axis of the view, where
// Lloyd's x and z are the map's own directions: the greatest of each over the view are M_x and M_z times 1 / resolution.
TEST(Warp, EmittedMatricesReachTheClosedForms) {
  for (const double eta : {-0.5, 0.0, 0.5, 1.0})
    for (const double alpha : {10.0, 100.0, 1000.0}) {
      constexpr double kHeight = 1024.0, kFov = kPi / 3.0;
      Frame frame;
      frame.camera = perspective({0, 0, 0}, {0, 0, -1}, {0, 1, 0}, kFov, 1.0, 1.0, alpha);
      frame.camera.depth = DepthConvention::reversedZeroToOne;
      frame.light.directionWs = {0, -1, 0};
      frame.image = {kHeight, kHeight};
      frame.budget = {.partitions = 1, .resolution = 1024};
      auto solution = std::make_unique<Solution>();
      ASSERT_EQ(solveLloyd(frame, {.scheme = LloydScheme::w, .split = {}, .warp = {.warp = Warp::eta, .eta = eta}}, *solution), Status::ok);
      const Partition& map = solution->partitions[0];
      ASSERT_EQ(map.warp, Warp::eta);
      const auto texels = [&](double x, double z) {
        const glm::dvec4 q = glm::dmat4(map.clipFromWorld) * glm::dvec4(x, 0.0, -z, 1.0);
        return glm::dvec2(q) / q.w * glm::dvec2(map.viewport.z, map.viewport.w) / 2.0;
      };
      const bool isTurned = std::abs(texels(1.0, 5.0).y - texels(-1.0, 5.0).y) > std::abs(texels(1.0, 5.0).x - texels(-1.0, 5.0).x);
      double widestX = 0.0, widestZ = 0.0;
      for (int i = 0; i <= 200; ++i) {
        const double z = std::pow(alpha, i / 200.0), step = 1e-4 * z, pixel = 2.0 * z * std::tan(kFov / 2.0) / kHeight;
        const glm::dvec2 dx = (texels(step, z) - texels(-step, z)) / (2.0 * step),
                         dz = (texels(0.0, z + step) - texels(0.0, z - step)) / (2.0 * step);
        widestX = std::max(widestX, 1.0 / std::abs(isTurned ? dx.y : dx.x) / pixel);
        widestZ = std::max(widestZ, 1.0 / std::abs(isTurned ? dz.x : dz.y) / pixel);
      }
      const glm::dvec2 forms = overheadErrors(alpha, std::tan(kFov / 2.0), warpDistance(eta, alpha));
      // The view's own extent in texels: maps are a little larger, padded by float32 rounding.
      const double far = alpha * std::tan(kFov / 2.0);
      const glm::dvec2 span = texels(far, alpha) - texels(-far, alpha), length = texels(0.0, alpha) - texels(0.0, 1.0);
      EXPECT_NEAR(widestX * std::abs(isTurned ? span.y : span.x) / kHeight / forms.x, 1.0, 1e-6) << eta << " " << alpha;
      EXPECT_NEAR(widestZ * std::abs(isTurned ? length.x : length.y) / kHeight / forms.y, 1.0, 1e-6) << eta << " " << alpha;
      // The library's own measure, texel edges, is longer by 1 / cos of the greatest shear, at the far corners, where M_z is too.
      if (eta < 0.0) continue;
      const double shear = far / (warpDistance(eta, alpha) + alpha - 1.0);
      const double edges = map.error.s * map.error.t * glm::length(span) * glm::length(length) / (kHeight * kHeight);
      EXPECT_NEAR(edges / (forms.x * forms.y * std::hypot(1.0, shear)), 1.0, 1e-5) << eta << " " << alpha;
    }
}

// What a fit is said to need is what its rows do: texel edges by central differences at the vertices, two-point maps included.
TEST(Warp, FitsNeedWhatTheirRowsDo) {
  Random random(351);
  int twoPoint = 0;
  for (int k = 0; k < 200; ++k) {
    Frame frame = usualFrame();
    frame.camera.forwardWs = random.direction();
    frame.light.directionWs = random.direction();
    Region region;
    LightSpace light;
    Splits splits;
    auto solution = std::make_unique<Solution>();
    double refused = 0.0;
    ASSERT_EQ(beginSolve(frame, {}, FitMode::tight, region, light, *solution), Status::ok);
    ASSERT_EQ(split(region, {}, 1, splits, refused), Status::ok);
    const auto maps = std::make_unique<MapFits>();
    fitMaps(frame, region, light, splits, {.fit = FitMode::tight, .warp = {.warp = Warp::least}}, false, *maps);
    const MapFit& fit = maps->fits[0];
    if (!fit.isWarped) continue;
    twoPoint += maps->shapes[0].tau != 0.0;
    const auto at = [&](const glm::dvec2& q) {
      const glm::dvec3 p(q, 1.0);
      return glm::dvec2(glm::dot(fit.s, p), glm::dot(fit.t, p)) / glm::dot(fit.w, p);
    };
    glm::dvec2 widest(0.0);
    for (int v = 0; v < maps->served[0].count; ++v) {
      const glm::dvec2 q(maps->served[0].points[v]);
      const double pixel = maps->served[0].pixels[v], h = pixel;
      const glm::dvec2 dx = (at(q + glm::dvec2(h, 0.0)) - at(q - glm::dvec2(h, 0.0))) / (2.0 * h),
                       dy = (at(q + glm::dvec2(0.0, h)) - at(q - glm::dvec2(0.0, h))) / (2.0 * h);
      const double determinant = std::abs(dx.x * dy.y - dx.y * dy.x);
      widest = glm::max(widest, glm::dvec2(std::hypot(dx.y, dy.y), std::hypot(dx.x, dy.x)) / determinant / pixel);
    }
    EXPECT_NEAR(fit.size.x * fit.size.y * widest.x * widest.y / maps->neededTexels, 1.0, 1e-5) << k;
  }
  EXPECT_GT(twoPoint, 10);
}

// Points of the light plane and the pixel width at each: what `least` searches for.
struct Points {
  std::vector<glm::dvec2> at;
  std::vector<double> pixel;
};

// Texels that a projective map of (phi, kappa, sigma, tau) needs, from the derivatives of its two quotients.
double texelsOf(const Points& points, const glm::dvec4& shape) {
  const double c = std::cos(shape.x), s = std::sin(shape.x);
  double from = kInfinity, to = -kInfinity;
  for (const glm::dvec2& p : points.at) {
    from = std::min(from, c * p.x + s * p.y);
    to = std::max(to, c * p.x + s * p.y);
  }
  const double d = std::expm1(shape.y) / (to - from);
  glm::dvec2 least(kInfinity), most(-kInfinity), widest(0.0);
  for (std::size_t i = 0; i < points.at.size(); ++i) {
    const double u = c * points.at[i].x + s * points.at[i].y - from, v = c * points.at[i].y - s * points.at[i].x;
    const double w = 1.0 + d * u, a = (u + shape.w * v) / w, b = (v + shape.z * u) / w;
    least = glm::min(least, glm::dvec2(a, b));
    most = glm::max(most, glm::dvec2(a, b));
    // da = (1 - a d, tau) / w, db = (sigma - b d, 1) / w along (u, v); a texel's edges are the columns of the inverse.
    const double det = std::abs((1.0 - a * d) - shape.w * (shape.z - b * d)) / w;
    widest = glm::max(widest, glm::dvec2(std::hypot(shape.z - b * d, 1.0), std::hypot(1.0 - a * d, shape.w)) / (det * points.pixel[i]));
  }
  const double texels = (most.x - least.x) * (most.y - least.y) * widest.x * widest.y;
  return shape.y >= 0.0 && std::isfinite(texels) ? texels : kInfinity;
}

// The fewest texels that some hundred starts and a long compass search from the best of them reach.
double leastTexels(const Points& points, double logRatio) {
  std::vector<std::pair<double, glm::dvec4>> starts;
  const auto start = [&](const glm::dvec4& shape) { starts.emplace_back(texelsOf(points, shape), shape); };
  constexpr int kAngles = 24;
  for (int i = 0; i < kAngles; ++i) {
    const double phi = 2.0 * kPi * i / kAngles;
    for (const double share : {0.0, 0.15, 0.3, 0.5, 0.7}) start({phi, share * logRatio, 0.0, 0.0});
    for (const double sigma : {0.3, 0.8, 2.0, 5.0})
      for (const double sign : {-1.0, 1.0}) start({phi, 0.55 * logRatio, sign * sigma, -sign * (sigma > 0.45 ? 1.0 / sigma : 0.9 * sigma)});
  }
  constexpr std::size_t kRefined = 12;
  std::partial_sort(starts.begin(), starts.begin() + kRefined, starts.end(),
                    [](const auto& a, const auto& b) { return a.first < b.first; });
  double least = kInfinity;
  for (std::size_t n = 0; n < kRefined; ++n) {
    auto [texels, shape] = starts[n];
    glm::dvec4 step{0.15, 0.08 * logRatio, 0.2, 0.15};
    for (int round = 0; round < 80 && step.x > 1e-3; ++round) {
      const glm::dvec4 from = shape;
      for (int i = 0; i < 4; ++i)
        for (const double sign : {-1.0, 1.0}) {
          glm::dvec4 next = shape;
          next[i] += sign * step[i];
          if (const double trial = texelsOf(points, next); trial < texels) {
            texels = trial;
            shape = next;
          }
        }
      if (shape == from) step /= 2.0;
    }
    least = std::min(least, texels);
  }
  return least;
}

// The search's few dozen trials against brute force, over slices of random views of every ratio, whole ones and ones cut by a box.
TEST(Warp, LeastIsCloseToTheBestOfAllMaps) {
  Random random(352);
  double sum = 0.0, worst = 1.0;
  int count = 0;
  for (int tried = 0; tried < 3000 && count < 1000; ++tried) {
    Frame frame = usualFrame();
    frame.camera = perspective({1.0, 2.0, 3.0}, random.direction(), random.direction(), random.uniform(0.5, 1.8), random.uniform(0.6, 2.4),
                               0.1, 0.1 * std::pow(random.logUniform(50.0, 2e4), 1.0 / (1 + random.index(8))));
    frame.light.directionWs = random.direction();
    const double depth = random.logUniform(frame.camera.near, frame.camera.far);
    const glm::dvec3 centre = frame.camera.positionWs + viewPoint(frame.camera, random.uniform(), random.uniform(), depth);
    const Box box{centre - glm::dvec3(random.uniform(), random.uniform(), random.uniform()) * depth,
                  centre + glm::dvec3(random.uniform(), random.uniform(), random.uniform()) * depth};
    if (count % 3 == 0) frame.scene.receivers = {&box, 1};
    Region region;
    LightSpace light;
    Splits splits;
    const auto solution = std::make_unique<Solution>();
    double refused = 0.0;
    ASSERT_EQ(beginSolve(frame, {}, FitMode::tight, region, light, *solution), Status::ok);
    ASSERT_EQ(split(region, {}, 1, splits, refused), Status::ok);
    const auto maps = std::make_unique<MapFits>();
    fitMaps(frame, region, light, splits, {.fit = FitMode::tight, .warp = {.warp = Warp::least}}, false, *maps);
    const Served& served = maps->served[0];
    if (splits.count == 0 || served.count < 3) continue;
    Points points;
    double narrowest = kInfinity, widest = 0.0;
    for (int i = 0; i < served.count; ++i) {
      points.at.emplace_back(served.points[i]);
      points.pixel.push_back(served.pixels[i]);
      narrowest = std::min(narrowest, served.pixels[i]);
      widest = std::max(widest, served.pixels[i]);
    }
    const double ratio = maps->neededTexels / leastTexels(points, std::log(widest / narrowest));
    if (!(ratio > 0.0) || !std::isfinite(ratio)) continue;
    ++count;
    sum += std::max(ratio, 1.0);
    worst = std::max(worst, ratio);
  }
  RecordProperty("above_the_optimum", std::to_string(sum / count - 1.0) + " on average, " + std::to_string(worst - 1.0) + " at worst");
  EXPECT_LE(sum / count, 1.03);
  EXPECT_LE(worst, 1.15);
}

// As pixels come to one width every warp fades into the plain map, without a jump.
TEST(Warp, FadesToThePlainFit) {
  for (const Warp warp : {Warp::lispsm, Warp::psm, Warp::tsm, Warp::least})
    for (const double ratio : {1.1, 1.01, 1.001}) {
      Frame frame = usualFrame();
      frame.camera.near = 10.0;
      frame.camera.far = 10.0 * ratio;
      frame.budget.partitions = 1;
      auto warped = std::make_unique<Solution>(), plain = std::make_unique<Solution>();
      ASSERT_EQ(solveLloyd(frame, {.scheme = LloydScheme::w, .split = {}, .warp = {.warp = warp}}, *warped), Status::ok);
      ASSERT_EQ(solveLloyd(frame, {.scheme = LloydScheme::zp, .split = {}, .warp = {}}, *plain), Status::ok);
      EXPECT_LE(warped->neededTexels, plain->neededTexels * (1.0 + 1e-4));
      EXPECT_GE(warped->neededTexels, plain->neededTexels / std::pow(ratio, 3.0) * 0.9);
    }
}

// A texel holds one depth for all of its area, but a warped map's stored depth changes with w across it, as far as a point lies from
// the depth that is stored alike everywhere. No other such depth serves the slice's corners better. All from differences of the emitted matrix.
TEST(Warp, StoredDepthVariesLeastAcrossTheMap) {
  Random random(78);
  int warped = 0;
  for (int k = 0; k < 200; ++k) {
    Frame frame = usualFrame();
    frame.camera.forwardWs = random.direction();
    frame.light.directionWs = random.direction();
    Solution solution;
    const Warp warp = k % 2 ? Warp::least : Warp::lispsm;
    ASSERT_EQ(solveLloyd(frame, {.scheme = LloydScheme::zpw, .split = {}, .warp = {.warp = warp}}, solution), Status::ok);
    const glm::dvec3 l = glm::normalize(frame.light.directionWs);
    for (int m = 0; m < solution.partitionCount; ++m) {
      const Partition& map = solution.partitions[m];
      if (map.warp == Warp::none) continue;
      ++warped;
      const glm::dmat4 matrix(map.clipFromWorld);
      double depths[8], ws[8], away[8];
      for (int i = 0; i < 8; ++i) {
        const glm::dvec3 p = viewPoint(frame.camera, i & 1, (i >> 1) & 1, (i & 4) ? map.far : map.near);
        const auto stored = [&](const glm::dvec3& at) {
          const glm::dvec4 q = matrix * glm::dvec4(at, 1.0);
          return q.z / q.w;
        };
        const glm::dvec3 wRow(matrix[0][3], matrix[1][3], matrix[2][3]);
        const glm::dvec3 slope = wRow - l * glm::dot(l, wRow), across = slope / glm::dot(slope, slope);  // one of w
        const double w = glm::dot(wRow, p) + matrix[3][3], step = 1e-3 * w;
        const double perW = (stored(p + across * step) - stored(p - across * step)) / (2.0 * step);
        const double h = 1e-3 * map.near, perDepth = (stored(p + l * h) - stored(p - l * h)) / (2.0 * h);
        depths[i] = glm::dot(l, p);
        ws[i] = w;
        away[i] = depths[i] + perW / perDepth * w;  // the depth that is stored alike: stored = (d - c) / (w range) + constant
      }
      const auto worst = [&](const auto& centre) {
        double most = 0.0;
        for (int i = 0; i < 8; ++i) most = std::max(most, std::abs(depths[i] - centre(i)) / ws[i]);
        return most;
      };
      const double emitted = worst([&](int i) { return away[i]; });
      const auto [least, greatest] = std::minmax_element(depths, depths + 8);
      double best = kInfinity;
      for (int i = 0; i <= 400; ++i) best = std::min(best, worst([&](int) { return *least + (*greatest - *least) * i / 400.0; }));
      EXPECT_LE(emitted, best * 1.02) << k;
    }
  }
  EXPECT_GT(warped, 100);
}

}  // namespace
}  // namespace gnomon::test
