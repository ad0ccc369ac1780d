#include "shapes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <map>
#include <numbers>
#include <utility>

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

namespace gnomon::offscreen {
namespace {

constexpr double kTurn = 2.0 * std::numbers::pi;  // radians

std::uint64_t scramble(std::uint64_t x) {  // splitmix64's output function
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

double toUnit(std::uint64_t bits) { return static_cast<double>(bits >> 11) * 0x1p-53; }

}  // namespace

double Random::unit() {
  state += 0x9e3779b97f4a7c15u;
  return toUnit(scramble(state));
}

double Random::between(double low, double high) { return low + (high - low) * unit(); }

int Random::below(int count) { return static_cast<int>(unit() * count); }

double latticeNoise(int x, int y, std::uint32_t seed) {
  const std::uint64_t key = (static_cast<std::uint64_t>(static_cast<std::uint32_t>(x)) << 32) | static_cast<std::uint32_t>(y);
  return toUnit(scramble(scramble(key) + 0x9e3779b97f4a7c15u * (seed + std::uint64_t{1})));
}

double smoothNoise(glm::dvec2 p, std::uint32_t seed) {
  const double fx = std::floor(p.x), fy = std::floor(p.y);
  const int x = static_cast<int>(fx), y = static_cast<int>(fy);
  const auto ease = [](double t) { return t * t * t * (t * (t * 6.0 - 15.0) + 10.0); };
  const double u = ease(p.x - fx), v = ease(p.y - fy);
  const double low = latticeNoise(x, y, seed) * (1.0 - u) + latticeNoise(x + 1, y, seed) * u;
  const double high = latticeNoise(x, y + 1, seed) * (1.0 - u) + latticeNoise(x + 1, y + 1, seed) * u;
  return low * (1.0 - v) + high * v;
}

double ridgedNoise(glm::dvec2 p, int octaves, std::uint32_t seed) {
  double sum = 0.0, weight = 1.0, total = 0.0;
  for (int i = 0; i < octaves; ++i) {
    const double ridge = 1.0 - std::abs(2.0 * smoothNoise(p, seed + static_cast<std::uint32_t>(i)) - 1.0);
    sum += weight * ridge * ridge;
    total += weight;
    weight *= 0.45;
    p = glm::dvec2(1.6 * p.x + 1.2 * p.y + 17.3, -1.2 * p.x + 1.6 * p.y - 9.1);  // doubled and turned, so that no lattice shows
  }
  return sum / total;
}

glm::dmat4 standing(const glm::dvec3& atWs, double turn) {
  const double c = std::cos(turn), s = std::sin(turn);
  return glm::dmat4(glm::dvec4(c, 0.0, -s, 0.0), glm::dvec4(0.0, 1.0, 0.0, 0.0), glm::dvec4(s, 0.0, c, 0.0), glm::dvec4(atWs, 1.0));
}

glm::dmat4 along(const glm::dvec3& fromWs, const glm::dvec3& towardsWs) {
  const glm::dvec3 y = glm::normalize(towardsWs - fromWs);
  const glm::dvec3 aside = std::abs(y.y) < 0.9 ? glm::dvec3(0.0, 1.0, 0.0) : glm::dvec3(1.0, 0.0, 0.0);
  const glm::dvec3 x = glm::normalize(glm::cross(aside, y));
  return glm::dmat4(glm::dvec4(x, 0.0), glm::dvec4(y, 0.0), glm::dvec4(glm::cross(x, y), 0.0), glm::dvec4(fromWs, 1.0));
}

std::uint32_t Shapes::vertex(const glm::dvec3& positionWs) {
  mesh.positionsWs.emplace_back(positionWs);
  return static_cast<std::uint32_t>(mesh.positionsWs.size() - 1);
}

void Shapes::triangle(std::uint32_t a, std::uint32_t b, std::uint32_t c) { mesh.indices.insert(mesh.indices.end(), {a, b, c}); }

void Shapes::quad(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) {
  triangle(a, b, c);
  triangle(a, c, d);
}

void Shapes::box(const glm::dvec3& minWs, const glm::dvec3& maxWs) { box(glm::dmat4(1.0), minWs, maxWs); }

void Shapes::box(const glm::dmat4& worldFromLocal, const glm::dvec3& min, const glm::dvec3& max) {
  std::array<std::uint32_t, 8> v{};  // bit 0: x, bit 1: y, bit 2: z
  for (std::size_t i = 0; i < 8; ++i) {
    const glm::dvec4 corner((i & 1) ? max.x : min.x, (i & 2) ? max.y : min.y, (i & 4) ? max.z : min.z, 1.0);
    v[i] = vertex(glm::dvec3(worldFromLocal * corner));
  }
  quad(v[0], v[4], v[6], v[2]);  // -x
  quad(v[1], v[3], v[7], v[5]);  // +x
  quad(v[0], v[1], v[5], v[4]);  // -y
  quad(v[2], v[6], v[7], v[3]);  // +y
  quad(v[0], v[2], v[3], v[1]);  // -z
  quad(v[4], v[5], v[7], v[6]);  // +z
}

void Shapes::joinRings(std::uint32_t first, int rings, int sides) {
  const auto n = static_cast<std::uint32_t>(sides);
  for (std::uint32_t r = 0; r + 1 < static_cast<std::uint32_t>(rings); ++r) {
    const std::uint32_t low = first + r * n, high = low + n;
    for (std::uint32_t s = 0; s < n; ++s) {
      const std::uint32_t next = (s + 1) % n;
      quad(low + s, low + next, high + next, high + s);
    }
  }
  const std::uint32_t top = first + static_cast<std::uint32_t>(rings - 1) * n;
  for (std::uint32_t s = 1; s + 1 < n; ++s) {
    triangle(first, first + s + 1, first + s);
    triangle(top, top + s, top + s + 1);
  }
}

void Shapes::lathe(const glm::dmat4& worldFromLocal, std::span<const glm::dvec2> profile, int sides, const glm::dvec2& topSlope) {
  const auto first = static_cast<std::uint32_t>(mesh.positionsWs.size());
  for (std::size_t r = 0; r < profile.size(); ++r) {
    for (int s = 0; s < sides; ++s) {
      // Half a side of phase, and the angle runs from x towards -z: counter-clockwise seen from above.
      const double angle = kTurn * (s + 0.5) / sides;
      const glm::dvec2 xz(profile[r].x * std::cos(angle), -profile[r].x * std::sin(angle));
      const double tilt = r + 1 == profile.size() ? glm::dot(topSlope, xz) : 0.0;
      vertex(glm::dvec3(worldFromLocal * glm::dvec4(xz.x, profile[r].y + tilt, xz.y, 1.0)));
    }
  }
  joinRings(first, static_cast<int>(profile.size()), sides);
}

void Shapes::lathe(const glm::dmat4& worldFromLocal, std::initializer_list<glm::dvec2> profile, int sides, const glm::dvec2& topSlope) {
  lathe(worldFromLocal, std::span<const glm::dvec2>(profile.begin(), profile.size()), sides, topSlope);
}

void Shapes::rod(std::span<const glm::dvec3> pathWs, double radius, int sides) {
  const auto first = static_cast<std::uint32_t>(mesh.positionsWs.size());
  // One frame for the whole path: paths here never turn back on themselves, so rings cannot cross.
  const glm::dmat4 frame = along(pathWs.front(), pathWs.back());
  for (const glm::dvec3& point : pathWs) {
    for (int s = 0; s < sides; ++s) {
      const double angle = kTurn * (s + 0.5) / sides;
      vertex(point + radius * (std::cos(angle) * glm::dvec3(frame[0]) - std::sin(angle) * glm::dvec3(frame[2])));
    }
  }
  joinRings(first, static_cast<int>(pathWs.size()), sides);
}

void Shapes::rod(const glm::dvec3& fromWs, const glm::dvec3& toWs, double radius, int sides) {
  const std::array<glm::dvec3, 2> path{fromWs, toWs};
  rod(path, radius, sides);
}

void Shapes::rope(const glm::dvec3& fromWs, const glm::dvec3& toWs, double sag, double radius, int segments) {
  std::vector<glm::dvec3> path;
  for (int i = 0; i <= segments; ++i) {
    const double t = static_cast<double>(i) / segments;
    path.push_back(fromWs + (toWs - fromWs) * t - glm::dvec3(0.0, 4.0 * sag * t * (1.0 - t), 0.0));
  }
  rod(path, radius, 4);
}

void Shapes::boulder(const glm::dvec3& centreWs, const glm::dvec3& radii, std::uint64_t seed) {
  // An icosahedron, each face cut in four, each vertex moved in or out.
  const double g = std::numbers::phi;
  std::vector<glm::dvec3> points{{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                                 {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
  constexpr std::array<std::array<std::uint32_t, 3>, 20> kFaces{
      {{0, 11, 5}, {0, 5, 1}, {0, 1, 7}, {0, 7, 10}, {0, 10, 11}, {1, 5, 9}, {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
       {3, 9, 4},  {3, 4, 2}, {3, 2, 6}, {3, 6, 8},  {3, 8, 9},   {4, 9, 5}, {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}}};
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> middles;
  const auto middle = [&](std::uint32_t a, std::uint32_t b) {
    const auto [found, isNew] = middles.try_emplace(std::minmax(a, b), static_cast<std::uint32_t>(points.size()));
    if (isNew) points.push_back(0.5 * (points[a] + points[b]));
    return found->second;
  };
  const auto first = static_cast<std::uint32_t>(mesh.positionsWs.size());
  const auto face = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) { triangle(first + a, first + b, first + c); };
  for (const auto& f : kFaces) {
    const std::uint32_t ab = middle(f[0], f[1]), bc = middle(f[1], f[2]), ca = middle(f[2], f[0]);
    face(f[0], ab, ca);
    face(f[1], bc, ab);
    face(f[2], ca, bc);
    face(ab, bc, ca);
  }
  Random random(seed);
  for (const glm::dvec3& point : points) vertex(centreWs + radii * (glm::normalize(point) * random.between(0.8, 1.15)));
}

void Shapes::sheet(std::span<const glm::dvec3> pointsWs, int columns, int rows) {
  const auto first = static_cast<std::uint32_t>(mesh.positionsWs.size());
  for (const glm::dvec3& point : pointsWs) vertex(point);
  const auto stride = static_cast<std::uint32_t>(columns + 1);
  for (std::uint32_t r = 0; r < static_cast<std::uint32_t>(rows); ++r) {
    for (std::uint32_t c = 0; c < static_cast<std::uint32_t>(columns); ++c) {
      const std::uint32_t low = first + r * stride + c, high = low + stride;
      quad(low, low + 1, high + 1, high);
    }
  }
}

Mesh Shapes::take() {
  mesh.min = glm::dvec3(std::numeric_limits<double>::infinity());
  mesh.max = -mesh.min;
  for (const glm::vec3& position : mesh.positionsWs) {
    mesh.min = glm::min(mesh.min, glm::dvec3(position));
    mesh.max = glm::max(mesh.max, glm::dvec3(position));
  }
  return std::move(mesh);
}

}  // namespace gnomon::offscreen
