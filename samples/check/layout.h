// layout: the block's members in a user's shader against the library's, by std140 offset.
//
// Shader part: none.
// Test: tests/check_test.cpp
#pragma once

#include <string>
#include <vector>

#include "scan.h"

namespace gnomon::check {

struct LayoutDifference {
  GlslPlace place;  // of the member
  std::string text;  // empty: none
};

// The first member of the user's GnomonPartition or GnomonBlock that is not the library's. The number of partitions may differ.
[[nodiscard]] LayoutDifference compareLayout(const std::vector<Struct>& structs);

}  // namespace gnomon::check
