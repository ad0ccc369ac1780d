// text: lines of tables.
#pragma once

#include <string>

#include "gnomon/types.h"

namespace gnomon::cli {

// As printf; at most 255 characters.
[[nodiscard]] std::string line(const char* format, ...);

// Throws std::runtime_error that says what was refused.
void require(Status status);

}  // namespace gnomon::cli
