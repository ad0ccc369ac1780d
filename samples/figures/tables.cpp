#include "tables.h"

#include <array>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>
#include <sstream>
#include <stdexcept>

#include <glm/glm.hpp>

namespace gnomon::figures {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr double kRadians = std::numbers::pi / 180.0;
constexpr double kTangent = 1.0 / std::numbers::sqrt3;  // theta = 30 degrees, as in [Lloyd 2006, fig. 12]
constexpr double kAlpha = 1000.0;  // f / n there
const glm::dvec3 kOverhead(0.0, -1.0, 0.0), kBehind(0.0, 0.0, -1.0);

// Rows of the emitted matrix, in texels of the viewport over w.
struct Rows {
  glm::dvec4 s, t, w;
  explicit Rows(const Partition& map) {
    const glm::dmat4 m = glm::transpose(glm::dmat4(map.clipFromWorld));
    s = m[0] * (map.viewport.z / 2.0);
    t = m[1] * (map.viewport.w / 2.0);
    w = m[3];
  }
  [[nodiscard]] glm::dvec2 texels(const glm::dvec3& p) const {
    const glm::dvec4 q(p, 1.0);
    return glm::dvec2(glm::dot(s, q), glm::dot(t, q)) / glm::dot(w, q);
  }
};

glm::dvec3 onPlane(const glm::dvec3& v, const glm::dvec3& normal) { return v - normal * glm::dot(v, normal); }

// True where the map's s is Lloyd's t: a warped map's lines of constant t are parallel, so that t's row lies along w's.
bool isTurned(const Frame& frame, const Partition& map, const Rows& rows) {
  const glm::dvec3 light = glm::normalize(frame.light.directionWs);
  const glm::dvec3 axis = onPlane(map.warp == Warp::none ? frame.camera.forwardWs : glm::dvec3(rows.w), light);
  const auto slant = [&](const glm::dvec4& row) {
    const glm::dvec3 slope = onPlane(glm::dvec3(row), light);
    return glm::length(glm::cross(slope, axis)) / glm::length(slope);
  };
  return slant(rows.s) < slant(rows.t);
}

glm::dvec2 widthsAt(const glm::dvec3& light, const Rows& rows, bool turned, const glm::dvec3& p) {
  const double w = glm::dot(rows.w, glm::dvec4(p, 1.0));
  const glm::dvec2 st = rows.texels(p);
  const glm::dvec3 s = onPlane(glm::dvec3(rows.s) - st.x * glm::dvec3(rows.w), light) / w,
                   t = onPlane(glm::dvec3(rows.t) - st.y * glm::dvec3(rows.w), light) / w;
  const double slope = glm::length(turned ? s : t);
  return {slope / std::abs(glm::dot(glm::cross(s, t), light)), 1.0 / slope};
}

// A half-space dot(xyz, position - origin) + w >= 0.
using HalfSpace = glm::dvec4;

std::vector<HalfSpace> servedSpaces(const Frame& frame, const Solution& solution, const Partition& map) {
  const Camera& camera = frame.camera;
  const glm::dvec3 forward = glm::normalize(camera.forwardWs), right = glm::normalize(glm::cross(forward, camera.upWs)),
                   up = glm::cross(right, forward), eye = camera.positionWs - solution.originWs;
  std::vector<HalfSpace> spaces;
  const auto add = [&](const glm::dvec3& normal, double offset) {
    spaces.emplace_back(glm::dvec4(normal, offset - glm::dot(normal, eye)) / glm::length(normal));
  };
  add(right + forward * camera.left, 0.0);
  add(-right + forward * camera.right, 0.0);
  add(up + forward * camera.down, 0.0);
  add(-up + forward * camera.up, 0.0);
  add(forward, -map.near);
  add(-forward, map.far);
  const auto addWorld = [&](const glm::dvec4& plane) {
    spaces.emplace_back(glm::dvec4(glm::dvec3(plane), plane.w + glm::dot(glm::dvec3(plane), solution.originWs)) /
                        glm::length(glm::dvec3(plane)));
  };
  for (int i = 0; i < map.planeCount; ++i) addWorld(map.planes[i]);
  for (const glm::dvec4& plane : frame.scene.planes) addWorld(plane);
  return spaces;
}

// Where three planes meet inside all the others: every vertex, some of them more than once.
std::vector<glm::dvec3> vertices(const std::vector<HalfSpace>& spaces) {
  std::vector<glm::dvec3> points;
  for (std::size_t i = 0; i < spaces.size(); ++i)
    for (std::size_t j = i + 1; j < spaces.size(); ++j)
      for (std::size_t k = j + 1; k < spaces.size(); ++k) {
        const glm::dvec3 a(spaces[i]), b(spaces[j]), c(spaces[k]);
        const double determinant = glm::dot(a, glm::cross(b, c));
        if (determinant == 0.0) continue;
        const glm::dvec3 p =
            -(spaces[i].w * glm::cross(b, c) + spaces[j].w * glm::cross(c, a) + spaces[k].w * glm::cross(a, b)) / determinant;
        bool isInside = std::isfinite(glm::dot(p, p));
        constexpr double kRounding = 1e-10;
        for (const HalfSpace& space : spaces)
          isInside = isInside && glm::dot(space, glm::dvec4(p, 1.0)) >= -kRounding * (glm::length(p) + std::abs(space.w));
        if (isInside) points.push_back(p);
      }
  return points;
}

glm::dvec3 lightFrom(double fromOverhead, double azimuth) {
  // azimuth 0: behind the viewer, so that the light goes along the view when it is low
  const double s = std::sin(fromOverhead);
  return {-s * std::sin(azimuth), -std::cos(fromOverhead), -s * std::cos(azimuth)};
}

}  // namespace

