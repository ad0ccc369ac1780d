// Any bytes as a frame and settings: finite within the budget, or refused with a reason.
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <memory>
#include <vector>

#include "finite.h"
#include "gnomon/gnomon.h"

namespace {

using namespace gnomon;

// Numbers as shadow code meets them: from a table, small, or any bits at all.
class Bytes {
 public:
  Bytes(const std::uint8_t* data, std::size_t size) : data_(data), size_(size) {}
  int below(int n) { return size_ == 0 ? 0 : (--size_, *data_++ % n); }
  double real() {
    constexpr double kInf = std::numeric_limits<double>::infinity();
    static constexpr double kTable[] = {0.0,   -0.0,  1.0,    -1.0,   0.5,    2.0,    1e-15, 1e-9,
                                        1e-3,  0.1,   10.0,   1e3,    1e6,    1e9,    1e30,  1e38,
                                        1e39,  1e160, 1e300,  5e-324, 1e-310, 1e-160, 1e-45, kInf,
                                        -kInf, 1e-30, 1.0001, 0.9999, 1e-170, -1e3,   -1e9,  std::numeric_limits<double>::quiet_NaN()};
    const int kind = below(256);
    if (kind < 64) return kTable[static_cast<std::size_t>(kind) % std::size(kTable)];
    if (kind < 224) return (below(256) + below(256) / 256.0 - 128.0) * (kind < 144 ? 1.0 / 16.0 : 1.0);
    double value = 0.0;
    std::uint8_t raw[8]{};
    for (std::uint8_t& byte : raw) byte = static_cast<std::uint8_t>(below(256));
    std::memcpy(&value, raw, 8);
    return value;
  }
  double positive() { return std::abs(real()); }
  glm::dvec3 vector() {
    const double x = real(), y = real(), z = real();
    return {x, y, z};
  }
  [[nodiscard]] bool isEmpty() const { return size_ == 0; }

