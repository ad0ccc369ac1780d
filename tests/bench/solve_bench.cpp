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

// Samples of every depth, more of them farther away. norm, and whether a half-space cuts the region.
void optimalSplits(benchmark::State& state, SampleNorm norm) {
  Frame frame = usualFrame();
  const glm::dvec4 plane{0.0, 1.0, 0.0, -0.01};
  if (state.range(0) != 0) frame.scene.planes = {&plane, 1};
  std::vector<std::uint32_t> histogram;
  for (std::uint32_t i = 0; i < 256; ++i) histogram.push_back(1 + i * (i * 2654435761u >> 24));
  Samples samples{.near = 0.2, .far = 90.0, .histogram = histogram};
  frame.samples = &samples;
  Region region;
  LightSpace light;
  Solution solution;
  if (beginSolve(frame, {}, FitMode::doubled, region, light, solution) != Status::ok) state.SkipWithError("refused");
  auto bins = std::make_unique<SampleBins>();
  int first[kMaxPartitions];
  for (auto _ : state) {
    makeBins(frame, region, light, *bins);
    benchmark::DoNotOptimize(splitOptimally(*bins, norm, 4, 0.0, first, nullptr));
  }
}
BENCHMARK_CAPTURE(optimalSplits, max, SampleNorm::max)->Arg(0)->Arg(1);
BENCHMARK_CAPTURE(optimalSplits, mean, SampleNorm::mean)->Arg(0)->Arg(1);
BENCHMARK_CAPTURE(optimalSplits, meanSquare, SampleNorm::meanSquare)->Arg(0)->Arg(1);

void sdsm(benchmark::State& state, SdsmScheme scheme) {
  Frame frame = usualFrame();
  const Samples samples{.near = 0.2, .far = 90.0};
  frame.samples = &samples;
  auto solution = std::make_unique<Solution>();
  SdsmState held;
  for (auto _ : state) {
    if (solveSdsm(frame, {.scheme = scheme}, held, *solution) != Status::ok) state.SkipWithError("refused");
    benchmark::DoNotOptimize(*solution);
  }
}
BENCHMARK_CAPTURE(sdsm, logarithmic, SdsmScheme::logarithmic);
BENCHMARK_CAPTURE(sdsm, optimal, SdsmScheme::optimal);

// A depth buffer of 1920 x 1080 with a part of sky in each row: all of its words summed, and what is read from it.
std::vector<float> depthBuffer(const Camera& camera) {
  std::vector<float> depths(1920 * 1080);
  for (std::size_t i = 0; i < depths.size(); ++i)
    depths[i] =
        i % 1920 > 1400 ? 1.0f : static_cast<float>(windowDepth(camera, 0.5 + static_cast<double>(i * 2654435761u % 90000u) / 1000.0));
  return depths;
}

void depthRead(benchmark::State& state) {
  const std::vector<float> depths = depthBuffer(usualFrame().camera);
  const auto* words = reinterpret_cast<const std::uint32_t*>(depths.data());
  for (auto _ : state) {
    std::uint32_t sum = 0;
    for (std::size_t i = 0; i < depths.size(); ++i) sum += words[i];
    benchmark::DoNotOptimize(sum);
  }
}
BENCHMARK(depthRead)->Unit(benchmark::kMicrosecond);

void depthRange(benchmark::State& state) {
  const Frame frame = usualFrame();
  const std::vector<float> depths = depthBuffer(frame.camera);
  for (auto _ : state) {
    double near, far;
    sampleRange(frame.camera, {depths.data(), 1920, 1080, 1920}, near, far);
    benchmark::DoNotOptimize(near + far);
  }
}
BENCHMARK(depthRange)->Unit(benchmark::kMicrosecond);

void depthHistogram(benchmark::State& state) {
  const Frame frame = usualFrame();
  const std::vector<float> depths = depthBuffer(frame.camera);
  std::vector<float> edges(257);
  std::vector<std::uint32_t> counts(256);
  windowEdges(frame.camera, 0.1, 100.0, edges);
  for (auto _ : state) {
    sampleHistogram(frame.camera, {depths.data(), 1920, 1080, 1920}, edges, counts);
    benchmark::DoNotOptimize(counts.data());
  }
}
BENCHMARK(depthHistogram)->Unit(benchmark::kMicrosecond);

void depthBounds(benchmark::State& state) {
  const Frame frame = usualFrame();
  const std::vector<float> depths = depthBuffer(frame.camera);
  glm::dmat3 lsFromView;
  if (lightForSamples(frame, lsFromView) != Status::ok) state.SkipWithError("refused");
  for (auto _ : state) {
    SampleBounds bounds[4] = {{0.5, 2.0, {}, {}}, {2.0, 7.0, {}, {}}, {7.0, 25.0, {}, {}}, {25.0, 90.5, {}, {}}};
    sampleBounds(frame.camera, {depths.data(), 1920, 1080, 1920}, lsFromView, bounds);
    benchmark::DoNotOptimize(bounds);
  }
}
BENCHMARK(depthBounds)->Unit(benchmark::kMicrosecond);

}  // namespace
