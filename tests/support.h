// support: views, lights and an independent check of a solution, shared by the tests. Nothing here calls the code under test
// but for reading its answers.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <vector>

#include <glm/glm.hpp>
#include <gtest/gtest.h>

#include "finite.h"

#include "gnomon/gnomon.h"

namespace gnomon::test {

inline constexpr double kPi = 3.14159265358979323846;

// SplitMix64: small, deterministic, the same on every platform.
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}
  double uniform(double from = 0.0, double to = 1.0) { return from + (to - from) * (static_cast<double>(next() >> 11) * 0x1p-53); }
  double logUniform(double from, double to) { return from * std::pow(to / from, uniform()); }
  int index(int count) { return static_cast<int>(next() % static_cast<std::uint64_t>(count)); }
  glm::dvec3 direction() {
    const double z = uniform(-1.0, 1.0), a = uniform(0.0, 2.0 * kPi), r = std::sqrt(1.0 - z * z);
    return {r * std::cos(a), r * std::sin(a), z};
  }

 private:
  std::uint64_t next() {
    std::uint64_t z = (state_ += 0x9e3779b97f4a7c15ULL);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
    return z ^ (z >> 31);
  }
  std::uint64_t state_;
};

// A usual view: near 0.1, far 100, 60 degrees, 16:9, tilted down, sun from the side.
inline Frame usualFrame() {
  Frame frame;
  frame.camera = perspective({1.0, 2.0, 3.0}, {0.3, -0.2, 1.0}, {0.0, 1.0, 0.0}, kPi / 3.0, 16.0 / 9.0, 0.1, 100.0);
  frame.light.directionWs = {0.3, -0.8, 0.2};
  return frame;
}

inline std::unique_ptr<Solution> solve(const Frame& frame, const PssmSettings& settings = {}) {
  auto solution = std::make_unique<Solution>();
  (void)solvePssm(frame, settings, *solution);
  return solution;
}

// The camera's axes, from the definition (right-handed world, right = forward x up).
struct Axes {
  glm::dvec3 right, up, forward;
  explicit Axes(const Camera& camera) : forward(unitOf(camera.forwardWs)) {
    const glm::dvec3 across = unitOf(glm::cross(forward, unitOf(camera.upWs)));
    right = unitOf(across - forward * glm::dot(forward, across));  // the product of nearly parallel vectors is only roughly across
    up = glm::cross(right, forward);
  }
  static glm::dvec3 unitOf(const glm::dvec3& v) {
    const double most = std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
    return glm::normalize(glm::dvec3(v.x / most, v.y / most, v.z / most));
  }
};

// A point of the view volume: x, y in [0, 1] across the image, at a view depth; relative to the eye.
inline glm::dvec3 viewPoint(const Camera& camera, double x, double y, double z) {
  const Axes axes(camera);
  const double k = camera.projection == Projection::perspective ? z : 1.0;
  return axes.forward * z + axes.right * (k * (x * (camera.left + camera.right) - camera.left)) +
         axes.up * (k * (y * (camera.down + camera.up) - camera.down));
}

inline double pixelAt(const Frame& frame, double z) {
  const double h = (frame.camera.down + frame.camera.up) / frame.image.height;
  return frame.camera.projection == Projection::perspective ? z * h : h;
}

// Texel edges (s, t) at a point, by central differences of the emitted matrix in double: not by any formula of the library.
inline glm::dvec2 measuredTexel(const Partition& map, const glm::dvec3& rel, const glm::dvec3& light, double step) {
  const glm::dvec3 d = glm::normalize(light),
                   a = glm::normalize(glm::cross(d, std::abs(d.x) < 0.6 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 0, 1))), b = glm::cross(d, a);
  const auto texels = [&](const glm::dvec3& p) {
    const glm::dvec4 q = glm::dmat4(map.clipFromWorld) * glm::dvec4(p, 1.0);
    return glm::dvec2(q) / q.w * glm::dvec2(map.viewport.z, map.viewport.w) / 2.0;
  };
  const glm::dvec2 da = (texels(rel + a * step) - texels(rel - a * step)) / (2.0 * step),
                   db = (texels(rel + b * step) - texels(rel - b * step)) / (2.0 * step);
  const double det = std::abs(da.x * db.y - db.x * da.y);
  return {std::hypot(da.y, db.y) / det, std::hypot(da.x, db.x) / det};
}

inline bool needsShadow(const Frame& frame, const glm::dvec3& ws) {
  bool isReceiver = frame.scene.receivers.empty();
  for (const Box& box : frame.scene.receivers)
    isReceiver |= glm::all(glm::greaterThanEqual(ws, box.minWs)) && glm::all(glm::lessThanEqual(ws, box.maxWs));
  for (const glm::dvec4& plane : frame.scene.planes) isReceiver &= glm::dot(glm::dvec3(plane), ws) + plane.w >= 0.0;
  return isReceiver;
}

// The partition whose interval holds a view depth, half-open where the next one begins; -1: none. Free ends may be off by the
// rounding of positions and of z itself.
inline int servedBy(const Solution& solution, double z, double rounding) {
  for (int i = 0; i < solution.partitionCount; ++i) {
    const Partition& map = solution.partitions[i];
    const bool isOpen = i + 1 < solution.partitionCount && solution.partitions[i + 1].near == map.far;
    const bool isJoined = i > 0 && solution.partitions[i - 1].far == map.near;
    if (z >= map.near - (isJoined ? 0.0 : rounding) && (isOpen ? z < map.far : z <= map.far + rounding)) return i;
  }
  return -1;
}

struct Coverage {
  int points = 0, uncovered = 0;
  double worst = 0.0;  // measured over predicted error
};

