// footprint: what each slice of the region looks like from the light: its hull on the light plane, and the points that decide its error.
//
// Based on: [Zhang 2006, sec. 3.4] (the part of the split that the light sees).
// Differences from the paper: slices are padded by what the camera's depth buffer cannot tell apart and by the margins; several
// receivers make one hull.
// Shader part: none.
// Test: tests/footprint_test.cpp
#pragma once

#include <glm/mat4x4.hpp>

#include "gnomon/region.h"
#include "gnomon/split.h"
#include "gnomon/types.h"

namespace GNOMON_EXPORT gnomon {

// Light space: x and y span the light plane, z grows away from the light. A general 4x4, so that a spot light's
// post-perspective space can pass through the same stages. [Zhang 2006, sec. 3.1]
struct LightSpace {
  glm::dmat4 lsFromView;
  glm::dmat4 lsFromWorld;  // from world - eye
  glm::dvec3 directionVs, directionWs;  // unit, from the light to the scene
};

// The axis of the light plane that the world fixes; the other is its cross product with the direction (unit, from the light to the scene).
[[nodiscard]] glm::dvec3 planeAxis(const glm::dvec3& directionWs) noexcept;

// Unit x axis of the coordinates of Samples::bounds: the right of the camera that samples were taken from, projected on the light plane.
// Bounds along it are smallest, because the near and far ends of slices run along it. planeAxis() where right is along the light.
[[nodiscard]] glm::dvec3 boundsAxis(const glm::dvec3& directionWs, const glm::dvec3& rightWs) noexcept;

inline constexpr int kMaxHull = 64;

// What one map must hold, seen from the light.
struct Footprint {
  int count;  // hull vertices, counter-clockwise in light space; 0: nothing
  // Which footprint this is a copy of, scaled about the eye, or itself: the slices of equal ratio of a whole perspective view are alike. No
  // point that it must hold is farther than `apart` from its copy, as near as makes no difference to the choice of an axis or a warp.
  // Copies of one footprint follow it before any that is not: a pass over footprints in order may keep what it made of the last original.
  int like;
  double scale, apart;
  glm::dvec2 hull[kMaxHull];
  double depthNear, depthFar;  // light-space depths of what must be shadowed
  double reach;  // farthest distance from the eye, for rounding bounds
  DepthSpan padded;  // view depths covered
};

// The vertices of what a map serves, unpadded: every point it serves is a mean of them.
struct Served {
  int count;
  bool isCondensed;  // there were too many: fewer stand for them, some of which lie outside of the others' hull
  glm::dvec3 points[kMaxHull];  // light space
  double pixels[kMaxHull];  // w_i there, world units
};

// Gathers the slices' footprints, each slice padded by the depth quantum and the blend band and cut to where its samples lie, and where
// `served` is not null, which it must not be for wedges, the vertices that each serves. One of each for each slice. mayCopy: false where
// every hull must be its own. whole: the region's, where it is known: rows are cut from it.
void makeFootprints(const Region& region, const LightSpace& light, const Splits& splits, const Margin& margin, bool byViewDepth,
                    bool mayCopy, Footprint* footprints, Served* served, const Footprint* whole = nullptr) noexcept;

}  // namespace gnomon
