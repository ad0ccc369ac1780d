// minimax: slices chosen by what their maps need, where a formula of the depth alone does not know better.
//
// Based on: [Lloyd 2006, sec. 5.2] (z-partitions share the error equally); [Zhang 2006, sec. 3.3].
// Differences from the papers: for a whole view the equal ratios of their formulas are the answer, for one cut by receivers or half-spaces
// they are not: here each candidate slice's map is fitted, and dynamic programming takes the planes that
//   Shares::equal   make the greatest error least
//   Shares::error   need the fewest texels in all, when texels are shared so that every map ends with the same error
// each slice with the blend band that it must cover of the one before, over planes spaced evenly in the logarithm of depth, then over ever
// closer ones about the best.
// Shader part: none.
// Test: tests/minimax_test.cpp
#pragma once

#include "gnomon/maps.h"

namespace GNOMON_EXPORT gnomon {

// Splits the region's depth spans into at most `count` slices; fewer where more would need more texels. Costs some hundred fits, with
// a blend band some thousand.
void splitMinimax(const Frame& frame, const Region& region, const LightSpace& light, const MapSettings& settings, int count,
                  Splits& splits) noexcept;

}  // namespace gnomon
