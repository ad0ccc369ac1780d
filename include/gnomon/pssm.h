// pssm: parallel-split shadow maps, one map for each slice of view depth.
//
// Based on: [Zhang 2006]; a composition of the stages region -> split -> fit -> atlas -> block.
// Differences from the paper: see gnomon/split.h and gnomon/fit.h; selection by window depth in three conventions.
// Shader part: glsl/gnomon_pssm.glsl
// Test: tests/pssm_test.cpp
#pragma once

#include "gnomon/fit.h"
#include "gnomon/split.h"
#include "gnomon/types.h"

namespace GNOMON_EXPORT gnomon {

struct PssmSettings {
  SplitSettings split = {};
  FitMode fit = FitMode::tight;
};

// Partitions for one directional light. No heap, no globals, no exceptions; about a microsecond. On any refusal the answer has
// no partitions and its block reads as lit. An empty view is Status::ok with no partitions.
// Returns solution.status.
Status solvePssm(const Frame& frame, const PssmSettings& settings, Solution& solution) noexcept;

}  // namespace gnomon
