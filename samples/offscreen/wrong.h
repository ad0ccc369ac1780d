// wrong: how much of a shadowed picture is wrong, and of which kind.
//
// A pixel counts where there is geometry and its geometric normal faces the light (cosine over kLeastCosine): away from the
// light, shading is dark whatever the map says. A counted pixel is wrong where the map's answer is not the traced one.
// A true edge lies between two 4-neighbouring counted pixels of different truth; both are edge pixels. The distance of a
// pixel to an edge is the Chebyshev distance to the nearer of its two pixels, so an edge pixel is at distance 0.
// Wrong pixels at distance 0 or 1 of a true edge are aliasing; wrong pixels farther away are acne, leaks or lost casters.
//
//     truth   . . . . # # #       . lit   # shadowed
//     distance 3 2 1 0 0 1 2      near: the middle four
//
// Pixels that do not count are never wrong and make no edges, but distances run across them.
// Shader part: none.
// Test: tests/wrong_test.cpp
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <glm/vec3.hpp>

namespace gnomon::offscreen {

inline constexpr double kLeastCosine = 0.02;  // between a counted pixel's normal and the direction to the light

struct WrongPixels {
  std::size_t counted = 0;  // pixels with geometry that faces the light
  std::size_t edge = 0;  // counted pixels that touch a true edge
  std::size_t shadowed = 0;  // counted pixels that are truly in shadow
  std::size_t wrong = 0;  // = wrongNear + wrongFar = falselyLit + falselyShadowed
  std::size_t wrongNear = 0;  // within one pixel of a true edge
  std::size_t wrongFar = 0;  // farther than one pixel from every true edge
  std::size_t falselyLit = 0;  // truly in shadow
  std::size_t falselyShadowed = 0;  // truly lit
  double meanDistance = 0.0;  // of the wrong pixels from the nearest true edge, in pixels; 0 where there are none, or no edge

  // Each is 0 where there is nothing to divide by.
  [[nodiscard]] double share() const;  // wrong over counted
  [[nodiscard]] double perEdge() const;  // wrong over edge
  [[nodiscard]] double farShare() const;  // wrongFar over wrong
  [[nodiscard]] double shadowedShare() const;  // shadowed over counted
};

// 1 where a pixel counts. truth: n, kShadowed, kLit or kNothing (truth.h); normal: n x 3, any length; lightDirectionWs: from the
// light to the scene, any length. Throws std::runtime_error where the sizes disagree.
[[nodiscard]] std::vector<std::uint8_t> countedPixels(const std::vector<std::uint8_t>& truth, const std::vector<float>& normal,
                                                      const glm::dvec3& lightDirectionWs);

// 1 where a counted pixel touches a true edge. Throws std::runtime_error where the sizes disagree.
[[nodiscard]] std::vector<std::uint8_t> edgePixels(int width, int height, const std::vector<std::uint8_t>& truth,
                                                   const std::vector<std::uint8_t>& counted);

// answer: the map's, height x width, in the same values as truth; kNothing where the truth has an answer is wrong too.
// counted: from countedPixels. Throws std::runtime_error where the sizes disagree.
[[nodiscard]] WrongPixels countWrong(int width, int height, const std::vector<std::uint8_t>& answer, const std::vector<std::uint8_t>& truth,
                                     const std::vector<std::uint8_t>& counted);

// height x width x 3, 8-bit rgb: grey where map and truth agree (light: lit, dark: shadow), red where falsely shadowed, blue where
// falsely lit, dim where a pixel does not count, near black where there is nothing.
[[nodiscard]] std::vector<std::uint8_t> differencePicture(int width, int height, const std::vector<std::uint8_t>& answer,
                                                          const std::vector<std::uint8_t>& truth, const std::vector<std::uint8_t>& counted);

}  // namespace gnomon::offscreen
