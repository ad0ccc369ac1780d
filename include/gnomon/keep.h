// keep: maps of earlier frames that stay in the texture while they still cover what they serve, so that a frame draws only some.
//
// A map is kept only where it answers every lookup of this frame: each corner of what it must serve now (the slice with its padding,
// cut by receivers and planes, at the receivers' depth) lies inside the rectangle it was drawn for less the filter's reach, inside its
// depth range, and inside the cull planes it was drawn with, since casters beyond them are not in it. All three are convex, so the
// corners decide. Warps and faces follow the view: such maps are always drawn anew. Margin::motion gives maps the room that lets them be
// kept while the camera moves.
// Shader part: none.
// Test: tests/keep_test.cpp
#pragma once

#include "gnomon/types.h"

namespace GNOMON_EXPORT gnomon {

// What the shadow texture holds. One for each texture, yours to keep from frame to frame; as constructed it holds nothing.
struct DrawnMaps {
  struct Map {
    Partition partition;  // as it was drawn
    glm::dvec3 originWs;  // what its matrix was relative to
  };
  int count = 0;
  glm::ivec2 atlas{0, 0};
  int layers = 0;
  ShadowMap shadowMap;
  Map maps[kMaxPartitions];
};

// Call it after the solve of `frame` and before drawing. Map i of the solution gives way to the drawn one where bit i of `wanted` is set,
// the drawn one has the same place in the texture and still covers: matrices are then those it was drawn with, relative to this solution's
// origin (from the drawn ones in double, so that nothing drifts), errors are its own; slices and cull planes stay the solution's.
// Returns the bits of the maps that were kept: draw the others, which are noted in `drawn`.
// A kept map shows casters and light as they were. A texture of another size, or a cleared one, holds nothing: start again with {}.
[[nodiscard]] std::uint32_t keepMaps(const Frame& frame, std::uint32_t wanted, DrawnMaps& drawn, Solution& solution) noexcept;

}  // namespace gnomon
