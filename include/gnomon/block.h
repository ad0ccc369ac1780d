// block: the std140 uniform block, one text for C++ and GLSL.
//
// glsl/gnomon_block.glsl is included here with mat4, vec4 and uvec4 bound to GLM's; every member is a multiple of 16 bytes,
// so std140 and C++ agree. Proofs: the static_asserts in solver/block.cpp, glslang's reflection and the driver's
// glGetActiveUniformsiv in tests/block_test.cpp.
//
// Conventions. Matrices take world - origin; the origin is the camera's position unless Frame::worldSpace. The determinant of
// clipFromWorld's upper 3x3 is negative for openGl and direct3d with increasing depth, positive for vulkan; reversed depth flips
// it: faces that are counter-clockwise seen from the light stay so on screen where y is up.
// Shader part: glsl/gnomon_block.glsl
// Test: tests/block_test.cpp
#pragma once

#include <glm/mat4x4.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include "gnomon/export.h"

namespace GNOMON_EXPORT gnomon {

using glm::mat4;
using glm::uvec4;
using glm::vec4;

#include "gnomon_block.glsl"
static_assert(GNOMON_MAX_PARTITIONS == 16, "shaders may hold fewer maps; the library may not");

struct Frame;
struct LightSpace;
struct Region;
struct Solution;
struct Splits;

// What clears a block: no partitions, which every shader reads as lit.
void clearBlock(GnomonBlock& block) noexcept;

// Atlas matrix (uv and stored depth) of a map from its clip matrix.
[[nodiscard]] glm::dmat4 atlasMatrix(const Frame& frame, const glm::dmat4& clipFromWorld, const glm::ivec4& viewport,
                                     const glm::ivec2& atlas) noexcept;

// Writes the block of a solution whose partitions are final, from the double matrices that theirs were rounded from.
// Returns false where a number does not fit float32.
bool writeBlock(const Frame& frame, const Region& region, const LightSpace& light, const Splits& slices, bool byViewDepth,
                const glm::dmat4* clipFromWorld, Solution& solution) noexcept;

}  // namespace gnomon
