// result: RESULT.json, the answer of a solve as text.
//
// Shader part: none.
// Test: tests/cli_test.cpp
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "case.h"

namespace gnomon::cli {

// why: what auto compared, or null.
[[nodiscard]] Json resultJson(const std::string& method, const Frame& frame, const Solution& solution, double solveNs,
                              const AutoReport* why = nullptr);

// What the target that auto missed would take.
[[nodiscard]] std::string targetText(const Frame& frame, const AutoReport& why);

// JSON text with lists of numbers on one line each.
[[nodiscard]] std::string layOut(const Json& value);

[[nodiscard]] std::string base64(std::span<const std::uint8_t> bytes);

// The time of one of `repeat` whole solves, in nanoseconds: the median of some hundred batches of them; the answer is in `solution`.
double timedSolve(const Case& input, int repeat, Solution& solution);

}  // namespace gnomon::cli
