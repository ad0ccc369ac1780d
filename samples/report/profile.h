// profile: what passes, texels and solves take on this device, as the settings of method auto.
//
// Test: tests/report_test.cpp
#pragma once

#include <vector>

#include "case.h"
#include "render.h"

namespace gnomon::report {

// One render's shadow passes.
struct Timing {
  double passes = 0.0, texels = 0.0, ns = 0.0;  // ns > 0
};
struct Weights {
  double pass = 0.0, texel = 0.0;  // nanoseconds, >= 0
};
// ns = pass * passes + texel * texels: least squares of what is left over, as a share of each time.
[[nodiscard]] Weights fitWeights(const std::vector<Timing>& timings);

// {"device", "method": {"name": "auto", "pass_ns", "texel_ns", "fit_ns", "search_ns"}}: the second goes into a case. Throws std::runtime_error.
[[nodiscard]] cli::Json profileOf(offscreen::Renderer& renderer);

}  // namespace gnomon::report
