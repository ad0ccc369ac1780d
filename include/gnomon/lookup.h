// lookup: what the shaders do with a block, in C++ and in double: for fog on the CPU, for tools and for the parity tests.
//
// Based on: [Zhang 2006, eq. 8 corrected] for selection by window depth; half-open intervals as in [Lloyd 2006, sec. 6.3].
// Shader part: glsl/gnomon_lookup.glsl (the lookup), glsl/gnomon_pssm.glsl (the selection)
// Test: tests/lookup_test.cpp, tests/parity_lookup_test.cpp, tests/parity_filter_test.cpp
#pragma once

#include "gnomon/block.h"

#include <glm/vec3.hpp>

namespace GNOMON_EXPORT gnomon {

// The partition that serves a window depth (gl_FragCoord.z), or -1. As gnomonSelectWindow.
[[nodiscard]] int selectByWindowDepth(const GnomonBlock& block, float windowDepth) noexcept;

// The partition that serves a view depth, or -1. As gnomonSelectView.
[[nodiscard]] int selectByViewDepth(const GnomonBlock& block, float viewDepth) noexcept;

// View depth of a point; world is relative to the block's origin. As gnomonViewDepth.
[[nodiscard]] double viewDepth(const GnomonBlock& block, const glm::dvec3& world) noexcept;

// Atlas uv and stored depth of a point in a partition, from the block's float matrix evaluated in double. As gnomonAtlas.
[[nodiscard]] glm::dvec3 atlasPosition(const GnomonBlock& block, int partition, const glm::dvec3& world) noexcept;

}  // namespace gnomon
