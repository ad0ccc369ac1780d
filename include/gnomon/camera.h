// camera: from what an engine holds to a Camera, and a camera's depth buffer as a function of view depth.
//
// Based on: [Zhang 2006, sec. 3.6, eq. 8] with the errata: the printed f/(f-n) (n - 1/C) holds only at n = 1; right is
// f/(f-n) (1 - n/C), and n, f are the projection's own, never the shadowed region's.
// Differences from the paper: asymmetric, orthographic and infinite projections, three depth conventions.
// Shader part: none.
// Test: tests/camera_test.cpp
#pragma once

#include <algorithm>
#include <cmath>

#include "gnomon/types.h"

namespace GNOMON_EXPORT gnomon {

inline constexpr double kFloatUlp = 1.0 / 8388608.0;  // 2^-23: relative spacing of float32

// A symmetric perspective camera. fovY: whole vertical angle, radians, in (0, pi); aspect: width over height, > 0.
// Bad values are kept, and refused by the solve: an angle outside of that (degrees) as cameraTangents.
[[nodiscard]] Camera perspective(const glm::dvec3& positionWs, const glm::dvec3& forwardWs, const glm::dvec3& upWs, double fovY,
                                 double aspect, double near, double far) noexcept;

// An orthographic camera. height: of the view, world units, > 0; near may be <= 0.
[[nodiscard]] Camera orthographic(const glm::dvec3& positionWs, const glm::dvec3& forwardWs, const glm::dvec3& upWs, double height,
                                  double aspect, double near, double far) noexcept;

// A camera from an engine's matrices (column vectors; either handedness, mirrored or not, any of the three depths).
// viewFromWorld must be rigid (to 1e-3, so float32 passes). Temporal jitter is taken out: an off-centre of under one
// pixel of `image` counts as jitter and is dropped; where the projection is off-centre by more, give the jitter in
// jitterNdc (normalised device units, as it was added to clip x/w and y/w). An infinite far is recognised.
// camera: its shadowDistance is kept, all else is written. Errors: imageSize, cameraViewMatrix, cameraProjectionMatrix (not a projection,
// or not in this depth convention).
[[nodiscard]] Status cameraFromMatrices(const glm::dmat4& viewFromWorld, const glm::dmat4& clipFromView, DepthConvention depth,
                                        const ImageSize& image, const glm::dvec2& jitterNdc, Camera& camera) noexcept;

// Eight corners, as Frame::cornersWs takes them, of a volume that encloses the view volumes of several cameras up to their
// shadow distances: the two eyes of a headset, parallel or canted. Near and far faces are perpendicular to the forward
// direction of `axis`; each side is the plane that is tightest half-way in depth. cameras: one or more, valid. A solve leaves out what lies
// before the near plane of its own camera: put that before theirs where they are canted.
void enclose(std::span<const Camera> cameras, const Camera& axis, glm::dvec3 (&cornersWs)[8]) noexcept;

// Errors: the camera* statuses; `value` receives the number refused.
[[nodiscard]] Status validate(const Camera& camera, double& value) noexcept;

// The view depth where the shadowed range ends: the far plane or the shadow distance, whichever is nearer.
[[nodiscard]] inline double shadowFar(const Camera& camera) noexcept { return std::min(camera.far, camera.shadowDistance); }

// gl_FragCoord.z at a view depth > 0 (any, if orthographic): 0 to 1, from 1 to 0 for reversed depth.  [Zhang 2006, eq. 8 corrected]
[[nodiscard]] inline double windowDepth(const Camera& camera, double viewDepth) noexcept {
  const double n = camera.near, f = camera.far, z = viewDepth;
  const bool isReversed = camera.depth == DepthConvention::reversedZeroToOne;
  // gl_FragCoord.z is window depth: negativeOneToOne and zeroToOne have the same.
  if (camera.projection == Projection::orthographic) return isReversed ? (f - z) / (f - n) : (z - n) / (f - n);
  if (!std::isfinite(f)) return isReversed ? n / z : 1.0 - n / z;
  return isReversed ? n / z * ((f - z) / (f - n)) : f / (f - n) * ((z - n) / z);  // [Zhang 2006, eq. 8 corrected]
}

// The inverse: the view depth of a window depth.
[[nodiscard]] double viewDepthAt(const Camera& camera, double windowDepth) noexcept;

// How far two view depths near this one may lie apart and still share a float32 depth value: world units, >= 0.
[[nodiscard]] inline double depthQuantum(const Camera& camera, double viewDepth) noexcept {
  // Clip z and w are each rounded in the vertex stage, then interpolated and divided: two units in the last place of the
  // largest term. Reversed depth has terms as small as the depth itself, so that the quantum is as small a share of z everywhere.
  constexpr double kRounding = 2.0 * kFloatUlp;
  const double n = camera.near, f = camera.far, z = viewDepth;
  if (camera.projection == Projection::orthographic) return kRounding * (f - n);
  if (camera.depth == DepthConvention::reversedZeroToOne) return kRounding * z;
  return kRounding * z * (z * ((1.0 - n / f) / n));  // |d window / d z| = n f / ((f - n) z^2)
}

// The same for view depth computed in float32 from a camera-relative position, as gnomonViewDepth does.
[[nodiscard]] inline double viewQuantum(const Camera& camera, double viewDepth) noexcept {
  // A dot product of float32 terms as large as the distance from the eye.
  const double widest =
      std::max(std::max(std::abs(camera.left), std::abs(camera.right)), std::max(std::abs(camera.down), std::abs(camera.up)));
  const double reach = camera.projection == Projection::perspective ? std::abs(viewDepth) * (1.0 + widest) : std::abs(viewDepth) + widest;
  return 4.0 * kFloatUlp * reach;
}

// The width of a pixel at a view depth, w_i, world units.  [Lloyd 2006, eq. 2 corrected: the length, without 1/n]
[[nodiscard]] inline double pixelWidth(const Camera& camera, const ImageSize& image, double viewDepth) noexcept {
  const double height = (camera.down + camera.up) / image.height;
  return camera.projection == Projection::orthographic ? height : viewDepth * height;
}

}  // namespace gnomon
