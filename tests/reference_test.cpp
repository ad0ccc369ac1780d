// The product against the same definitions in 50 digits, written from the papers and from what the headers say: splits, rows, rectangles,
// predicted errors, and where a shader's float32 arithmetic looks a point up.
#include "support.h"

#include <boost/multiprecision/cpp_bin_float.hpp>
#include <glm/gtc/matrix_transform.hpp>

#include "gnomon/fit.h"
#include "gnomon/lloyd.h"
#include "gnomon/maps.h"
#include "gnomon/rows.h"

namespace gnomon::test {
namespace {

using Real = boost::multiprecision::number<boost::multiprecision::cpp_bin_float<50>, boost::multiprecision::et_off>;

struct Vec {
  Real x = 0, y = 0, z = 0;
  Vec() = default;
  Vec(Real x_, Real y_, Real z_) : x(std::move(x_)), y(std::move(y_)), z(std::move(z_)) {}
  explicit Vec(const glm::dvec3& v) : x(v.x), y(v.y), z(v.z) {}
};
Vec operator+(const Vec& a, const Vec& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
Vec operator*(const Vec& a, const Real& k) { return {a.x * k, a.y * k, a.z * k}; }
Real dot(const Vec& a, const Vec& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
Vec cross(const Vec& a, const Vec& b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }
Vec unitOf(const Vec& v) { return v * (1 / sqrt(dot(v, v))); }

double apart(const Real& a, const Real& b) { return static_cast<double>(abs(a - b)); }
double ratio(const Real& a, const Real& b) { return static_cast<double>(a / b); }

// Right, up and forward of a camera.
struct Basis {
  Vec right, up, forward;
  explicit Basis(const Camera& camera) {
    forward = unitOf(Vec(camera.forwardWs));
    right = unitOf(cross(forward, Vec(camera.upWs)));
    up = cross(right, forward);
  }
};

Camera someCamera(Random& random, double ratioOfEnds, double offset) {
  Camera camera = perspective(random.direction() * offset, random.direction(), random.direction(), random.uniform(0.3, 2.0),
                              random.uniform(0.5, 2.5), random.logUniform(0.01, 1.0), 1.0);
  camera.far = camera.near * ratioOfEnds;
  camera.depth = DepthConvention::reversedZeroToOne;
  return camera;
}

// [Zhang 2006, eq. 4, 5 and 6 with a weight], far over near up to a million.
TEST(Reference, Splits) {
  Random random(901);
  auto solution = std::make_unique<Solution>();
  for (int n = 0; n < 200; ++n) {
    Frame frame;
    frame.camera = someCamera(random, random.logUniform(2.0, 1e6), 0.0);
    frame.light.directionWs = random.direction();
    frame.budget.partitions = 1 + random.index(16);
    const double lambda = random.index(4) ? random.uniform() : 1.0;
    ASSERT_EQ(solvePssm(frame, {.split = {.scheme = SplitScheme::practical, .lambda = lambda}}, *solution), Status::ok);
    ASSERT_EQ(solution->partitionCount, frame.budget.partitions);
    const Real near = frame.camera.near, far = frame.camera.far, k = frame.budget.partitions;
    for (int i = 0; i < solution->partitionCount; ++i) {
      const Real share = i / k, expected = lambda * near * pow(far / near, share) + (1 - Real(lambda)) * (near + (far - near) * share);
      EXPECT_NEAR(ratio(solution->partitions[i].near, expected), 1.0, 1e-14) << n << ' ' << i;
    }
  }
}

// [Tang 2017, eq. 1] as printed, and rows of one ratio that end where the trapezoid does.
TEST(Reference, Rows) {
  Random random(902);
  for (int n = 0; n < 500; ++n) {
    const double tangent = random.index(5) ? random.logUniform(1e-9, 20.0) : 0.0, base = random.logUniform(1e-6, 10.0),
                 length = base * random.logUniform(1e-2, 1e5), zeta = random.uniform(0.02, 0.48);
    const Trapezoid shape{.axis = {1.0, 0.0}, .from = 0.0, .length = length, .centre = 0.0, .base = base, .tangent = tangent};
    RowSize rows[kMaxPartitions];
    const Real slope = tangent;
    int count = paperRows(shape, zeta, kMaxPartitions, rows);
    Real width = base;
    for (int i = 0; i < count; ++i) {
      const bool isNarrow = tangent < zeta;
      width /= 1 - 2 * (isNarrow ? slope : Real(zeta));
      EXPECT_NEAR(ratio(rows[i].width, width), 1.0, 1e-13);
      EXPECT_NEAR(ratio(rows[i].height, isNarrow ? width : width * zeta / slope), 1.0, 1e-13);
    }
    count = fittedRows(shape, zeta, 1 + random.index(kMaxPartitions), rows);
    const Real growth = log1p(2 * slope * length / base) / count;
    for (int i = 0; i < count; ++i) {
      const Real height = tangent > 0.0 ? base * exp(growth * i) * expm1(growth) / (2 * slope) : Real(length) / count;
      EXPECT_NEAR(ratio(rows[i].height, height), 1.0, 1e-9) << tangent;  // a difference of two ends
    }
  }
}

// The rectangle of least area around a slice: over every direction between two corners, all of them.
TEST(Reference, LeastRectangle) {
  Random random(903);
  for (int n = 0; n < 60; ++n) {
    Frame frame;
    frame.camera = someCamera(random, random.logUniform(1.5, 1e6), random.index(2) ? random.logUniform(1.0, 1e9) : 0.0);
    frame.light.directionWs = random.direction();
    Region region;
    LightSpace light;
    Splits splits;
    int index = 0;
    double value = 0.0;
    ASSERT_EQ(makeRegion(frame, region, index, value), Status::ok);
    ASSERT_EQ(makeLightSpace(frame.light, region, FitMode::tight, light), Status::ok);
    ASSERT_EQ(split(region, {}, 1 + random.index(4), splits, value), Status::ok);
    auto maps = std::make_unique<MapFits>();
    fitMaps(frame, region, light, splits, {}, false, *maps);
    const Basis eye(frame.camera);
    const Vec z = unitOf(Vec(frame.light.directionWs)), x = unitOf(cross(z, z.x * z.x < Real(0.5) ? Vec(1, 0, 0) : Vec(0, 1, 0))),
              y = cross(z, x);
    for (int s = 0; s < splits.count; ++s) {
      std::vector<std::pair<Real, Real>> points;
      for (int corner = 0; corner < 8; ++corner) {
        const Camera& c = frame.camera;
        const Real depth = (corner & 4) ? maps->footprints[s].padded.far : maps->footprints[s].padded.near;
        const Vec p = eye.right * (depth * ((corner & 1) ? c.right : -c.left)) + eye.up * (depth * ((corner & 2) ? c.up : -c.down)) +
                      eye.forward * depth;
        points.emplace_back(dot(p, x), dot(p, y));
      }
      Real least = -1;
      for (int i = 0; i < 8; ++i)
        for (int j = 0; j < i; ++j) {
          const Real dx = points[i].first - points[j].first, dy = points[i].second - points[j].second;
          Real low[2] = {0, 0}, high[2] = {0, 0};
          for (int k = 0; k < 8; ++k) {
            const Real along = points[k].first * dx + points[k].second * dy, across = points[k].second * dx - points[k].first * dy;
            for (int axis = 0; axis < 2; ++axis) {
              const Real& at = axis == 0 ? along : across;
              if (k == 0 || at < low[axis]) low[axis] = at;
              if (k == 0 || at > high[axis]) high[axis] = at;
            }
          }
          const Real area = (high[0] - low[0]) * (high[1] - low[1]) / (dx * dx + dy * dy);
          if (least < 0 || area < least) least = area;
        }
      // Slices alike are copies of one, grown by how far their depth quanta set them apart.
      const double over = ratio(Real(maps->fits[s].size.x) * maps->fits[s].size.y, least);
      EXPECT_GE(over, 1.0 - 1e-9) << n << ' ' << s;
      EXPECT_LE(over, maps->footprints[s].like == s ? 1.0 + 1e-9 : 1.0 + 1e-4) << n << ' ' << s;
    }
  }
}

// Texel edges where a map serves, from the emitted float32 matrix: the derivative of its products, inverted on the light plane.
TEST(Reference, PredictedErrors) {
  Random random(904);
  auto solution = std::make_unique<Solution>();
  constexpr double kInflated = 1e-6;  // as gnomon/error.h says
  for (int n = 0; n < 60; ++n) {
    Frame frame;
    frame.camera = someCamera(random, random.logUniform(2.0, 1e6), random.index(2) ? random.logUniform(1.0, 1e9) : 0.0);
    frame.light.directionWs = random.direction();
    const auto warp = static_cast<Warp>(random.index(6));
    ASSERT_EQ(solveLloyd(frame, {.warp = {.warp = warp}}, *solution), Status::ok);
    const Basis eye(frame.camera);
    const Vec z = unitOf(Vec(frame.light.directionWs)), a = unitOf(cross(z, z.x * z.x < Real(0.5) ? Vec(1, 0, 0) : Vec(0, 1, 0))),
              b = cross(z, a);
    for (int m = 0; m < solution->partitionCount; ++m) {
      const Partition& map = solution->partitions[m];
      Real most[2] = {0, 0};
      for (int corner = 0; corner < 8; ++corner) {
        const Camera& c = frame.camera;
        const Real depth = (corner & 4) ? map.far : map.near;
        const Vec p = eye.right * (depth * ((corner & 1) ? c.right : -c.left)) + eye.up * (depth * ((corner & 2) ? c.up : -c.down)) +
                      eye.forward * depth;
        const auto row = [&](int r) { return Vec(map.clipFromWorld[0][r], map.clipFromWorld[1][r], map.clipFromWorld[2][r]); };
        const auto at = [&](int r) { return dot(row(r), p) + Real(map.clipFromWorld[3][r]); };
        const Real w = at(3), pixel = depth * (Real(c.down) + c.up) / frame.image.height;
        const Vec s = (row(0) + row(3) * (-at(0) / w)) * (map.viewport.z / (2 * w)),
                  t = (row(1) + row(3) * (-at(1) / w)) * (map.viewport.w / (2 * w));
        const Real sa = dot(s, a), sb = dot(s, b), ta = dot(t, a), tb = dot(t, b), area = abs(sa * tb - sb * ta);
        const Real edges[2] = {sqrt(ta * ta + tb * tb) / area / pixel, sqrt(sa * sa + sb * sb) / area / pixel};
        for (int axis = 0; axis < 2; ++axis)
          if (edges[axis] > most[axis]) most[axis] = edges[axis];
      }
      // A whole frustum's errors are greatest at its corners: along any line of them texel edges over w_i have no maximum inside.
      EXPECT_GE(map.error.s * (1.0 + 1e-9), static_cast<double>(most[0])) << n << " warp " << static_cast<int>(map.warp);
      EXPECT_GE(map.error.t * (1.0 + 1e-9), static_cast<double>(most[1]));
      if (map.warp != Warp::none) continue;
      EXPECT_NEAR(ratio(map.error.s, most[0]), 1.0 + kInflated, 1e-9);
      EXPECT_NEAR(ratio(map.error.t, most[1]), 1.0 + kInflated, 1e-9);
    }
  }
}

// What a shader computes, in float32.
glm::dvec2 texelsInFloat(const Solution& solution, int map, const glm::vec3& rel) {
  const glm::mat4& m = solution.block.partitions[map].atlasFromWorld;
  const auto row = [&](int r) { return ((m[0][r] * rel.x + m[1][r] * rel.y) + m[2][r] * rel.z) + m[3][r]; };
  const float w = row(3);
  return {static_cast<double>(row(0) / w) * solution.atlas.x, static_cast<double>(row(1) / w) * solution.atlas.y};
}

// The map that fit.h defines, exactly, of the rectangle that the solve chose: texels of the atlas from world - eye.
struct Exact {
  Vec s, t, w;  // over light-space x, y, 1
  Vec x, y;  // light space in the world
  glm::dvec2 least, size;
  glm::ivec4 viewport;
  [[nodiscard]] std::pair<Real, Real> texels(const Vec& fromEye) const {
    const Vec ls(dot(fromEye, x), dot(fromEye, y), 1);
    const Real over = dot(w, ls);
    return {viewport.x + (dot(s, ls) / over - least.x) / size.x * viewport.z,
            viewport.y + (dot(t, ls) / over - least.y) / size.y * viewport.w};
  }
};

// Solves again by the stages to learn the rectangles, which are exact numbers; the light's axes are those of the double solve, too: any
// rotation of them by rounding is one of the rectangle.
std::vector<Exact> exactMaps(const Frame& frame, const Solution& solution, const WarpSettings& warp) {
  Region region;
  LightSpace light;
  Splits splits;
  int index = 0;
  double value = 0.0;
  EXPECT_EQ(makeRegion(frame, region, index, value), Status::ok);
  EXPECT_EQ(makeLightSpace(frame.light, region, FitMode::tight, light), Status::ok);
  EXPECT_EQ(split(region, {}, frame.budget.partitions, splits, value), Status::ok);
  auto maps = std::make_unique<MapFits>();
  fitMaps(frame, region, light, splits, {.warp = warp}, needsViewDepth(region, splits), *maps);
  std::vector<Exact> exact;
  for (int i = 0; i < splits.count; ++i) {
    std::uint32_t warnings = 0;
    MapFit& fit = maps->fits[i];
    EXPECT_EQ(growToViewport(frame, region, light, maps->footprints[i], FitMode::tight, solution.partitions[i].viewport, fit, warnings),
              Status::ok);
    const glm::dmat4& ls = light.lsFromWorld;
    exact.push_back({Vec(fit.s), Vec(fit.t), Vec(fit.w), Vec(glm::dvec3(ls[0][0], ls[1][0], ls[2][0])),
                     Vec(glm::dvec3(ls[0][1], ls[1][1], ls[2][1])), fit.least, fit.size, solution.partitions[i].viewport});
  }
  return exact;
}

struct Lost {
  double most = 0.0;  // texels, beyond what two units in the last place of the position account for
  double mostAtAll = 0.0;
};

Lost lostTexels(Random& random, const Frame& frame, const WarpSettings& warp, Solution& solution) {
  Lost lost;
  const std::vector<Exact> exact = exactMaps(frame, solution, warp);
  const glm::dvec3 eyeMinusOrigin = frame.camera.positionWs - solution.originWs;
  for (int m = 0; m < solution.partitionCount; ++m)
    for (int p = 0; p < 60; ++p) {
      const Partition& map = solution.partitions[m];
      const double z = random.logUniform(map.near, map.far);
      const glm::dvec3 fromEye = viewPoint(frame.camera, random.uniform(), random.uniform(), z);
      const glm::vec3 rel(fromEye + eyeMinusOrigin);  // what the shader is given
      const auto [x, y] = exact[static_cast<std::size_t>(m)].texels(Vec(glm::dvec3(rel)) + Vec(-eyeMinusOrigin));
      const glm::dvec2 got = texelsInFloat(solution, m, rel);
      const double error = std::max(apart(got.x, x), apart(got.y, y));
      double ulp = 0.0;
      for (int axis = 0; axis < 3; ++axis)
        ulp = std::max(ulp, static_cast<double>(std::nextafter(std::abs(rel[axis]), 1e38f) - std::abs(rel[axis])));
      const glm::dvec2 edges = measuredTexel(map, fromEye + eyeMinusOrigin, frame.light.directionWs, z * 1e-4);
      lost.most = std::max(lost.most, error - 2.0 * ulp / std::min(edges.x, edges.y));
      lost.mostAtAll = std::max(lost.mostAtAll, error);
    }
  return lost;
}

// 4096 texels, far over near to a million, the eye up to 1e9 from the world's origin.
TEST(Reference, CameraRelativeLookups) {
  Random random(905);
  auto solution = std::make_unique<Solution>();
  double most = 0.0;
  for (int n = 0; n < 120; ++n) {
    Frame frame;
    frame.camera = someCamera(random, random.logUniform(2.0, 1e6), random.index(2) ? random.logUniform(1.0, 1e9) : 0.0);
    frame.light.directionWs = random.direction();
    frame.budget.resolution = 4096;
    const WarpSettings warp{.warp = static_cast<Warp>(random.index(6))};
    ASSERT_EQ(solveLloyd(frame, {.warp = warp}, *solution), Status::ok);
    const Lost lost = lostTexels(random, frame, warp, *solution);
    EXPECT_LE(lost.most, 0.01) << n << " warp " << static_cast<int>(warp.warp) << " at all " << lost.mostAtAll << " R "
                               << frame.camera.far / frame.camera.near;
    most = std::max(most, lost.most);
  }
  RecordProperty("mostTexels", std::to_string(most));
}

// The same view as engines draw it: a look-at and an orthographic matrix in float32, in world space, around the same rectangle.
double lostByFloatFormulas(Random& random, const Frame& frame, const Solution& solution, int m) {
  const std::vector<Exact> exact = exactMaps(frame, solution, {});
  const Exact& map = exact[static_cast<std::size_t>(m)];
  const glm::dvec3 x(static_cast<double>(map.x.x), static_cast<double>(map.x.y), static_cast<double>(map.x.z)),
      y(static_cast<double>(map.y.x), static_cast<double>(map.y.y), static_cast<double>(map.y.z));
  const glm::dvec2 s(static_cast<double>(map.s.x), static_cast<double>(map.s.y)),
      t(static_cast<double>(map.t.x), static_cast<double>(map.t.y)), middle = map.least + map.size / 2.0;
  const glm::dvec3 across = x * s.x + y * s.y, up = x * t.x + y * t.y;
  const glm::vec3 centre(frame.camera.positionWs + across * middle.x + up * middle.y), direction(glm::normalize(frame.light.directionWs));
  const glm::vec2 half(map.size / 2.0);
  const glm::mat4 clipFromWorld =
      glm::ortho(-half.x, half.x, -half.y, half.y, -1000.0f, 1000.0f) * glm::lookAt(centre - direction, centre, glm::vec3(up));
  double most = 0.0;
  for (int p = 0; p < 400; ++p) {
    const double z = random.logUniform(solution.partitions[m].near, solution.partitions[m].far);
    const glm::vec3 ws(frame.camera.positionWs + viewPoint(frame.camera, random.uniform(), random.uniform(), z));
    const glm::vec4 clip = clipFromWorld * glm::vec4(ws, 1.0f);
    const auto [wantedX, wantedY] = map.texels(Vec(glm::dvec3(ws)) + Vec(-frame.camera.positionWs));
    const glm::dvec2 got =
        glm::dvec2(map.viewport.x, map.viewport.y) + (glm::dvec2(clip) * 0.5 + 0.5) * glm::dvec2(map.viewport.z, map.viewport.w);
    if (!std::isfinite(got.x + got.y)) return kInfinity;
    most = std::max({most, apart(got.x, wantedX), apart(got.y, wantedY)});
  }
  return most;
}

// World-space matrices lose texels with the distance from the world's origin. The status warns before a tenth of one is lost. The table is the README's.
TEST(Reference, WorldSpaceWarnsBeforeATenthOfATexelIsLost) {
  Random random(906);
  auto solution = std::make_unique<Solution>();
  std::printf("  offset  camera-relative  world space  warns  look-at and ortho\n");
  int warned = 0, silent = 0;
  for (double offset = 1.0; offset < 2e9; offset *= 10.0) {
    Frame frame;
    frame.camera = perspective(glm::dvec3(0.48, 0.6, 0.64) * offset, {0.3, -0.2, 1.0}, {0, 1, 0}, 1.0, 16.0 / 9.0, 0.1, 100.0);
    frame.camera.depth = DepthConvention::reversedZeroToOne;
    frame.light.directionWs = {0.3, -0.8, 0.2};
    ASSERT_EQ(solvePssm(frame, {}, *solution), Status::ok);
    const Lost relative = lostTexels(random, frame, {}, *solution);
    EXPECT_LE(relative.most, 0.01);
    const double byFormulas = lostByFloatFormulas(random, frame, *solution, 0);
    frame.worldSpace = true;
    const Status status = solvePssm(frame, {}, *solution);
    if (status != Status::ok) {
      EXPECT_EQ(status, Status::worldSpacePrecision);
      std::printf("  %6.0e  %15.4f  %11s  %5s  %17.2f\n", offset, relative.mostAtAll, "refused", "", byFormulas);
      ++warned;
      continue;
    }
    const bool isWarned = (solution->warnings & static_cast<std::uint32_t>(Warning::worldSpacePrecision)) != 0u;
    const Lost world = lostTexels(random, frame, {}, *solution);
    EXPECT_TRUE(isWarned || world.mostAtAll <= 0.1) << offset;
    (isWarned ? warned : silent) += 1;
    std::printf("  %6.0e  %15.4f  %11.4f  %5s  %17.2f\n", offset, relative.mostAtAll, world.mostAtAll, isWarned ? "yes" : "no", byFormulas);
  }
  EXPECT_GE(silent, 2);
  EXPECT_GE(warned, 2);
}

}  // namespace
}  // namespace gnomon::test
