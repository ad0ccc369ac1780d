// walk_command: `gnomon walk`: the experiment of [Tang 2017, sec. 4] over a scripted walk: how many maps light-plane rows take, how long
// a frame with them is beside parallel splits, and how many pixels are wrong.
//
// Shader part: none.
// Test: tests/cli_test.cpp
#pragma once

#include <string>
#include <vector>

namespace gnomon::cli {

// Walks through the scenes given (glTF files), or the built-in ones, in so many steps; the table on standard output and in `folder`/walk.txt. Returns 0. Throws
// Refusal for a file that cannot be used.
[[nodiscard]] int walk(const std::vector<std::string>& files, const std::string& folder, int steps);

}  // namespace gnomon::cli