std::string csv(const Table& table) {
  std::ostringstream out;
  out.precision(12);
  for (std::size_t i = 0; i < table.columns.size(); ++i) out << (i ? "," : "") << table.columns[i];
  out << "\n";
  for (const auto& row : table.rows) {
    for (std::size_t i = 0; i < row.size(); ++i) {
      out << (i ? "," : "");
      if (std::isfinite(row[i])) out << row[i];
    }
    out << "\n";
  }
  return out.str();
}

glm::dvec2 lloydWidths(const Frame& frame, const Partition& map, const glm::dvec3& fromOrigin) {
  const Rows rows(map);
  return widthsAt(glm::normalize(frame.light.directionWs), rows, isTurned(frame, map, rows), fromOrigin);
}

glm::dvec2 lloydErrors(const Frame& frame, const Solution& solution, const Partition& map) {
  const Rows rows(map);
  const bool turned = isTurned(frame, map, rows);
  const glm::dvec3 light = glm::normalize(frame.light.directionWs), forward = glm::normalize(frame.camera.forwardWs),
                   eye = frame.camera.positionWs - solution.originWs;
  glm::dvec2 widest(0.0), least(kInfinity), most(-kInfinity);
  for (const glm::dvec3& p : vertices(servedSpaces(frame, solution, map))) {
    const double pixel = pixelWidth(frame.camera, frame.image, glm::dot(p - eye, forward)) * frame.image.height;
    widest = glm::max(widest, widthsAt(light, rows, turned, p) / pixel);
    const glm::dvec2 st = rows.texels(p);
    least = glm::min(least, st);
    most = glm::max(most, st);
  }
  const glm::dvec2 span = most - least;
  return widest * (turned ? glm::dvec2(span.y, span.x) : span);
}

double lloydStorage(const Frame& frame, const Solution& solution) {
  double sum = 0.0;
  for (int i = 0; i < solution.partitionCount; ++i) {
    const glm::dvec2 errors = lloydErrors(frame, solution, solution.partitions[i]);
    sum += errors.x * errors.y;
  }
  return sum;
}

