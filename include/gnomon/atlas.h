// atlas: a place for every map in one texture, or a layer for each.
//
// Based on: shelves of decreasing height, the best of the shelf widths that the maps' own widths suggest.
// Shader part: none.
// Test: tests/atlas_test.cpp
#pragma once

#include "gnomon/fit.h"
#include "gnomon/types.h"

namespace GNOMON_EXPORT gnomon {

struct Atlas {
  glm::ivec2 size{0, 0};
  int layers = 0;
  bool reduced = false;  // every map was scaled down alike to fit, or one would be longer than the atlas
  glm::ivec4 viewports[kMaxPartitions];  // x, y, width, height; disjoint, border texels free around each
};

// Texels of one map under a budget that `count` maps share.
[[nodiscard]] double texelsPerMap(const Budget& budget, int count) noexcept;

// The longest sides of the texture.
[[nodiscard]] glm::ivec2 atlasLimit(const Budget& budget) noexcept;

// Sizes each map by its fit's aspect and places it. shares: of all texels, for each map, summing to 1; null: equal. Layers of an
// array are always equal; those with no share are not made. Errors: budgetAtlas (even one texel each does not fit), marginTexels.
[[nodiscard]] Status packAtlas(const Frame& frame, const MapFit* fits, const double* shares, int count, Atlas& atlas) noexcept;

}  // namespace gnomon
