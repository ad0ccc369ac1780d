// fit: the rectangle of the light plane that each map covers, and its depth range.
//
// Based on: [Zhang 2006, sec. 3.4] (a crop for each split).
//   tight   the rectangle of least area over all orientations (one side lies on a hull edge); the viewport takes its aspect:
//           fewest texels, but it turns and scales with the view, so shadow edges crawl when the camera moves
//   slice   the paper's axis-aligned box in light space, whose y axis is the projected view direction; square viewports
//   stable  a square as wide as the slice's diameter, in a light basis fixed to the world and snapped to texels from the double
//           world origin: a static point keeps its texel while the camera moves; costs texels
// Differences from the paper: see above; receivers always lie inside the depth range; slices are padded by what the camera's
// depth buffer cannot tell apart and by the margins.
// Shader part: none.
// Test: tests/fit_test.cpp
#pragma once

#include <glm/mat4x4.hpp>

#include "gnomon/region.h"
#include "gnomon/split.h"
#include "gnomon/types.h"

namespace GNOMON_EXPORT gnomon {

enum class FitMode : std::uint8_t { tight, slice, stable };

// Light space: x and y span the light plane, z grows away from the light. A general 4x4, so that a spot light's
// post-perspective space can pass through the same stages. [Zhang 2006, sec. 3.1]
struct LightSpace {
  glm::dmat4 lsFromView{1.0};
  glm::dmat4 lsFromWorld{1.0};  // from world - eye
  glm::dvec3 directionVs{0.0}, directionWs{0.0};  // unit, from the light to the scene
};

// The light space of a directional light. Its axes come from the view, except for stable, where the world fixes them.
// Errors: lightDirection.
[[nodiscard]] Status makeLightSpace(const DirectionalLight& light, const Region& region, FitMode mode, LightSpace& out) noexcept;

inline constexpr int kMaxHull = 64;

// What one map must hold, seen from the light.
struct Footprint {
  int count = 0;  // hull vertices, counter-clockwise in light space; 0: nothing
  glm::dvec2 hull[kMaxHull];
  double depthNear = 0.0, depthFar = 0.0;  // light-space depths of what must be shadowed
  double reach = 0.0;  // farthest distance from the eye, for rounding bounds
  DepthSpan padded{0.0, 0.0};  // view depths covered
};

// Gathers the slices' footprints, each slice padded by the depth quantum and the blend band. One footprint for each slice.
void makeFootprints(const Region& region, const LightSpace& light, const Splits& splits, const Margin& margin, bool byViewDepth,
                    Footprint* footprints) noexcept;

// A rectangle of the light plane: the coordinates along axisX and axisY (unit, orthogonal, light space).
struct MapFit {
  glm::dvec2 axisX{1.0, 0.0}, axisY{0.0, 1.0};
  glm::dvec2 least{0.0}, size{0.0};  // size > 0
  double depthNear = 0.0, depthFar = 0.0;  // depthFar > depthNear
  bool square = false;  // the viewport is square whatever the rectangle's aspect
};

// The rectangle for one slice. pixel: w_i at the slice's near end, the least side a map needs.
[[nodiscard]] MapFit fitSlice(const Region& region, const Footprint& footprint, FitMode mode, double pixel) noexcept;

// Grows a fit to its viewport: margins, float32 rounding and, for stable, the snap to texels. The depth range keeps room for the
// normal offset. Errors: marginTexels (the margins leave no texel), worldSpacePrecision, stableWorldSpace; sets warnings.
[[nodiscard]] Status growToViewport(const Frame& frame, const Region& region, const LightSpace& light, const Footprint& footprint,
                                    FitMode mode, const glm::ivec4& viewport, MapFit& fit, std::uint32_t& warnings) noexcept;

// The matrix that takes world - origin to the map's clip space.
[[nodiscard]] glm::dmat4 cropMatrix(const Frame& frame, const LightSpace& light, const glm::dvec3& eyeMinusOriginWs,
                                    const MapFit& fit) noexcept;

}  // namespace gnomon