Frame squareView(double alpha, double halfFovTangent, const glm::dvec3& lightWs, int maps) {
  Frame frame;
  frame.camera = perspective({0, 0, 0}, {0, 0, -1}, {0, 1, 0}, 2.0 * std::atan(halfFovTangent), 1.0, 1.0, alpha);
  frame.camera.depth = DepthConvention::reversedZeroToOne;  // slices are padded least
  frame.light.directionWs = lightWs;
  frame.image = {1024.0, 1024.0};
  frame.budget.partitions = maps;
  return frame;
}

void solve(const Frame& frame, LloydScheme scheme, const WarpSettings& warp, Solution& solution) {
  if (solveLloyd(frame, {.scheme = scheme, .split = {}, .warp = warp}, solution) != Status::ok)
    throw std::runtime_error(std::string(statusField(solution.status)) + " " + statusRule(solution.status));
  if (solution.warnings & static_cast<std::uint32_t>(Warning::facesMissing)) throw std::runtime_error(warningText(Warning::facesMissing));
}

namespace {

constexpr WarpSettings kPlain{.warp = Warp::none}, kLispsm{.warp = Warp::lispsm};

struct Storage {
  double lloyd = kNone, edges = kNone;
};

// Both measures of what one solve needs.
Storage emitted(const Frame& frame, LloydScheme scheme, const WarpSettings& warp) {
  const auto solution = std::make_unique<Solution>();
  solve(frame, scheme, warp, *solution);
  return {lloydStorage(frame, *solution), solution->storageFactor};
}

// Faces under light from behind with more maps than one solve may have: each side by itself, and the near plane's map of the whole view.
Storage emittedSideBySide(double alpha, double halfFovTangent, int rows) {
  const auto solution = std::make_unique<Solution>();
  const auto add = [&](const Frame& frame, int from, int to, double times, Storage& sum) {
    for (int i = from; i < to; ++i) {
      const Partition& map = solution->partitions[i];
      const glm::dvec2 errors = lloydErrors(frame, *solution, map);
      sum.lloyd += times * errors.x * errors.y;
      sum.edges += times * map.error.s * map.error.t * map.viewport.z * map.viewport.w / (frame.image.width * frame.image.height);
    }
  };
  Storage sum{0.0, 0.0};
  Frame frame = squareView(alpha, halfFovTangent, kBehind, 5);
  solve(frame, LloydScheme::fpw, kLispsm, *solution);
  add(frame, 0, 1, 1.0, sum);
  constexpr double kInside = 1e-7;  // a quarter of the view that holds nothing of its neighbours, not even their edges
  const std::array<glm::dvec4, 2> wedge{{{1, 1.0 - kInside, 0, 0}, {-1, 1.0 - kInside, 0, 0}}};
  frame.scene.planes = wedge;
  frame.budget.partitions = rows + 1;
  solve(frame, LloydScheme::fpzpw, kLispsm, *solution);
  add(frame, 1, solution->partitionCount, 4.0, sum);
  return sum;
}

// m_x and m_z at a view depth, n = 1.  [Lloyd 2006, eq. 7 and 8]
glm::dvec2 overheadErrorsAt(double alpha, double halfFovTangent, double distance, double z) {
  const double length = (alpha - 1.0) / (2.0 * halfFovTangent);
  if (!std::isfinite(distance)) return {alpha / z, length / z};
  const double here = distance + z - 1.0, far = distance + alpha - 1.0;
  return {alpha * here / (z * far), length * here * here / (z * distance * far)};
}

}  // namespace

double storageBehindFaces(double alpha, int maps) {
  double sum = 1.0;
  for (int side = 0; side < 4; ++side)
    sum += storageOverheadZpW(alpha, 1.0, (maps - 1) / 4 + (side < (maps - 1) % 4 ? 1 : 0));  // [Lloyd 2006, eq. 21]
  return sum;
}

