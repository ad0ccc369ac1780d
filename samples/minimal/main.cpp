// minimal: the whole of gnomon without a graphics API: one solve, and what a renderer reads from the answer.
#include <cstdio>

#include "gnomon/camera.h"
#include "gnomon/gnomon.h"

int main() {
  gnomon::Frame frame;
  frame.camera = gnomon::perspective({0.0, 1.7, 0.0}, {0.0, 0.0, -1.0}, {0.0, 1.0, 0.0}, 1.05, 16.0 / 9.0, 0.1, 500.0);
  frame.light.directionWs = {-0.5, -1.0, -0.3};
  frame.budget.partitions = 4;
  frame.budget.resolution = 2048;

  gnomon::Solution solution;
  if (const gnomon::Status status = gnomon::solvePssm(frame, {}, solution); status != gnomon::Status::ok) {
    std::fprintf(stderr, "%s: %s, got %g\n", gnomon::statusField(status), gnomon::statusRule(status), solution.refusedValue);
    return 1;
  }

  std::printf("atlas %d x %d texels, %d maps, block of %zu bytes\n", solution.atlas.x, solution.atlas.y, solution.partitionCount,
              sizeof solution.block);
  for (int i = 0; i < solution.partitionCount; ++i) {
    const gnomon::Partition& map = solution.partitions[i];
    std::printf("map %d: view depth %8.3f to %8.3f, viewport %4d x %4d at (%d, %d), texel up to %.3f pixels\n", i, map.near, map.far,
                map.viewport.z, map.viewport.w, map.viewport.x, map.viewport.y, map.error.s > map.error.t ? map.error.s : map.error.t);
  }
  std::printf("error at most %.3f texel edges per pixel; %.0f texels would reach 1\n", solution.maxError, solution.neededTexels);

  // What a shader does with the block, on the CPU: a point 20 units ahead of the eye and 1.7 below it.
  const glm::dvec3 point = glm::dvec3(0.0, 0.0, -20.0) - solution.originWs;
  const double depth = gnomon::viewDepth(solution.block, point);
  const int served = gnomon::selectByViewDepth(solution.block, static_cast<float>(depth));
  if (served < 0) return 1;
  const glm::dvec3 atlas = gnomon::atlasPosition(solution.block, served, point);
  std::printf("the point at view depth %.2f reads map %d at uv (%.4f, %.4f), stored depth %.4f\n", depth, served, atlas.x, atlas.y,
              atlas.z);
  return 0;
}
