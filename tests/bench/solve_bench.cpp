// How long a solve takes: ratios inside one run say something, absolute times little. Input as the README's first lines have it.
#include <memory>

#include <benchmark/benchmark.h>

#include "gnomon/gnomon.h"

namespace {

using namespace gnomon;

Frame usualFrame() {
  Frame frame;
  frame.camera = perspective({1.0, 2.0, 3.0}, {0.3, -0.2, 1.0}, {0.0, 1.0, 0.0}, 1.0, 16.0 / 9.0, 0.1, 100.0);
  frame.light.directionWs = {0.3, -0.8, 0.2};
  return frame;
}

void run(benchmark::State& state, const Frame& frame, const PssmSettings& settings) {
  auto solution = std::make_unique<Solution>();
  for (auto _ : state) {
    if (solvePssm(frame, settings, *solution) != Status::ok) state.SkipWithError("refused");
    benchmark::DoNotOptimize(*solution);
  }
  state.counters["needed/limit"] = solution->limitTexels > 0.0 ? solution->neededTexels / solution->limitTexels : 0.0;
}

void wholeFrustum(benchmark::State& state, FitMode fit) {
  Frame frame = usualFrame();
  frame.budget.partitions = static_cast<int>(state.range(0));
  run(state, frame, {.split = {}, .fit = fit});
}
BENCHMARK_CAPTURE(wholeFrustum, tight, FitMode::tight)->Arg(1)->Arg(4)->Arg(16);
BENCHMARK_CAPTURE(wholeFrustum, slice, FitMode::slice)->Arg(4);
BENCHMARK_CAPTURE(wholeFrustum, stable, FitMode::stable)->Arg(4);

void boxAndHalfSpace(benchmark::State& state) {
  Frame frame = usualFrame();
  const Box box{{-50.0, 0.0, -50.0}, {50.0, 20.0, 50.0}};
  const glm::dvec4 plane{0.0, 1.0, 0.0, -0.01};
  frame.scene.receivers = {&box, 1};
  frame.scene.planes = {&plane, 1};
  run(state, frame, {});
}
BENCHMARK(boxAndHalfSpace);

void manyReceivers(benchmark::State& state) {
  Frame frame = usualFrame();
  std::vector<Box> boxes;
  for (int i = 0; i < state.range(0); ++i) {
    const glm::dvec3 centre(8.0 * std::sin(1.7 * i), 1.0, 3.0 + i);
    boxes.push_back({centre - glm::dvec3(1.0), centre + glm::dvec3(1.0)});
  }
  frame.scene.receivers = boxes;
  run(state, frame, {});
}
BENCHMARK(manyReceivers)->Arg(2)->Arg(16)->Arg(100);

}  // namespace