Table errorAlongView() {
  constexpr double kF = 20.0;
  Table table{"error_along_view", {"eta", "z", "x", "z_error", "emitted_x", "emitted_z"}, {}};
  const auto solution = std::make_unique<Solution>();
  for (const double eta : {-1.0, -0.5, 0.0, 0.5, 1.0}) {
    const Frame frame = squareView(kF, kTangent, kOverhead, 1);
    solve(frame, LloydScheme::w, {.warp = Warp::eta, .eta = eta}, *solution);
    const Partition& map = solution->partitions[0];
    const Rows rows(map);
    const bool turned = isTurned(frame, map, rows);
    const double far = kF * kTangent;
    const glm::dvec2 across = glm::abs(rows.texels({far, 0, -kF}) - rows.texels({-far, 0, -kF})),
                     along = glm::abs(rows.texels({0, 0, -kF}) - rows.texels({0, 0, -1}));
    const glm::dvec2 span = turned ? glm::dvec2(across.y, along.x) : glm::dvec2(across.x, along.y);
    for (int i = 0; i <= 30; ++i) {
      const double z = std::pow(kF, i / 30.0);
      const glm::dvec2 form = overheadErrorsAt(kF, kTangent, warpDistance(eta, kF), z);
      const glm::dvec2 error = lloydWidths(frame, map, {0, 0, -z}) * span / (2.0 * z * kTangent);
      const bool isMarked = i % 3 == 0;
      table.rows.push_back({eta, z, form.x, form.y, isMarked ? error.x : kNone, isMarked ? error.y : kNone});
    }
  }
  return table;
}

Table errorAgainstWarp() {
  constexpr double kF = 100.0;
  Table table{"error_against_warp", {"eta", "M_x", "M_z", "S", "emitted_x", "emitted_z", "emitted_S", "edges_S"}, {}};
  const auto solution = std::make_unique<Solution>();
  for (int i = -40; i <= 40; ++i) {
    const double eta = i / 40.0;
    const glm::dvec2 form = overheadErrors(kF, kTangent, warpDistance(eta, kF));
    std::vector<double> row{eta, form.x, form.y, form.x * form.y, kNone, kNone, kNone, kNone};
    if (i % 4 == 0) {
      const Frame frame = squareView(kF, kTangent, kOverhead, 1);
      solve(frame, LloydScheme::w, {.warp = Warp::eta, .eta = eta}, *solution);
      const glm::dvec2 errors = lloydErrors(frame, *solution, solution->partitions[0]);
      row[4] = errors.x;
      row[5] = errors.y;
      row[6] = errors.x * errors.y;
      row[7] = solution->storageFactor;
    }
    table.rows.push_back(std::move(row));
  }
  return table;
}

Table storageOverLights() {
  constexpr int kHalf = 50;
  Table table{"storage_over_lights", {"x", "y", "plain", "warped", "faces", "slices"}, {}};
  for (int j = -kHalf; j <= kHalf; ++j)
    for (int i = -kHalf; i <= kHalf; ++i) {
      const double x = static_cast<double>(i) / kHalf, y = static_cast<double>(j) / kHalf, radius = std::hypot(x, y);
      if (radius > 1.0) {
        table.rows.push_back({x, y, kNone, kNone, kNone, kNone});
        continue;
      }
      const glm::dvec3 light = lightFrom(radius * 90.0 * kRadians, std::atan2(y, -x));
      table.rows.push_back({x, y, emitted(squareView(kAlpha, kTangent, light, 1), LloydScheme::w, kPlain).lloyd,
                            emitted(squareView(kAlpha, kTangent, light, 1), LloydScheme::w, kLispsm).lloyd,
                            emitted(squareView(kAlpha, kTangent, light, 5), LloydScheme::fpw, kLispsm).lloyd,
                            emitted(squareView(kAlpha, kTangent, light, 4), LloydScheme::zpw, kLispsm).lloyd});
    }
  return table;
}

