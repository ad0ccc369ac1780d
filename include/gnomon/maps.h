// maps: the stages that every method shares once it knows its slices: fit -> atlas -> block.
//
// Shader part: none.
// Test: tests/maps_test.cpp
#pragma once

#include "gnomon/fit.h"
#include "gnomon/split.h"
#include "gnomon/types.h"

namespace GNOMON_EXPORT gnomon {

// Fits a map to each slice, places them all and writes the partitions, their errors and the block. Slices that hold nothing get
// no map, but keep their place in the atlas. Solution::originWs is read. Errors: marginTexels, budgetAtlas, worldSpacePrecision,
// stableWorldSpace, floatRange.
[[nodiscard]] Status makeMaps(const Frame& frame, const Region& region, const LightSpace& light, const Splits& splits, FitMode mode,
                              Solution& solution) noexcept;

}  // namespace gnomon
