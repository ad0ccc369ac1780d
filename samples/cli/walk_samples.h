// walk_samples: what samples of the view give along a walk [Lauritzen 2010]: parallel splits of fixed weight beside slices by samples, maps by
// samples and both, in predicted error, wrong pixels, triangles and time; and how much a still shadow edge flickers.
//
// Shader part: none.
// Test: tests/cli_test.cpp
#pragma once

#include <string>

#include "render.h"
#include "truth.h"

namespace gnomon::cli {

// Walks along the middle of the mesh that renderer and tracer hold, over its longer side: pictures for each eighth of
// the steps. Returns the table.
[[nodiscard]] std::string walkSamples(offscreen::Renderer& renderer, const offscreen::Tracer& tracer, const Box& bounds,
                                      const glm::dvec3& lightDirectionWs, int steps);

}  // namespace gnomon::cli
