// blend: how much of the next map to take near the far end of a partition, so that no seam shows.
//
// Based on: interleaved gradient noise for the dithered pick [Jimenez 2014].
// Shader part: glsl/gnomon_blend.glsl
// Test: tests/blend_test.cpp, tests/parity_blend_test.cpp
#pragma once

#include "gnomon/block.h"

namespace GNOMON_EXPORT gnomon {

// Share of partition index + 1 at a view depth, 0 to 1; 0 outside the band that Margin::blend asked for. As gnomonBlendWeight.
[[nodiscard]] float blendWeight(const GnomonBlock& block, int index, float viewDepth) noexcept;

}  // namespace gnomon
