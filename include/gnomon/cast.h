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

// The directions of the planes that bound swept volumes: caps, which all slices share, and sides, which alike footprints share.
struct CullShape {
  int capCount = 0, count = 0;  // the cap across the light, the slice's near or far end where it has one, the region's faces; then sides
  bool hasEnd = false, isFar = false;
  glm::dvec4 planesWs[kMaxCullPlanes];  // through the eye, unit normals
  double offsets[kMaxCullPlanes];  // distance of each from the eye; of sides, that for the footprint that others are copies of
};

// Caps: the faces that light leaves the region by.
void makeCaps(const Region& region, const LightSpace& light, CullShape& shape) noexcept;

// Sides: the silhouette of a footprint, behind the caps.
void makeSides(const Region& region, const LightSpace& light, const Footprint& footprint, CullShape& shape) noexcept;

// Writes the planes of the slice's region swept towards the light, moved outward by `grow` (world units: the margins and a texel),
// in world space with unit normals. shape: of the footprint that this one is like. Returns their number, at most kMaxCullPlanes; fewer
// planes hold more.
int makeCullPlanes(const CullShape& shape, const Footprint& footprint, double grow, glm::dvec4* planesWs) noexcept;

// Extends the fit's depth range towards the light to hold every caster box over its rectangle.
void extendToCasters(std::span<const Box> casters, const Region& region, const LightSpace& light, MapFit& fit) noexcept;

// True where a box reaches into the swept volume: the test a host runs for each object and map.
[[nodiscard]] bool mayCast(const Partition& partition, const Box& box) noexcept;

}  // namespace gnomon
