// fit: the rectangle of the light plane that each map covers, and its depth range.
//
// Based on: [Zhang 2006, sec. 3.4] (a crop for each split).
//   tight   the rectangle of least area over all orientations (one side lies on a hull edge); the viewport takes its aspect:
//           fewest texels, but it turns and scales with the view, so shadow edges crawl when the camera moves
//   slice   the paper's axis-aligned box in light space, whose y axis is the projected view direction; square viewports
//   stable  a square as wide as the slice's diameter, in a light basis fixed to the world and snapped to texels from the double
//           world origin: a static point keeps its texel while the camera moves; costs texels
//   doubled a rectangle in that basis whose sides are a pixel's width at the near plane times powers of two, snapped likewise: texels of a
//           static point change only when a side doubles or halves [Lauritzen 2010, "Temporal Coherence"]
// Differences from the paper: see above; receivers always lie inside the depth range; slices are padded by what the camera's
// depth buffer cannot tell apart and by the margins.
// Shader part: none.
// Test: tests/fit_test.cpp
#pragma once

#include <glm/mat4x4.hpp>

#include "gnomon/footprint.h"
#include "gnomon/types.h"

namespace GNOMON_EXPORT gnomon {

enum class FitMode : std::uint8_t { tight, slice, stable, doubled };

// The light space of a directional light. Its axes come from the view, except for stable and doubled, where the world fixes them.
// Errors: lightDirection.
[[nodiscard]] Status makeLightSpace(const DirectionalLight& light, const Region& region, FitMode mode, LightSpace& out) noexcept;

// A map of the light plane to the rectangle [least, least + size] of coordinates s / w and t / w, where s, t and w are the products
// of these rows with (x, y, 1) in light space. Rectangles of the plane have w = (0, 0, 1) and unit, orthogonal s and t; warps
// (gnomon/warp.h) have w >= 1 on what the map covers. det(s, t, w) > 0.
struct MapFit {
  glm::dvec3 s, t, w;
  glm::dvec2 least, size;  // size > 0
  glm::dvec2 stretch;  // world length of a unit of s and of t, where it is greatest
  bool isWarped;
  double needed;  // texels for error 1 at every vertex served, before the viewport is chosen
  double aspect;  // of the viewport: texels along s over texels along t
  double depthNear, depthFar;  // depthFar > depthNear
  double depthCentre;  // of a warp: the depth that is stored alike whatever w is
  double depthLost;  // share of the depth range that a warp's rounding in float32 may lose; growToViewport() finds it
};

// The rectangle for a slice. pixel: w_i at its near end, the least side a map needs.
void fitSlice(const Region& region, const Footprint& footprint, FitMode mode, double pixel, MapFit& fit) noexcept;

// The fit of a footprint that is a copy of another, from the other's.
void copyFit(const MapFit& fit, const Footprint& footprint, MapFit& copy) noexcept;

// How many units of s and of t a world length of 1 may span, at most.
[[nodiscard]] glm::dvec2 unitsPerWorld(const MapFit& fit) noexcept;

// Grows a fit to its viewport: margins, float32 rounding and, for stable, the snap to texels. The depth range keeps room for the
// normal offset. Errors: marginTexels (the margins leave no texel), worldSpacePrecision, stableWorldSpace; sets warnings.
[[nodiscard]] Status growToViewport(const Frame& frame, const Region& region, const LightSpace& light, const Footprint& footprint,
                                    FitMode mode, const glm::ivec4& viewport, MapFit& fit, std::uint32_t& warnings) noexcept;

// The matrix that takes world - origin to the map's clip space.
void cropMatrix(const Frame& frame, const LightSpace& light, const glm::dvec3& eyeMinusOriginWs, const MapFit& fit,
                glm::dmat4& clipFromWorld) noexcept;

}  // namespace gnomon