// Checks one point relative to the eye: served, inside its map (clip slack 1e-6 as float32 leaves), no less sharp than predicted.
inline void check(const Frame& frame, const Solution& solution, const glm::dvec3& fromEye, double z, Coverage& coverage) {
  const glm::dvec3 ws = frame.camera.positionWs + fromEye;
  if (!needsShadow(frame, ws)) return;
  ++coverage.points;
  const int i = servedBy(solution, z, 1e-9 * std::abs(z) + 1e-15 * glm::length(frame.camera.positionWs));
  if (i < 0) {
    ++coverage.uncovered;
    return;
  }
  const Partition& map = solution.partitions[i];
  const glm::dvec3 rel = ws - solution.originWs;
  const glm::dvec4 q = glm::dmat4(map.clipFromWorld) * glm::dvec4(rel, 1.0);
  const glm::dvec3 ndc = glm::dvec3(q) / q.w;
  constexpr double kSlack = 1e-6;
  const double lowest = frame.shadowMap.depth == DepthConvention::negativeOneToOne ? -1.0 : 0.0;
  const bool isInside =
      q.w > 0.0 && std::abs(ndc.x) <= 1.0 + kSlack && std::abs(ndc.y) <= 1.0 + kSlack && ndc.z >= lowest - kSlack && ndc.z <= 1.0 + kSlack;
  coverage.uncovered += !isInside;
  const double pixel = pixelAt(frame, z);
  const glm::dvec2 texel = measuredTexel(map, rel, frame.light.directionWs, pixel * 1e3) / pixel;
  coverage.worst = std::max({coverage.worst, texel.x / map.error.s, texel.y / map.error.t});
}

// A grid over the view volume with its edges, depths spaced by ratio, and the boxes themselves.
inline Coverage checkAll(const Frame& frame, const Solution& solution, int across = 7, int deep = 41) {
  Coverage coverage;
  const Camera& camera = frame.camera;
  const double far = std::min(camera.far, camera.shadowDistance), near = camera.near;
  if (!(far > near)) return coverage;
  const bool isRatio = camera.projection == Projection::perspective;
  const auto at = [&](double z) {
    for (int x = 0; x < across; ++x)
      for (int y = 0; y < across; ++y) check(frame, solution, viewPoint(camera, x / (across - 1.0), y / (across - 1.0), z), z, coverage);
  };
  for (int k = 0; k < deep; ++k) {
    const double share = k / (deep - 1.0);
    at(std::min(isRatio ? near * std::pow(far / near, share) : near + (far - near) * share, far));
  }
  for (int i = 0; i < solution.partitionCount; ++i) at(solution.partitions[i].near);
  const Axes axes(camera);
  for (const Box& box : frame.scene.receivers)
    for (int k = 0; k < 1000; ++k) {
      const glm::dvec3 share(k % 10 / 9.0, k / 10 % 10 / 9.0, k / 100 / 9.0),
          fromEye = glm::mix(box.minWs, box.maxWs, share) - camera.positionWs;
      const double z = glm::dot(fromEye, axes.forward), w = isRatio ? z : 1.0, x = glm::dot(fromEye, axes.right),
                   y = glm::dot(fromEye, axes.up);
      if (z >= near && z <= far && x >= -camera.left * w && x <= camera.right * w && y >= -camera.down * w && y <= camera.up * w)
        check(frame, solution, fromEye, z, coverage);
    }
  return coverage;
}

// Points of the view: claimed by a partition whose map holds them, no less sharp than predicted, by differences of the emitted matrix.
inline void checkClaims(const Frame& frame, const Solution& solution, Random& random, int points) {
  const Axes axes(frame.camera);
  for (int n = 0; n < points; ++n) {
    const double x = n % 3 ? random.uniform() : random.index(2), y = n % 5 ? random.uniform() : random.index(2);
    const double z =
        std::min(random.logUniform(frame.camera.near, std::min(frame.camera.far, frame.camera.shadowDistance)), frame.camera.far);
    const glm::dvec3 fromEye = viewPoint(frame.camera, x, y, z), ws = frame.camera.positionWs + fromEye;
    if (!needsShadow(frame, ws)) continue;
    bool isCovered = false;
    for (int i = 0; i < solution.partitionCount && !isCovered; ++i) {
      const Partition& map = solution.partitions[i];
      bool isClaimed = z >= map.near * (1.0 - 1e-9) && z <= map.far * (1.0 + 1e-9);
      for (int p = 0; p < map.planeCount; ++p)
        isClaimed = isClaimed && glm::dot(glm::dvec3(map.planes[p]), ws) + map.planes[p].w >= -1e-9 * (z + glm::length(ws));
      if (!isClaimed) continue;
      const glm::dvec4 q = glm::dmat4(map.clipFromWorld) * glm::dvec4(fromEye, 1.0);
      const glm::dvec3 ndc = glm::dvec3(q) / q.w;
      isCovered = q.w > 0.0 && std::abs(ndc.x) <= 1.0 + 1e-6 && std::abs(ndc.y) <= 1.0 + 1e-6 && ndc.z >= -1e-6 && ndc.z <= 1.0 + 1e-6;
      if (!isCovered) continue;
      const double pixel = pixelAt(frame, z);
      const glm::dvec2 texel = measuredTexel(map, fromEye, frame.light.directionWs, pixel) / pixel;
      EXPECT_LE(texel.x, map.error.s * (1.0 + 1e-5));
      EXPECT_LE(texel.y, map.error.t * (1.0 + 1e-5));
    }
    EXPECT_TRUE(isCovered) << z;
  }
}

}  // namespace gnomon::test
