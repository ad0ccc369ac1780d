// cast: which casters a map needs: planes for the host's culling, and how far the depth range reaches towards the light.
//
// Based on: [Zhang 2006, sec. 3.2 step 2] (each split covers "the objects potentially casting shadows into the part"): the
// region of a slice swept towards the light.
// Shader part: glsl/gnomon_cast.glsl
// Test: tests/cast_test.cpp
#pragma once

#include "gnomon/fit.h"
#include "gnomon/types.h"

namespace GNOMON_EXPORT gnomon {

// The caps that every slice shares: the faces of the region's volume that light leaves it by, in world space with unit normals, but
// for the view's near and far. Returns their number, at most kMaxCellPlanes.
int makeCaps(const Region& region, const LightSpace& light, glm::dvec4* capsWs) noexcept;

// Writes the planes of the slice's region swept towards the light, moved outward by `grow` (world units: the margins and a texel),
// in world space with unit normals. Returns their number, at most kMaxCullPlanes; fewer planes hold more.
int makeCullPlanes(const Region& region, const LightSpace& light, const Footprint& footprint, std::span<const glm::dvec4> capsWs,
                   double grow, glm::dvec4* planesWs) noexcept;

// Extends the fit's depth range towards the light to hold every caster box over its rectangle.
void extendToCasters(std::span<const Box> casters, const Region& region, const LightSpace& light, MapFit& fit) noexcept;

// True where a box reaches into the swept volume: the test a host runs for each object and map.
[[nodiscard]] bool mayCast(const Partition& partition, const Box& box) noexcept;

}  // namespace gnomon
