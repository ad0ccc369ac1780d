// minimal: the whole of gnomon without a graphics API: one solve, what a renderer reads from the answer, and the
// block that it uploads.
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

  // The block: what is uploaded, and what glsl/gnomon_block.glsl calls it.
  const auto print = [](const char* name, const glm::vec4& v) { std::printf("  %-16s %12g %12g %12g %12g\n", name, v.x, v.y, v.z, v.w); };
  const gnomon::GnomonBlock& block = solution.block;
  std::printf("block:\n");
  print("info", glm::vec4(block.info));
  print("atlas", block.atlas);
  print("origin", block.origin);
  print("originRest", block.originRest);
  print("lightDirection", block.lightDirection);
  print("viewPlane", block.viewPlane);
  print("depthRule", block.depthRule);
  print("bias", block.bias);
  print("windowStart[0]", block.windowStart[0]);
  print("viewStart[0]", block.viewStart[0]);
  for (int i = 0; i < solution.partitionCount; ++i) {
    const gnomon::GnomonPartition& map = block.partitions[i];
    std::printf(" partitions[%d]:\n", i);
    for (int column = 0; column < 4; ++column) print(column == 0 ? "clipFromWorld" : "", map.clipFromWorld[column]);
    for (int column = 0; column < 4; ++column) print(column == 0 ? "atlasFromWorld" : "", map.atlasFromWorld[column]);
    print("viewport", map.viewport);
    print("uvBounds", map.uvBounds);
    print("interval", map.interval);
    print("layer", map.layer);
  }

  // What a shader does with the block, on the CPU: a point 20 units ahead of the eye and 1.7 below it.
  const glm::dvec3 point = glm::dvec3(0.0, 0.0, -20.0) - solution.originWs;
  const double depth = gnomon::viewDepth(solution.block, point);
  const int served = gnomon::selectByViewDepth(solution.block, static_cast<float>(depth));
  if (served < 0) return 1;
  const glm::dvec4 atlas = gnomon::atlasPosition(solution.block, served, point);
  std::printf("the point at view depth %.2f reads map %d at uv (%.4f, %.4f), stored depth %.4f\n", depth, served, atlas.x, atlas.y,
              atlas.z);
  return 0;
}
