// samples: what a float depth buffer says of what the view samples: nearest and farthest, how many at which depth, where on the light
// plane.
//
// Based on: [Lauritzen 2010, "Implementation"] (the reduce path and the histogram path).
// Values that are no depth are skipped: what the buffer was cleared to (1, or 0 with reversed depth), NaN, anything outside [0, 1]. All
// decisions compare depth values, so that a shader's answers are the same to the bit; only positions are rounded.
// Shader part: glsl/gnomon_samples.glsl
// Test: tests/samples_test.cpp, tests/parity_sdsm_test.cpp
#pragma once

#include <cstddef>
#include <span>

#include <glm/mat3x3.hpp>

#include "gnomon/types.h"

namespace GNOMON_EXPORT gnomon {

// A float depth buffer as the camera's API stores it (gl_FragCoord.z): 0 to 1, whatever its clip space. The bottom row first; for images
// whose top row comes first, the address of the last row and a negative stride.
struct DepthImage {
  const float* depths = nullptr;  // null: an image without samples
  int width = 0, height = 0;
  std::ptrdiff_t stride = 0;  // floats from one row to the next; 0: width
};

// Nearest and farthest view depth, exactly those of the depth values; none: infinity and -infinity, as Samples has it.
void sampleRange(const Camera& camera, const DepthImage& image, double& near, double& far) noexcept;

// The depth values at which bins of equal ratio over [near, far] begin, the last bin's end behind them: bins + 1 values, rising from the
// eye (with reversed depth, falling). What a shader's histogram compares with. near > 0.
void windowEdges(const Camera& camera, double near, double far, std::span<float> edges) noexcept;

// Counts the samples between the edges; those before the first or behind the last count in the end bins. counts: edges.size() - 1,
// overwritten.
void sampleHistogram(const Camera& camera, const DepthImage& image, std::span<const float> edges, std::span<std::uint32_t> counts) noexcept;

// The light space of Samples::bounds: x and y from a view-space position (x right, y up, z forward); x is the camera's right seen along the
// light, as the ends of its slices are: bounds along it hold least. Errors: camera*, lightDirection.
[[nodiscard]] Status lightForSamples(const Frame& frame, glm::dmat3& lsFromView) noexcept;

// What gnomon_samples.glsl needs of a view; its vec4s are GnomonSampleView's.
struct SampleView {
  glm::vec4 law, corner, pixels, forward;
};

// Of a depth buffer of width x height; lsFromView: of lightForSamples().
[[nodiscard]] SampleView sampleView(const Camera& camera, int width, int height, const glm::dmat3& lsFromView) noexcept;

// The light-space rectangle of the samples in each interval; near and far are given. An interval without samples has near > far then: leave
// those out, as keepBounds() does. Samples that float32 depth cannot tell from an end count on both sides of it.
void sampleBounds(const Camera& camera, const DepthImage& image, const glm::dmat3& lsFromView, std::span<SampleBounds> bounds) noexcept;

// Moves the intervals that hold samples to the front. Returns their number.
[[nodiscard]] std::size_t keepBounds(std::span<SampleBounds> bounds) noexcept;

inline constexpr int kSampleBins = 64;

// What takeSamples() fills; the spans of its Samples look into it.
struct SampleStore {
  std::uint32_t histogram[kSampleBins];
  SampleBounds bounds[kSampleBins];
};

// All of it at once: range, histogram (where all depths are > 0), the bounds of each bin and rightWs. Samples::weights and latency stay.
// Errors: those of lightForSamples().
[[nodiscard]] Status takeSamples(const Frame& frame, const DepthImage& image, SampleStore& store, Samples& samples) noexcept;

}  // namespace gnomon
