#include "drawn.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include <glm/glm.hpp>

namespace gnomon::figures {
namespace {

constexpr WarpSettings kWarp{.warp = Warp::lispsm, .eta = 0.0};

}  // namespace

Table shadowTimes(offscreen::Renderer& renderer, const offscreen::Mesh& mesh, const offscreen::View& view, std::span<const int> maps,
                  int runs, const Progress& progress) {
  Table table{"shadow_times", {"maps", "culled_ms", "whole_ms", "culled_triangles", "whole_triangles"}, {}};
  const Box bounds{mesh.min, mesh.max};
  Frame frame;
  frame.camera = view.cam;
  frame.light.directionWs = view.lightDirectionWs;
  frame.image = {1280.0, 720.0};
  frame.scene.receivers = {&bounds, 1};
  frame.budget.texels = 512.0 * 512.0;  // few: the triangles cost more than the texels, as in the paper
  offscreen::RenderOptions options;
  options.width = options.height = 16;  // the camera's pass is not what is measured
  renderer.load(mesh);
  for (int run = 1; run <= runs; ++run) {
    progress("Fig. 14: run " + std::to_string(run) + " of " + std::to_string(runs));
    std::size_t at = 0;
    for (const int count : maps) {
      frame.budget.partitions = count;
      const auto culled = std::make_unique<Solution>();
      solve(frame, LloydScheme::zpw, kWarp, *culled);
      const auto whole = std::make_unique<Solution>(*culled);
      for (Partition& map : whole->partitions) map.cullPlaneCount = 0;
      const offscreen::RenderOutput few = renderer.render(frame, *culled, options), all = renderer.render(frame, *whole, options);
      if (run == 1)
        table.rows.push_back({static_cast<double>(count), kInfinity, kInfinity, static_cast<double>(few.shadowTriangles),
                              static_cast<double>(all.shadowTriangles)});
      std::vector<double>& row = table.rows[at++];
      row[1] = std::min(row[1], few.shadowMs);
      row[2] = std::min(row[2], all.shadowMs);
    }
  }
  return table;
}

GridPicture texelGrid(offscreen::Renderer& renderer, const offscreen::Tracer& tracer, const offscreen::View& view, LloydScheme scheme,
                      int maps) {
  constexpr int kScale = 2, kSide = 400;  // drawn larger, for smooth lines
  constexpr double kEvery = 5.0;  // texels between lines
  constexpr int kDrawn = kScale * kSide;
  Frame frame;
  frame.camera = view.cam;
  frame.camera.left = frame.camera.right = frame.camera.up;
  frame.light.directionWs = view.lightDirectionWs;
  frame.image = {kDrawn, kDrawn};
  frame.budget.partitions = maps;
  frame.budget.texels = frame.image.width * frame.image.height;  // as many texels as pixels
  const auto solution = std::make_unique<Solution>();
  solve(frame, scheme, kWarp, *solution);
  offscreen::RenderOptions options;
  options.width = options.height = kDrawn;
  options.time = false;
  const offscreen::Picture picture = offscreen::makePicture(renderer, tracer, frame, *solution, options);
  const offscreen::RenderOutput& image = picture.image;

  const auto at = [&](int x, int y) {
    return static_cast<std::size_t>(std::min(y, kDrawn - 1)) * kDrawn + static_cast<std::size_t>(std::min(x, kDrawn - 1));
  };
  const auto triple = [](const std::vector<float>& values, std::size_t i) {
    return glm::dvec3(values[3 * i], values[3 * i + 1], values[3 * i + 2]);
  };
  // Lines crossed between a pixel and its neighbours; faint where they are closer than a few pixels, none where surfaces end.
  const auto lineAt = [&](int x, int y) {
    const std::size_t i = at(x, y);
    if (image.index[i] >= solution->partitionCount) return 0.0;
    const Partition& map = solution->partitions[image.index[i]];
    const auto cellsAt = [&](std::size_t pixel) {
      const glm::dvec4 clip = glm::dmat4(map.clipFromWorld) * glm::dvec4(triple(image.position, pixel), 1.0);
      return (glm::dvec2(clip) / clip.w * 0.5 + 0.5) * glm::dvec2(map.viewport.z, map.viewport.w) / kEvery;
    };
    const glm::dvec2 here = cellsAt(i);
    glm::dvec2 steps(0.0);
    glm::bvec2 isCrossed(false);
    for (const std::size_t j : {at(x + 1, y), at(x, y + 1)}) {
      if (image.index[j] != image.index[i]) continue;
      const glm::dvec2 there = cellsAt(j);
      steps = glm::max(steps, glm::abs(there - here));
      isCrossed.x |= std::floor(there.x) != std::floor(here.x);
      isCrossed.y |= std::floor(there.y) != std::floor(here.y);
    }
    constexpr double kFaint = 6.0;  // drawn pixels between lines
    const glm::dvec2 line = glm::dvec2(isCrossed) * glm::clamp(2.0 - kFaint * steps, 0.0, 1.0);
    return std::max(line.x, line.y);
  };
  constexpr std::array<glm::dvec3, 6> kTints{
      {{1.0, 0.93, 0.8}, {0.75, 0.9, 1.0}, {0.8, 1.0, 0.78}, {1.0, 0.8, 0.85}, {0.88, 0.8, 1.0}, {0.9, 0.9, 0.9}}};
  const glm::dvec3 towardsLight = -glm::normalize(frame.light.directionWs);
  GridPicture grid{kSide, solution->partitionCount, {}, solution->maxError, picture.wrong.share()};
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x) {
      glm::dvec3 sum(0.0);
      for (int k = 0; k < kScale * kScale; ++k) {
        const int px = kScale * x + k % kScale, py = kScale * y + k / kScale;
        const std::size_t i = at(px, py);
        glm::dvec3 colour(0.97);
        if (image.lit[i] != offscreen::kNothing) {
          const double sun = image.lit[i] == offscreen::kLit ? std::max(glm::dot(triple(image.normal, i), towardsLight), 0.0) : 0.0;
          colour = kTints[image.index[i] % kTints.size()] * (0.45 + 0.55 * sun) * (1.0 - 0.75 * lineAt(px, py));
        }
        sum += colour;
      }
      for (int c = 0; c < 3; ++c) {
        constexpr double kLevels = 23.0;  // few colours make a small file
        grid.pixels.push_back(static_cast<std::uint8_t>(std::lround(std::round(sum[c] / (kScale * kScale) * kLevels) * 255.0 / kLevels)));
      }
    }
  return grid;
}

}  // namespace gnomon::figures