Table storageAgainstSlices() {
  Table table{"storage_against_slices", {"k", "zp", "zpw", "optimal", "emitted_zp", "emitted_zpw", "edges_zpw"}, {}};
  for (int k = 1; k <= kMaxPartitions; ++k) {
    const Frame frame = squareView(kAlpha, kTangent, kOverhead, k);
    const Storage warped = emitted(frame, LloydScheme::zpw, kLispsm);
    table.rows.push_back({static_cast<double>(k), storageOverheadZp(kAlpha, kTangent, k), storageOverheadZpW(kAlpha, kTangent, k),
                          storageOverheadOptimal(kAlpha, kTangent), emitted(frame, LloydScheme::zp, kPlain).lloyd, warped.lloyd,
                          warped.edges});
  }
  return table;
}

Table storageAgainstMaps() {
  constexpr int kMost = 32;
  Table table{"storage_against_maps",
              {"maps", "overhead_zp", "overhead_zpw", "overhead_fp", "behind_zp", "behind_fp", "emitted_overhead_zp",
               "emitted_overhead_zpw", "emitted_overhead_fp", "emitted_behind_zp", "emitted_behind_fp", "edges_behind_fp"},
              {}};
  for (int maps = 1; maps <= kMost; ++maps) {
    // The same rows for every light, as the paper wants it: one for each four maps.
    const int rows = maps / 4;
    std::vector<double> row{static_cast<double>(maps),
                            storageOverheadZp(kAlpha, kTangent, maps),
                            storageOverheadZpW(kAlpha, kTangent, maps),
                            rows > 0 ? storageOverheadZpW(kAlpha, kTangent, rows) : kNone,
                            storageBehindZp(kAlpha, maps),
                            maps >= 5 ? storageBehindFaces(kAlpha, maps) : kNone,
                            kNone,
                            kNone,
                            kNone,
                            kNone,
                            kNone,
                            kNone};
    if (maps <= kMaxPartitions) {
      row[6] = emitted(squareView(kAlpha, kTangent, kOverhead, maps), LloydScheme::zp, kPlain).lloyd;
      row[7] = emitted(squareView(kAlpha, kTangent, kOverhead, maps), LloydScheme::zpw, kLispsm).lloyd;
      row[9] = emitted(squareView(kAlpha, kTangent, kBehind, maps), LloydScheme::zpw, kLispsm).lloyd;
    }
    if (rows > 0) row[8] = emitted(squareView(kAlpha, kTangent, kOverhead, rows), LloydScheme::fpzpw, kLispsm).lloyd;
    Storage faces;
    if (maps >= 5 && maps <= kMaxPartitions)
      faces = emitted(squareView(kAlpha, kTangent, kBehind, maps), LloydScheme::fpzpw, kLispsm);
    else if (maps > kMaxPartitions && (maps - 1) % 4 == 0)
      faces = emittedSideBySide(kAlpha, kTangent, rows);
    row[10] = faces.lloyd;
    row[11] = faces.edges;
    table.rows.push_back(std::move(row));
  }
  return table;
}

