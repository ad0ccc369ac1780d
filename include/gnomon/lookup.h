// lookup: what the shaders do with a block, in C++ and in double: for fog on the CPU, for tools and for the parity tests.
//
// Based on: [Zhang 2006, eq. 8 corrected] for selection by window depth; half-open intervals as in [Lloyd 2006, sec. 6.3].
// Shader part: glsl/gnomon_lookup.glsl (the lookup), glsl/gnomon_pssm.glsl and glsl/gnomon_lloyd.glsl (the selection)
// Test: tests/lookup_test.cpp, tests/parity_lookup_test.cpp, tests/parity_filter_test.cpp, tests/parity_lloyd_test.cpp
#pragma once

#include "gnomon/block.h"

#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

namespace GNOMON_EXPORT gnomon {

// The partition that serves a window depth (gl_FragCoord.z), or -1; where faces or rows serve, -1 (selectByMask finds those). As
// gnomonSelectWindow.
[[nodiscard]] int selectByWindowDepth(const GnomonBlock& block, float windowDepth) noexcept;

// The partition that serves a view depth, or -1. As gnomonSelectView.
[[nodiscard]] int selectByViewDepth(const GnomonBlock& block, float viewDepth) noexcept;

// The first partition that serves a point, or -1, whether partitions are slices, faces or rows; world is relative to the block's origin.
// Half-open: a border belongs to what begins there. As gnomonSelectMask, from the block's floats in double.
[[nodiscard]] int selectByMask(const GnomonBlock& block, const glm::dvec3& world) noexcept;

// View depth of a point; world is relative to the block's origin. As gnomonViewDepth.
[[nodiscard]] double viewDepth(const GnomonBlock& block, const glm::dvec3& world) noexcept;

// Atlas uv (xy) and stored depth (z) of a point in a partition >= 0; w: 1 within a texel of its map, else 0. Depth outside the map's range
// is clamped to it. From the block's float matrix evaluated in double. As gnomonAtlas.
[[nodiscard]] glm::dvec4 atlasPosition(const GnomonBlock& block, int partition, const glm::dvec3& world) noexcept;

}  // namespace gnomon
