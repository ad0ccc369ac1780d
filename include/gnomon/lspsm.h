// lspsm: maps of rectangles of the light plane that do not overlap, in a number that follows the view and the light.
//
// Based on: [Tang 2017]; a composition of region -> rows -> footprint -> fit -> warp -> atlas -> block.
// Differences from the paper: see gnomon/rows.h. A rectangle's map is the least one that holds what the region fills of it, never larger
// than the rectangle, and its viewport takes its aspect: so sigma bounds both ways. RowRule::error takes the rows, in one column or more,
// or slices of view depth, whichever needs fewest texels: slices where the light runs along the view, where their maps are nested
// rectangles around the projected eye and rows cannot compete. There is no stable fit: rows turn and grow with the view.
// Shader part: glsl/gnomon_lspsm.glsl
// Test: tests/lspsm_test.cpp
#pragma once

#include "gnomon/rows.h"
#include "gnomon/types.h"
#include "gnomon/warp.h"

namespace GNOMON_EXPORT gnomon {

struct LspsmSettings {
  RowSettings rows = {};
  WarpSettings warp = {};  // of each map
};

// Partitions for one directional light. No heap, no globals, no exceptions. The texels are shared equally with RowRule::paper, else so that
// every map ends with the same error. Warning: rowsWaste. layout: the rows that were made (count 0: none), or null.
// On any refusal the answer has no partitions and its block reads as lit. Returns solution.status.
Status solveLspsm(const Frame& frame, const LspsmSettings& settings, Solution& solution, RowLayout* layout = nullptr) noexcept;

}  // namespace gnomon