Table facesAgainstSlices() {
  constexpr int kMost = 32;
  Table table{"faces_against_slices", {"maps", "equal_rows", "any_rows", "emitted", "edges"}, {}};
  // The greatest f/n at which faces need less than the best number of slices up to that many maps; faces win below it.
  const auto crossing = [](auto&& facesLessSlices) {
    double low = std::log(1.5), high = std::log(1e6);
    if (facesLessSlices(std::exp(low)) >= 0.0) return kNone;
    constexpr int kHalvings = 40;
    for (int i = 0; i < kHalvings; ++i) {
      const double middle = (low + high) / 2.0;
      (facesLessSlices(std::exp(middle)) < 0.0 ? low : high) = middle;
    }
    return std::exp(low);
  };
  for (int maps = 5; maps <= kMost; ++maps) {
    const auto slices = [&](double alpha, auto&& storage) {
      double least = kInfinity;
      for (int k = 1; k <= maps; ++k) least = std::min(least, storage(alpha, k));
      return least;
    };
    const auto behind = [](double alpha, int k) { return storageBehindZp(alpha, k); };
    const auto emits = [&](double Storage::*measure) {
      if (maps > kMaxPartitions) return kNone;
      return crossing([&](double alpha) {
        // More slices help up to 2 ln(f/n): the least lies beside it.
        const int best = std::min(maps, std::max(1, static_cast<int>(2.0 * std::log(alpha))));
        double least = kInfinity;
        for (int k = best; k <= std::min(best + 1, maps); ++k)
          least = std::min(least, emitted(squareView(alpha, kTangent, kBehind, k), LloydScheme::zpw, kLispsm).*measure);
        return emitted(squareView(alpha, kTangent, kBehind, maps), LloydScheme::fpzpw, kLispsm).*measure - least;
      });
    };
    table.rows.push_back({static_cast<double>(maps),
                          crossing([&](double alpha) { return storageBehindFpZpW(alpha, (maps - 1) / 4) - slices(alpha, behind); }),
                          crossing([&](double alpha) { return storageBehindFaces(alpha, maps) - slices(alpha, behind); }),
                          emits(&Storage::lloyd), emits(&Storage::edges)});
  }
  return table;
}

Table worstOverLights(double stepDegrees) {
  Table table{"worst_over_lights", {"theta", "alpha", "faces", "warped", "maps", "behind", "worst", "ratio", "edges_ratio"}, {}};
  struct Choice {
    LloydScheme scheme;
    WarpSettings warp;
    int maps;
  };
  std::vector<Choice> choices;
  for (const int maps : {1, 4, 16}) choices.push_back({LloydScheme::zp, kPlain, maps});
  for (const int maps : {1, 4, 16}) choices.push_back({LloydScheme::zpw, kLispsm, maps});
  for (const int maps : {5, 9, 13}) choices.push_back({LloydScheme::fpzpw, kLispsm, maps});
  for (const double theta : {5.0, 15.0, 30.0, 45.0})
    for (const double alpha : {10.0, kAlpha})
      for (const auto& [scheme, warp, maps] : choices) {
        Storage worst{0.0, 0.0};
        // A square view looks alike from four quarters of the hemisphere.
        for (double down = 0.0; down <= 90.0; down += stepDegrees)
          for (double azimuth = 0.0; azimuth <= 90.0; azimuth += stepDegrees) {
            const Frame frame = squareView(alpha, std::tan(theta * kRadians), lightFrom(down * kRadians, azimuth * kRadians), maps);
            const Storage storage = emitted(frame, scheme, warp);
            worst = {std::max(worst.lloyd, storage.lloyd), std::max(worst.edges, storage.edges)};
          }
        const bool hasFaces = scheme == LloydScheme::fpzpw;
        const double behind = hasFaces ? storageBehindFaces(alpha, maps) : storageBehindZp(alpha, maps);
        table.rows.push_back({theta, alpha, hasFaces ? 1.0 : 0.0, warp.warp == Warp::none ? 0.0 : 1.0, static_cast<double>(maps), behind,
                              worst.lloyd, worst.lloyd / behind, worst.edges / behind});
      }
  return table;
}

Table warpsAgainstLight() {
  constexpr double kF = 100.0;
  Table table{"warps_against_light", {"degrees", "plain", "lispsm", "psm", "tsm"}, {}};
  for (int degrees = 0; degrees <= 90; ++degrees) {
    std::vector<double> row{static_cast<double>(degrees)};
    for (const Warp warp : {Warp::none, Warp::lispsm, Warp::psm, Warp::tsm})
      row.push_back(emitted(squareView(kF, kTangent, lightFrom(degrees * kRadians, 0.0), 1), LloydScheme::w, {.warp = warp}).lloyd);
    table.rows.push_back(std::move(row));
  }
  return table;
}

}  // namespace gnomon::figures
