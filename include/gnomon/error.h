// error: how sharp a map is, in texel edges per pixel width, and the least texels that any map could do with.
//
// Two measures exist and are never mixed: these are the edges of a texel's parallelogram on the plane perpendicular to the light.
// [Lloyd 2006]'s second width is the spacing of constant-t lines, smaller by the cosine of the shear (none where maps are
// not warped). Based on: [Lloyd 2006, eq. 1 and 12 generalised]; the limit is the integral over the light plane of
// 1 / w_i(z_min)^2, closed for a whole perspective frustum.
// Shader part: glsl/gnomon_lookup.glsl evaluates the same Jacobian at a point.
// Test: tests/error_test.cpp
#pragma once

#include "gnomon/footprint.h"
#include "gnomon/types.h"

namespace GNOMON_EXPORT gnomon {

// Texel edges and longest stretch in world units, of an affine map, from the float matrix itself.
// directionWs: unit, from the light to the scene. Infinite where the matrix has no inverse on the light plane.
[[nodiscard]] TexelError texelSize(const glm::mat4& clipFromWorld, const glm::ivec4& viewport, const glm::dvec3& directionWs) noexcept;

// Certified maxima of texelSize over w_i for an affine map that serves view depths from `near` on: w_i is least there.
// Inflated by 1e-6 for rounding.
[[nodiscard]] TexelError certify(const TexelError& size, double pixelWidthAtNear) noexcept;

// The same for any projective map, over every point served: not sampled, and not at the vertices alone, which an interior point of a wide
// warp can exceed by some per cent. The matrix takes world - origin; eyeMinusOriginWs: the camera's position minus that origin.
[[nodiscard]] TexelError certify(const glm::mat4& clipFromWorld, const glm::ivec4& viewport, const LightSpace& light,
                                 const glm::dvec3& eyeMinusOriginWs, const Served& served) noexcept;

// The least texels that error <= 1 everywhere in a whole, symmetric perspective frustum needs on one light plane,
// whatever the parameterization; 0 where no closed form is known (orthographic, asymmetric, corners, cut by receivers, planes
// or samples).
[[nodiscard]] double limitTexels(const Frame& frame) noexcept;

}  // namespace gnomon
