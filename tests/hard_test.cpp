// A soak of every method over the families of tests/hard/cases.h. Each case is a seed: on a failure the seed is
// printed, and GNOMON_SOAK_SEED=<seed> GNOMON_SOAK=1 runs that case alone. GNOMON_SOAK: cases for each method.
#include "hard/cases.h"

#include <iostream>
#include <limits>
#include <sstream>

namespace gnomon::test {
namespace {

std::uint64_t numberOf(const char* variable, std::uint64_t otherwise) {
  const char* text = std::getenv(variable);
  return text ? std::strtoull(text, nullptr, 10) : otherwise;
}

// Texel edges at a point: the derivative of the emitted matrix, in more than double. Along s over t, in texels of the light plane.
glm::dvec2 texelAt(const Partition& map, const glm::dvec3& rel, const glm::dvec3& light) {
  using V = glm::tvec3<long double>;
  const V d = glm::normalize(V(light)), axis = std::abs(d.x) < 0.6L ? V(1, 0, 0) : V(0, 0, 1), a = glm::normalize(glm::cross(d, axis)),
          b = glm::cross(d, a), p(rel);
  const auto row = [&](int r) { return V(map.clipFromWorld[0][r], map.clipFromWorld[1][r], map.clipFromWorld[2][r]); };
  const auto at = [&](int r) { return glm::dot(row(r), p) + static_cast<long double>(map.clipFromWorld[3][r]); };
  const long double w = at(3);
  const V s = (row(0) - row(3) * (at(0) / w)) * (static_cast<long double>(map.viewport.z) / (2.0L * w)),
          t = (row(1) - row(3) * (at(1) / w)) * (static_cast<long double>(map.viewport.w) / (2.0L * w));
  const long double sa = glm::dot(s, a), sb = glm::dot(s, b), ta = glm::dot(t, a), tb = glm::dot(t, b), det = std::abs(sa * tb - sb * ta);
  return {static_cast<double>(std::hypot(ta, tb) / det), static_cast<double>(std::hypot(sa, sb) / det)};
}

// Rows over lengths past 1e31 are told by float32 numbers that have lost digits.
bool isBelowNormal(const glm::mat4& m) {
  const glm::vec4 most = glm::max(glm::max(glm::abs(m[0]), glm::abs(m[1])), glm::abs(m[2]));
  return std::min(most.x, most.y) < std::numeric_limits<float>::min() / std::numeric_limits<float>::epsilon();
}

// What went wrong, in words; empty: nothing.
std::string checkPoint(const HardCase& c, const Solution& solution, const glm::dvec3& wanted, bool isSample) {
  const Frame& frame = c.frame;
  const Camera& camera = frame.camera;
  const glm::dvec3 ws = camera.positionWs + wanted, fromEye = ws - camera.positionWs;  // as rounded
  const Axes axes(camera);
  const double z = glm::dot(fromEye, axes.forward), x = glm::dot(fromEye, axes.right), y = glm::dot(fromEye, axes.up);
  const double w = camera.projection == Projection::perspective ? z : 1.0;
  const double reach = glm::length(fromEye), far = std::min(camera.far, camera.shadowDistance);
  const double tiny = 1e-14 * reach;
  if (!(reach < kInfinity)) return {};
  if (z < camera.near - tiny || z > far + tiny) return {};
  if (c.eyes.empty() &&
      (x < -camera.left * w - tiny || x > camera.right * w + tiny || y < -camera.down * w - tiny || y > camera.up * w + tiny))
    return {};
  if (frame.samples && !isSample) return {};
  // Rounding of the world position moves a sample: only those that the samples still describe.
  if (isSample && glm::length(fromEye - wanted) > 1e-12 * reach) return {};
  Frame without = frame;
  without.scene.planes = {};
  if (!needsShadow(without, ws)) return {};
  for (const glm::dvec4& plane : frame.scene.planes)
    if (!(glm::dot(glm::dvec3(plane), ws) + plane.w >= 4e-15 * (glm::length(glm::dvec3(plane)) * glm::length(ws) + std::abs(plane.w))))
      return {};
  // Corners are given as positions: both they and the point are off by their rounding.
  const auto roundingOf = [&](const Partition& map, int r) {
    const glm::dvec3 row(map.clipFromWorld[0][r], map.clipFromWorld[1][r], map.clipFromWorld[2][r]);
    return c.eyes.empty() ? 0.0 : 2.0 * std::numeric_limits<double>::epsilon() * glm::length(ws) * glm::length(row);
  };
  bool isCovered = false, isClaimedAtAll = false;
  std::ostringstream wrong;
  const double lowest = frame.shadowMap.depth == DepthConvention::negativeOneToOne ? -1.0 : 0.0;
  const double depthSlack = 1e-12 * reach + (z - camera.near < 0.0 ? camera.near - z : 0.0);
  for (int i = 0; i < solution.partitionCount; ++i) {
    const Partition& map = solution.partitions[i];
    double inside = std::min(z - map.near, map.far - z);
    for (int p = 0; p < map.planeCount; ++p)
      inside = std::min(inside, (glm::dot(glm::dvec3(map.planes[p]), ws) + map.planes[p].w) / glm::length(glm::dvec3(map.planes[p])));
    const double unsure = depthSlack + 1e-14 * glm::length(ws) + (c.isFromDepths ? depthQuantum(camera, z) : 0.0);
    if (!(inside >= -unsure)) continue;
    isClaimedAtAll = true;
    const glm::dvec3 rel = ws - solution.originWs;
    const glm::dvec4 q = glm::dmat4(map.clipFromWorld) * glm::dvec4(rel, 1.0);
    const glm::dvec3 ndc = glm::dvec3(q) / q.w;
    constexpr double slack = 1.1e-6;
    // In world space a warning says that more than a tenth of a texel is lost.
    const double lost = frame.worldSpace ? 0.2 / std::min(map.viewport.z, map.viewport.w) : 0.0;
    const bool isInside = q.w > 0.0 && std::abs(ndc.x) <= 1.0 + slack + lost + roundingOf(map, 0) &&
                          std::abs(ndc.y) <= 1.0 + slack + lost + roundingOf(map, 1) && ndc.z >= lowest - slack - lost &&
                          ndc.z <= 1.0 + slack + lost;
    if (isInside) isCovered = true;
    if (!isInside)
      wrong << "(map " << i << " by " << inside << " of " << unsure << " clip-1 " << std::abs(ndc.x) - 1.0 << " " << std::abs(ndc.y) - 1.0
            << " z " << ndc.z << ") ";
    if (!isInside && inside > unsure) {
      wrong << "map " << i << " at depth " << z << " clip-1: " << std::abs(ndc.x) - 1.0 << " " << std::abs(ndc.y) - 1.0 << " z " << ndc.z
            << " w " << q.w << " warp " << static_cast<int>(map.warp);
      return wrong.str();
    }
    if (!isInside || inside < (map.planeCount > 0 ? unsure : 0.0)) continue;
    const double pixel = pixelAt(frame, z);
    if (c.isPoisoned && isBelowNormal(map.clipFromWorld)) continue;
    const glm::dvec2 texel = texelAt(map, rel, frame.light.directionWs) / pixel;
    if (!(texel.x <= map.error.s * (1.0 + 1e-5) && texel.y <= map.error.t * (1.0 + 1e-5))) {
      wrong << "map " << i << " at depth " << z << " error over predicted: " << texel.x / map.error.s << " " << texel.y / map.error.t
            << " warp " << static_cast<int>(map.warp);
      return wrong.str();
    }
  }
  // What the depth buffer selects holds the point too: shaders look no further.
  bool isByDepth = !c.isPoisoned;
  for (int i = 0; i < solution.partitionCount; ++i)
    isByDepth = isByDepth && solution.partitions[i].planeCount == 0 && solution.block.partitions[i].interval.x < 1e38f;
  if (isByDepth && isCovered) {
    const bool isByView = (solution.block.info.y & GNOMON_FLAG_VIEW_DEPTH) != 0u;
    const int selected = isByView ? selectByViewDepth(solution.block, static_cast<float>(z))
                                  : selectByWindowDepth(solution.block, static_cast<float>(windowDepth(camera, z)));
    if (selected < 0) {
      wrong << "not selected at depth " << z;
      return wrong.str();
    }
    const Partition& map = solution.partitions[selected];
    const glm::dvec4 q = glm::dmat4(map.clipFromWorld) * glm::dvec4(ws - solution.originWs, 1.0);
    const glm::dvec3 ndc = glm::dvec3(q) / q.w;
    const double out = std::max(std::abs(ndc.x) - roundingOf(map, 0), std::abs(ndc.y) - roundingOf(map, 1)) - 1.0;
    if (!((q.w > 0.0 && out <= 1.1e-6) || frame.worldSpace)) {
      wrong << "outside the selected map " << selected << " at depth " << z << " clip-1 " << out;
      return wrong.str();
    }
  }
  if (isCovered) return {};
  wrong << (isClaimedAtAll ? "outside its map" : "unclaimed") << " at depth " << z << " of " << camera.near << " to " << far;
  return wrong.str();
}

bool isAllowed(const HardCase& c, Status status) {
  if (c.isPoisoned) return true;
  switch (status) {
    case Status::marginTexels: return c.frame.margin.filter + c.frame.margin.normalOffset > 0.0 || c.mayBeSnapped;
    case Status::budgetAtlas: return c.frame.budget.atlas.x > 0;
    case Status::budgetTexels: return c.frame.budget.texels < c.frame.budget.partitions;
    case Status::rowsReach: return true;  // the test sets RowRule::paper
    case Status::worldSpacePrecision:
    case Status::stableWorldSpace: return c.frame.worldSpace;
    case Status::stableCorners: return !c.eyes.empty();
    case Status::corners: return !c.eyes.empty();  // views that cross within their depths have no near face, moved ones no flat faces
    case Status::cameraUp: return c.families.find("up-along") != std::string::npos;
    default: return false;
  }
}

std::string verify(const HardCase& c, const Solution& solution, Random& random) {
  if (!isFinite(solution)) return "not finite";
  if (solution.status != Status::ok) {
    if (solution.partitionCount != 0 || solution.block.info.x != 0u) return "refused with partitions";
    if (!*statusField(solution.status) || !*statusRule(solution.status)) return "refused without a reason";
    return isAllowed(c, solution.status) ? "" : std::string("refused: ") + statusField(solution.status) + " " + statusRule(solution.status);
  }
  if (solution.partitionCount > c.frame.budget.partitions) return "too many partitions";
  for (int i = 0; i < solution.partitionCount; ++i) {
    const glm::ivec4& v = solution.partitions[i].viewport;
    if (v.x < 0 || v.y < 0 || v.z < 1 || v.w < 1 || v.x + v.z > solution.atlas.x || v.y + v.w > solution.atlas.y)
      return "viewport outside the atlas";
  }
  if (solution.limitTexels > solution.neededTexels * (1.0 + 1e-5) && solution.limitTexels > 0.0 && solution.partitionCount > 0) {
    std::ostringstream text;
    text << "limit above needed: " << solution.limitTexels << " " << solution.neededTexels << " maps " << solution.partitionCount;
    return text.str();
  }
  if (solution.warnings & static_cast<std::uint32_t>(Warning::worldSpacePrecision)) return {};  // it says so
  if (c.isPoisoned && !(glm::length(c.frame.camera.positionWs) < 1e100)) return {};
  const bool isRatio = c.frame.camera.projection == Projection::perspective;
  std::string wrong;
  const auto add = [&](const glm::dvec3& fromEye, bool isSample) {
    if (wrong.empty()) wrong = checkPoint(c, solution, fromEye, isSample);
  };
  if (!c.cloud.empty() && !c.isPoisoned)
    for (const glm::dvec3& sample : c.cloud) add(sample, true);
  if (c.frame.samples) return wrong;
  const double near = c.frame.camera.near, far = std::min(c.frame.camera.far, c.frame.camera.shadowDistance);
  if (!(near < far)) return wrong;
  for (int n = 0; n < 60; ++n) {
    const double x = n % 3 ? random.uniform() : random.index(2), y = n % 5 ? random.uniform() : random.index(2);
    double z = n % 7 == 0 ? (random.index(2) ? near : far) : isRatio ? random.logUniform(near, far) : random.uniform(near, far);
    if (n % 7 == 1 && solution.partitionCount > 0) {  // beside a split
      const Partition& map = solution.partitions[random.index(solution.partitionCount)];
      z = (random.index(2) ? map.near : map.far) * (1.0 + random.uniform(-1.0, 1.0) * 1e-9);
    }
    if (n % 2 && solution.partitionCount > 0) {  // where the maps are
      const Partition& map = solution.partitions[random.index(solution.partitionCount)];
      z = random.uniform(map.near, map.far);
    }
    if (c.eyes.empty()) {
      add(viewPoint(c.frame.camera, x, y, std::clamp(z, near, far)), false);
    } else {  // a poisoned camera may see farther than the eyes whose views are served
      const Camera& eye = c.eyes[static_cast<std::size_t>(n % 2)];
      const double eyeFar = std::min(eye.far, eye.shadowDistance);
      add(viewPoint(eye, x, y, std::clamp(z, eye.near, eyeFar)) + (eye.positionWs - c.frame.camera.positionWs), false);
    }
  }
  for (int n = 0; n < 8 && solution.partitionCount > 0 && c.eyes.empty(); ++n) {  // corners that float32 depth may put across a split
    const Partition& map = solution.partitions[random.index(solution.partitionCount)];
    const double split = n < 4 ? map.near : map.far, z = split + random.uniform(-1.0, 1.0) * depthQuantum(c.frame.camera, split);
    add(viewPoint(c.frame.camera, n & 1, n >> 1 & 1, std::clamp(z, near, far)), false);
  }
  if (!c.eyes.empty()) return wrong;  // points of boxes may be outside of both views
  const std::size_t boxes = std::min<std::size_t>(c.receivers.size(), 20);
  for (std::size_t i = 0; i < boxes; ++i) {
    const Box& box =
        c.receivers[c.receivers.size() > boxes ? static_cast<std::size_t>(random.index(static_cast<int>(c.receivers.size()))) : i];
    for (int n = 0; n < 16; ++n) {
      glm::dvec3 share;
      for (int a = 0; a < 3; ++a) share[a] = n < 8 ? (n >> a & 1) : random.uniform();
      add(box.minWs + (box.maxWs - box.minWs) * share - c.frame.camera.positionWs, false);
    }
  }
  return wrong;
}

#ifdef __SANITIZE_ADDRESS__
constexpr std::uint64_t kCases = 1000;  // for each method: sanitizers take their time
#else
constexpr std::uint64_t kCases = 20000;
#endif

// What went wrong with a case, in words; empty: nothing.
std::string failureOf(const HardMethod& method, std::uint64_t seed, Solution& solution) {
  Random random = hardRandom(seed);
  HardCase c;
  makeHardCase(random, method.isSampled, c);
  const std::string settings = method.solve(c, random, solution), wrong = verify(c, solution, random);
  return wrong.empty() ? wrong : "seed " + std::to_string(seed) + ": " + wrong + " | " + settings + " |" + c.families;
}

void soak(std::uint64_t otherwise, const HardMethod& method) {
  const std::uint64_t first = numberOf("GNOMON_SOAK_SEED", 1), count = numberOf("GNOMON_SOAK", otherwise);
  auto solution = std::make_unique<Solution>();
  int failures = 0;
  for (std::uint64_t seed = first; seed < first + count; ++seed) {
    const std::string failure = failureOf(method, seed, *solution);
    if (!failure.empty() && ++failures <= 200) ADD_FAILURE() << failure;
    const std::uint64_t done = seed - first + 1, step = std::max<std::uint64_t>(count / 100, 1);
    if (count > kCases && done % step == 0)
      std::cerr << method.name << ": " << done << " of " << count << ", failures: " << failures << '\n';
  }
}

// What a float depth buffer says: whatever was rendered to a pixel lies in a map.
std::string solveByDepths(HardCase& c, Random& random, Solution& solution) {
  const Camera& camera = c.frame.camera;
  c.receivers.clear();
  c.planes.clear();
  c.frame.scene = {};
  c.frame.cornersWs = {};
  c.eyes.clear();
  const int width = 1 + random.index(20), height = 1 + random.index(12), gap = random.index(4);
  std::vector<float> depths(static_cast<std::size_t>((width + gap) * height), std::numeric_limits<float>::quiet_NaN());
  const bool isReversed = camera.depth == DepthConvention::reversedZeroToOne, isPerspective = camera.projection == Projection::perspective;
  const double low = random.uniform(), high = random.index(4) ? random.uniform() : low;
  const float strange[] = {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(), -1.0f, 2.0f, 1e-45f, -0.0f};
  for (float& depth : depths) {
    const double share = low + (high - low) * random.uniform();
    const double z = isPerspective ? camera.near * std::pow(std::min(camera.far, 1e12 * camera.near) / camera.near, share)
                                   : camera.near + (camera.far - camera.near) * share;
    depth = static_cast<float>(windowDepth(camera, z));
    if (random.index(20) == 0) depth = isReversed ? 0.0f : 1.0f;
    if (random.index(40) == 0) depth = strange[random.index(6)];
  }
  const DepthImage image{.depths = depths.data(), .width = width, .height = height, .stride = width + gap};
  sampleRange(camera, image, c.samples.near, c.samples.far);
  const bool isEmpty = !(c.samples.near <= c.samples.far);
  glm::dmat3 lsFromView(1.0);
  const bool isLit = lightForSamples(c.frame, lsFromView) == Status::ok;
  std::string settings = isEmpty ? "nothing sampled" : "";
  if (!isEmpty && isLit && !c.isPoisoned) {
    if (c.samples.near > 0.0 && random.index(2)) {
      std::vector<float> edges(static_cast<std::size_t>(2 + random.index(200)));
      windowEdges(camera, c.samples.near, c.samples.far, edges);
      c.histogram.resize(edges.size() - 1);
      sampleHistogram(camera, image, edges, c.histogram);
      c.samples.histogram = c.histogram;
      settings += "histogram ";
    }
    if (random.index(2)) {
      const int parts = 1 + random.index(16);
      for (int i = 0; i < parts; ++i) {
        const double near = c.samples.near, far = c.samples.far;
        const auto edge = [&](int k) {
          return k == parts      ? far
                 : isPerspective ? near * std::pow(far / near, static_cast<double>(k) / parts)
                                 : near + (far - near) * k / parts;
        };
        c.bounds.push_back({edge(i), std::max(edge(i), edge(i + 1)), glm::dvec2(0.0), glm::dvec2(0.0)});
      }
      sampleBounds(camera, image, lsFromView, c.bounds);
      c.bounds.resize(keepBounds(c.bounds));
      c.samples.bounds = c.bounds;
      settings += "bounds ";
    }
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        const float depth = depths[static_cast<std::size_t>(y * image.stride + x)];
        const bool isSample = isReversed ? depth > 0.0f && depth <= 1.0f : depth >= 0.0f && depth < 1.0f;
        if (!isSample) continue;
        const double t = isReversed ? 1.0 - static_cast<double>(depth) : static_cast<double>(depth),
                     u = isReversed ? static_cast<double>(depth) : 1.0 - t;
        const double z = isPerspective ? 1.0 / (u / camera.near + t / camera.far) : camera.near * u + camera.far * t;
        if (z > std::min(camera.far, camera.shadowDistance)) continue;
        c.cloud.push_back(viewPoint(camera, (x + 0.5) / width, (y + 0.5) / height, z));
      }
  }
  if (c.isPoisoned) c.samples = {};
  c.frame.samples = &c.samples;
  c.isFromDepths = true;
  const SdsmSettings sdsm{.scheme = static_cast<SdsmScheme>(random.index(4)),
                          .norm = static_cast<SampleNorm>(random.index(3)),
                          .hysteresis = random.index(3) ? 0.0 : random.uniform(),
                          .quantise = random.index(4) == 0};
  SdsmState state;
  c.mayBeSnapped = sdsm.quantise;
  (void)solveSdsm(c.frame, sdsm, state, solution);
  return settings + "scheme " + std::to_string(static_cast<int>(sdsm.scheme)) + (sdsm.hysteresis > 0.0 ? " held" : "") +
         (sdsm.quantise ? " doubled" : "");
}

const HardMethod kDepthImages{"DepthImage", false, solveByDepths};

// Cases that failed once, whatever the soak's length. A change of the families makes other cases of them.
TEST(Hard, PastFailures) {
  auto solution = std::make_unique<Solution>();
  EXPECT_EQ(failureOf(kHardMethods[1], 8346, *solution), "");  // casters far towards the light, receivers past a warp's depth range
  EXPECT_EQ(failureOf(kHardMethods[2], 6993, *solution), "");  // the same, in a row
  EXPECT_EQ(failureOf(kHardMethods[3], 2074, *solution), "");  // a slice's padded start took points of the slice before, across a gap
  EXPECT_EQ(failureOf(kHardMethods[4], 190186, *solution), "");  // the short end of a thin hull was extended past where w is 0
  EXPECT_EQ(failureOf(kHardMethods[1], 215268, *solution), "");  // what stands for the points of hundreds of receivers lay where w is 0
  EXPECT_EQ(failureOf(kHardMethods[4], 544465, *solution), "");  // more to compare than the report has room for: a search without end
  EXPECT_EQ(failureOf(kDepthImages, 410935, *solution),
            "");  // a view seen edge-on: points that rounding alone tells apart bent a hull inwards
}

TEST(Hard, Pssm) { soak(kCases, kHardMethods[0]); }
TEST(Hard, Lloyd) { soak(kCases, kHardMethods[1]); }
TEST(Hard, Lspsm) { soak(kCases, kHardMethods[2]); }
TEST(Hard, Sdsm) { soak(kCases, kHardMethods[3]); }
TEST(Hard, Auto) { soak(kCases, kHardMethods[4]); }
TEST(Hard, AutoOfSamples) { soak(kCases, kHardMethods[5]); }

TEST(Hard, DepthImage) { soak(kCases, kDepthImages); }

}  // namespace
}  // namespace gnomon::test
