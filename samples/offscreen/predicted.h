// predicted: how sharp the maps are at what a picture shows, by the error that the solver predicts.
//
// At each pixel's point the wider edge of the texel that serves it, over the width of a pixel there: max(m_s, m_t), from the emitted
// matrix in double (gnomon/error.h). A certificate is the greatest over a volume; this is the mean over what is seen of it.
// It knows nothing of the surface: where light grazes it, one texel covers many pixels along the light and none more across. What of a
// texel shows is how wide it lies across a shadow's edge.
// Shader part: none.
// Test: tests/predicted_test.cpp
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "gnomon/types.h"
#include "render.h"

namespace gnomon::offscreen {

struct PredictedError {
  std::size_t served = 0;  // pixels that count and that a map serves
  double mean = 0.0;  // over them; 0 where there are none
  double overOne = 0.0;  // share of them whose texel is wider than a pixel
};

// position: n x 3, world minus the solution's origin; index: n, the partition that serves a pixel, 255 none; counted: n, 0 where a pixel
// is left out. Throws std::runtime_error where the sizes disagree or a partition is not the solution's.
[[nodiscard]] PredictedError predictedError(const Frame& frame, const Solution& solution, const std::vector<float>& position,
                                            const std::vector<std::uint8_t>& index, const std::vector<std::uint8_t>& counted);

// How many pixels a texel is wide across a true shadow edge, as it lies on the surface there: of both points of every two neighbours of
// different truth, along the line between them, the mean; 0 where there is no edge. truth, counted: of every pixel of the image, as
// countWrong() takes them. Throws std::runtime_error where the sizes disagree or a partition is not the solution's.
[[nodiscard]] double texelAcrossEdges(const Frame& frame, const Solution& solution, const RenderOutput& image,
                                      const std::vector<std::uint8_t>& truth, const std::vector<std::uint8_t>& counted);

}  // namespace gnomon::offscreen
