// drawn: the figures of [Lloyd 2006] that take a renderer: the time of shadow passes against the number of maps, and texels on a scene.
//
// Shader part: none.
// Test: tests/figures_test.cpp
#pragma once

#include <functional>
#include <span>

#include "job.h"
#include "scene.h"
#include "tables.h"

namespace gnomon::figures {

using Progress = std::function<void(const std::string&)>;

// Fig. 14: the view's shadow passes, z-partitions with LiSPSM, as many texels for any number of maps; casters culled by Partition::cullPlanes,
// or every map drawn whole. The least of interleaved runs, milliseconds; triangles drawn. Throws std::runtime_error.
[[nodiscard]] Table shadowTimes(offscreen::Renderer& renderer, const offscreen::Mesh& mesh, const offscreen::View& view,
                                std::span<const int> maps, int runs, const Progress& progress);

// Fig. 15: a picture with a line for every fifth texel of the map that serves each pixel, a colour for each map. side x side x 3, rows
// top first.
struct GridPicture {
  int side = 0, maps = 0;
  std::vector<std::uint8_t> pixels;
  double maxError = 0.0, wrongShare = 0.0;  // predicted; against ray tracing
};
[[nodiscard]] GridPicture texelGrid(offscreen::Renderer& renderer, const offscreen::Tracer& tracer, const offscreen::View& view,
                                    LloydScheme scheme, int maps);

}  // namespace gnomon::figures