 private:
  const std::uint8_t* data_;
  std::size_t size_;
};

[[noreturn]] void fail(const char* what, const Solution& solution) {
  std::fprintf(stderr, "%s: status %s %s, %d partitions\n", what, statusField(solution.status), statusRule(solution.status),
               solution.partitionCount);
  std::abort();
}

void check(const Frame& frame, const Solution& solution) {
  if (solution.status != Status::ok) {
    if (solution.partitionCount != 0 || solution.block.info.x != 0u) fail("refused with partitions", solution);
    if (!*statusField(solution.status) || !*statusRule(solution.status)) fail("refused without a reason", solution);
    return;
  }
  if (solution.partitionCount < 0 || solution.partitionCount > frame.budget.partitions) fail("over budget", solution);
  if (!test::isFinite(solution)) fail("not finite", solution);
  // What shaders read of the block: all but its integers and the partitions that there are not.
  const GnomonBlock& block = solution.block;
  const auto *floats = reinterpret_cast<const float*>(&block), *integers = reinterpret_cast<const float*>(&block.rowCells),
             *end = reinterpret_cast<const float*>(&block.partitions[0] + block.info.x);
  for (const float* value = floats + 4; value < end; ++value)
    if (!(value >= integers && value < integers + 4) && !std::isfinite(*value)) {
      std::fprintf(stderr, "float %td of the block is %g\n", value - floats, static_cast<double>(*value));
      fail("the block is not finite", solution);
    }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t count) {
  Bytes bytes(data, count);
  const int method = bytes.below(5);
  Frame frame;
  Camera& camera = frame.camera;
  if (bytes.below(4) == 0) camera.projection = Projection::orthographic;
  camera.depth = static_cast<DepthConvention>(bytes.below(3));
  for (double* field : {&camera.left, &camera.right, &camera.down, &camera.up, &camera.near, &camera.far}) *field = bytes.real();
  if (bytes.below(4) == 0) camera.shadowDistance = bytes.real();
  camera.positionWs = bytes.vector();
  camera.forwardWs = bytes.vector();
  camera.upWs = bytes.vector();
  frame.light.directionWs = bytes.vector();
  if (bytes.below(4) == 0) frame.image = {bytes.positive(), bytes.positive()};
  std::vector<Box> receivers, casters;
  std::vector<glm::dvec4> planes;
  const auto box = [&] {
    const glm::dvec3 a = bytes.vector(), size = bytes.vector();
    return Box{a, a + glm::abs(size)};
  };
  for (int i = bytes.below(8) - 4; i > 0; --i) receivers.push_back(box());
  if (!receivers.empty() && bytes.below(4) == 0)
    for (int i = 0; i < 100; ++i) receivers.push_back({receivers[0].minWs + camera.forwardWs * static_cast<double>(i), receivers[0].maxWs});
  for (int i = bytes.below(6) - 3; i > 0; --i) casters.push_back(box());
  for (int i = bytes.below(6) - 3; i > 0; --i) {
    const glm::dvec3 normal = bytes.vector();
    planes.emplace_back(normal, bytes.real());
  }
  frame.scene = {receivers, casters, planes};
  frame.budget.partitions = bytes.below(4) ? 1 + bytes.below(kMaxPartitions) : bytes.below(64) - 8;
  frame.budget.resolution = 1 << bytes.below(14);
  if (bytes.below(4) == 0) frame.budget.texels = bytes.positive();
  if (bytes.below(4) == 0) frame.budget.atlas = {bytes.below(256), bytes.below(256)};
  if (bytes.below(4) == 0) frame.budget.targetError = bytes.positive();
  if (bytes.below(4) == 0) {
    frame.margin.filter = bytes.positive();
    frame.margin.normalOffset = bytes.positive();
    frame.margin.blend = bytes.positive();
    frame.margin.border = bytes.below(16);
    frame.margin.motion[0] = bytes.real();
  }
  frame.worldSpace = bytes.below(8) == 0;
  frame.fade = bytes.below(4) ? 0.0 : bytes.real();
  frame.shadowMap.depth = static_cast<DepthConvention>(bytes.below(3));
  frame.shadowMap.style = static_cast<ClipStyle>(bytes.below(3));
  frame.shadowMap.layout = static_cast<MapLayout>(bytes.below(2));
  Samples samples;
  std::vector<std::uint32_t> histogram;
  std::vector<SampleBounds> bounds;
  if (method == 3 || bytes.below(8) == 0) {
    samples.near = bytes.real();
    samples.far = bytes.real();
    for (int i = bytes.below(64); i > 0; --i) histogram.push_back(static_cast<std::uint32_t>(bytes.below(256)));
    for (int i = bytes.below(4); i > 0; --i) {
      const double near = bytes.real(), far = bytes.real();
      const glm::dvec2 least(bytes.real(), bytes.real()), size(bytes.positive(), bytes.positive());
      bounds.push_back({near, far, least, least + size});
    }
    if (bytes.below(4) == 0) samples.latency = bytes.real();
    samples.histogram = histogram;
    samples.bounds = bounds;
    frame.samples = &samples;
  }

  const SplitSettings splitting{.scheme = static_cast<SplitScheme>(bytes.below(3)),
                                .lambda = bytes.below(4) ? 0.5 : bytes.real(),
                                .bias = bytes.below(4) ? 0.0 : bytes.real(),
                                .count = bytes.below(4) ? 0 : bytes.below(32),
                                .automatic = bytes.below(4) == 0};
  const WarpSettings warp{.warp = static_cast<Warp>(bytes.below(6)), .eta = bytes.below(4) ? 0.0 : bytes.real()};
  static const auto solution = std::make_unique<Solution>();
  if (method == 0) (void)solvePssm(frame, {.split = splitting, .fit = static_cast<FitMode>(bytes.below(3))}, *solution);
  if (method == 1)
    (void)solveLloyd(frame,
                     {.scheme = static_cast<LloydScheme>(bytes.below(6)),
                      .split = splitting,
                      .minimax = bytes.below(4) == 0,
                      .warp = warp,
                      .shares = static_cast<Shares>(bytes.below(2)),
                      .nearFace = static_cast<NearFace>(bytes.below(2)),
                      .rows = bytes.below(2) == 0},
                     *solution);
  if (method == 2)
    (void)solveLspsm(frame,
                     {.rows = {.rule = static_cast<RowRule>(bytes.below(3)),
                               .zeta = bytes.below(4) ? 0.25 : bytes.real(),
                               .sigma = bytes.below(4) ? 0.5 : bytes.real(),
                               .maxRows = 1 + bytes.below(kMaxPartitions),
                               .maxColumns = 1 + bytes.below(kMaxPartitions)},
                      .warp = warp},
                     *solution);
  SdsmState state;
  if (method == 3)
    (void)solveSdsm(frame,
                    {.scheme = static_cast<SdsmScheme>(bytes.below(4)),
                     .norm = static_cast<SampleNorm>(bytes.below(3)),
                     .bounds = bytes.below(4) != 0,
                     .hysteresis = bytes.below(4) ? 0.0 : bytes.real(),
                     .quantise = bytes.below(4) == 0,
                     .automatic = bytes.below(4) == 0},
                    state, *solution);
  if (method == 4) {
    AutoState kept;
    AutoSettings settings{.hasTarget = bytes.below(4) != 0};
    (void)solveAuto(frame, settings, kept, *solution);
    check(frame, *solution);
    frame.samples = nullptr;  // what was kept of other samples
    (void)solveAuto(frame, settings, kept, *solution);
  }
  check(frame, *solution);
  return 0;
}
