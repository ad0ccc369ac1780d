// frame: checks what every method is given, and what every refusal leaves behind.
//
// Shader part: none.
// Test: tests/frame_test.cpp
#pragma once

#include "gnomon/types.h"

namespace GNOMON_EXPORT gnomon {

// Errors: camera*, image*, margin*, budget*, bias*, fade; value: the number refused. Boxes, planes and the light are checked
// where they are read (gnomon/region.h, gnomon/fit.h).
[[nodiscard]] Status validate(const Frame& frame, double& value) noexcept;

// An empty answer: no partitions, status ok, nothing refused. Leaves the block and the partitions' storage alone.
void clear(Solution& solution) noexcept;

// A refusal: no partitions, a block that reads as lit; keeps refusedIndex and refusedValue. Returns the status.
Status refuse(Solution& solution, Status status) noexcept;

}  // namespace gnomon
