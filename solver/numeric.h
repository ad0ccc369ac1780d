// numeric: the few vector helpers that more than one stage needs. Private to solver/.
#pragma once

#include <algorithm>
#include <cmath>

#include <glm/glm.hpp>

namespace gnomon {

constexpr double kFloatRounding = 1.0 / 2097152.0;  // 2^-21: four rounded terms of a float32 row, twice over

inline bool isFinite(const glm::dvec3& v) noexcept { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

// Two doubles that a processor may work on at once, to the bit what it would make of one after the other.
#ifdef __GNUC__
using Pair = double __attribute__((vector_size(16)));
inline Pair lesser(Pair a, Pair b) noexcept { return a < b ? a : b; }
inline Pair greater(Pair a, Pair b) noexcept { return a > b ? a : b; }
#else
struct Pair {
  double lanes[2];
  double operator[](int i) const noexcept { return lanes[i]; }
};
inline Pair operator+(Pair a, Pair b) noexcept { return {a[0] + b[0], a[1] + b[1]}; }
inline Pair operator-(Pair a, Pair b) noexcept { return {a[0] - b[0], a[1] - b[1]}; }
inline Pair operator*(Pair a, Pair b) noexcept { return {a[0] * b[0], a[1] * b[1]}; }
inline Pair operator*(Pair a, double b) noexcept { return {a[0] * b, a[1] * b}; }
inline Pair lesser(Pair a, Pair b) noexcept { return {a[0] < b[0] ? a[0] : b[0], a[1] < b[1] ? a[1] : b[1]}; }
inline Pair greater(Pair a, Pair b) noexcept { return {a[0] > b[0] ? a[0] : b[0], a[1] > b[1] ? a[1] : b[1]}; }
#endif

inline Pair both(double x) noexcept {
  const Pair pair = {x, x};
  return pair;
}

// Twice the signed area of the triangle 0, a, b.
inline double cross2(const glm::dvec2& a, const glm::dvec2& b) noexcept { return a.x * b.y - a.y * b.x; }

// The first component that is not finite, else the fallback: what a refusal reports.
inline double firstBad(const glm::dvec3& v, double fallback) noexcept {
  for (int i = 0; i < 3; ++i)
    if (!std::isfinite(v[i])) return v[i];
  return fallback;
}

// The unit axis least along v.
inline glm::dvec3 leastAxis(const glm::dvec3& v) noexcept {
  const glm::dvec3 a = glm::abs(v);
  if (a.x <= a.y && a.x <= a.z) return {1.0, 0.0, 0.0};
  return a.y <= a.z ? glm::dvec3(0.0, 1.0, 0.0) : glm::dvec3(0.0, 0.0, 1.0);
}

// Unit vector of any finite, non-zero vector, subnormal or huge; zero where there is none.
inline glm::dvec3 unit(const glm::dvec3& v) noexcept {
  const double largest = std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
  if (!(largest > 0.0) || !std::isfinite(largest)) return glm::dvec3(0.0);
  constexpr double kLeast = 1e-140, kMost = 1e140;  // squares within these neither vanish nor overflow
  if (largest > kLeast && largest < kMost) return v * (1.0 / std::sqrt(glm::dot(v, v)));
  int exponent = 0;
  std::frexp(largest, &exponent);
  const glm::dvec3 scaled(std::ldexp(v.x, -exponent), std::ldexp(v.y, -exponent), std::ldexp(v.z, -exponent));
  return scaled * (1.0 / std::sqrt(glm::dot(scaled, scaled)));
}

// The axes of a view: columns right, up, forward. A product of nearly parallel vectors is across them only as far as rounding allows, so it
// is set across once more.
inline glm::dmat3 viewAxes(const glm::dvec3& forwardWs, const glm::dvec3& upWs) noexcept {
  const glm::dvec3 forward = unit(forwardWs), across = glm::cross(forward, unit(upWs));
  const glm::dvec3 right = unit(across - forward * glm::dot(forward, across));
  return {right, glm::cross(right, forward), forward};
}

}  // namespace gnomon
