// error: how sharp a map is, in texel edges per pixel width, and the least texels that any map could do with.
//
// Two measures exist and are never mixed: these are the edges of a texel's parallelogram on the plane perpendicular to the light.
// [Lloyd 2006]'s second width is the spacing of constant-t lines, smaller by the cosine of the shear (none where maps are
// not warped). Based on: [Lloyd 2006, eq. 1 and 12 generalised; appendix C generalised for the limit].
// Shader part: glsl/gnomon_lookup.glsl evaluates the same Jacobian at a point.
// Test: tests/error_test.cpp
#pragma once

#include "gnomon/footprint.h"
#include "gnomon/types.h"

namespace GNOMON_EXPORT gnomon {

// Texel edges and longest stretch in world units, of an affine map, from the float matrix itself.
// directionWs: unit, from the light to the scene. Infinite where the matrix has no inverse on the light plane.
[[nodiscard]] TexelError texelSize(const glm::mat4& clipFromWorld, const glm::ivec4& viewport, const glm::dvec3& directionWs) noexcept;

// The same of a solved map that is not warped. Its rows are perpendicular to the light and to each other up to float32 rounding; a tilt by
// an angle e changes a length by e^2 only, so the rows' lengths suffice.
[[nodiscard]] TexelError plainTexelSize(const glm::mat4& clipFromWorld, const glm::ivec4& viewport) noexcept;

// The same of any projective map, at a point relative to Solution::originWs. Infinite behind the map's centre.
[[nodiscard]] TexelError texelSize(const glm::mat4& clipFromWorld, const glm::ivec4& viewport, const glm::dvec3& directionWs,
                                   const glm::dvec3& point) noexcept;

// Certified maxima of texelSize over w_i for an affine map that serves view depths from `near` on: w_i is least there.
// Inflated by 1e-6 for rounding.
[[nodiscard]] TexelError certify(const TexelError& size, double pixelWidthAtNear) noexcept;

// The same for any projective map, over every point served: not sampled, and not at the vertices alone, which an interior point of a wide
// warp can exceed by some per cent. The matrix takes world - origin; eyeMinusOriginWs: the camera's position minus that origin.
[[nodiscard]] TexelError certify(const glm::mat4& clipFromWorld, const glm::ivec4& viewport, const LightSpace& light,
                                 const glm::dvec3& eyeMinusOriginWs, const Served& served) noexcept;

// The least texels that error <= 1 everywhere in the region needs on one light plane, whatever the parameterization: the integral over
// the light plane of 1 / w_i^2 at the least view depth on each light ray. Exact for a camera's volume and for one cut by half-spaces and
// one receiver box, corners included as far as their faces are flat. Of several boxes a lower bound: the sum over boxes whose shadows'
// rectangles on the light plane do not meet, never less than any box by itself. 0 where nothing is to be shadowed, or where a cut was
// left out (Warning::regionSimplified). Samples (gnomon/samples.h) are not looked at.
[[nodiscard]] double limitTexels(const Region& region, const LightSpace& light) noexcept;

// What one map comes to, or all of a solution's.
struct TexelCost {
  double extent = 0.0;  // the longest stretch of a texel over w_i
  double needed = 0.0;  // texels for error 1 everywhere, each side of each map scaled by itself  [Lloyd 2006, eq. 12 generalised]
  double spent = 0.0;  // the same with all of them scaled alike: sees how the texels were shared
  double storageFactor = 0.0;  // needed over the image's pixels
};
[[nodiscard]] TexelCost texelCost(const Partition& map, const ImageSize& image) noexcept;
[[nodiscard]] TexelCost texelCost(const Solution& solution, const ImageSize& image) noexcept;

// How much sharper shadows are on one side of the seam between two maps than on the other: the greatest ratio, >= 1, of the two maps' error
// max(m_s, m_t) at a point that both serve, their ends closed. Taken at the seam's corners and at seven points between any two of
// them, so within some per cent. 0 where the maps have no seam. Not part of a solve; tens of microseconds. first, second: partitions of
// this frame's solution.
[[nodiscard]] double seamJump(const Frame& frame, const Solution& solution, int first, int second) noexcept;

}  // namespace gnomon
