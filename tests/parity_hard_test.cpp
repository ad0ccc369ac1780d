// The shaders over the hard families in float32, as the driver evaluates them: which partition serves a point of the view and where it lies
// in its map, against the definitions in double. Half of the points lie on a boundary.
#include "hard/cases.h"
#include "parity.h"

#include <sstream>

namespace gnomon::test {
namespace {

constexpr double kUlp = 0x1p-23;

// World units on either side of a boundary where float32 may decide otherwise: by view depth or planes, four units in the last place of the
// position; by window depth, four steps of the depth's terms besides.
double unsureAt(const Camera& camera, double z, double reach, bool isByWindow) {
  double unsure = 8.0 * kUlp * reach;
  if (isByWindow) {
    const double n = camera.near, f = camera.far, window = std::abs(windowReference(camera, z));
    const double slope = camera.projection == Projection::orthographic ? 1.0 / (f - n) : (std::isfinite(f) ? n * f / (f - n) : n) / (z * z);
    const bool isFine = camera.depth == DepthConvention::reversedZeroToOne && camera.projection == Projection::perspective;
    unsure += 8.0 * kUlp * (isFine ? window + (std::isfinite(f) ? n / (f - n) : 0.0) : 1.0) / slope;
  }
  return unsure;
}

// How far inside of what a partition serves a point lies, world units; negative outside.
double insideOf(const Partition& map, const glm::dvec3& ws, double z) {
  double inside = std::min(z - map.near, map.far - z);
  for (int p = 0; p < map.planeCount; ++p)
    inside = std::min(inside, (glm::dot(glm::dvec3(map.planes[p]), ws) + map.planes[p].w) / glm::length(glm::dvec3(map.planes[p])));
  return inside;
}

bool hasRows(const GnomonBlock& block) {
  bool has = false;
  for (int i = 0; i < 4; ++i) has |= block.rowCells[i] != 0xffffffffu;
  return has;
}

struct Counts {
  int cases = 0, points = 0, decided = 0, boundary = 0, collapsed = 0, inMaps = 0, wrong = 0;
  double worstTexels = 0.0;  // over what is allowed
};

// The point moved onto one of its partition's ends, or onto one of its planes at the same depth.
glm::dvec3 ontoBoundary(Random& random, const Frame& frame, const Partition& map, const glm::dvec3& fromEye) {
  const Axes axes(frame.camera);
  const int side = random.index(map.planeCount + 2);
  if (side >= 2) {
    const glm::dvec3 normal(map.planes[side - 2]), across = normal - axes.forward * glm::dot(normal, axes.forward);
    const double height = glm::dot(normal, frame.camera.positionWs + fromEye) + map.planes[side - 2].w, steep = glm::dot(normal, across);
    return steep > 1e-6 * glm::dot(normal, normal) ? fromEye - across * (height / steep) : fromEye;
  }
  const double z = glm::dot(fromEye, axes.forward), end = side == 0 ? map.near : map.far;
  return frame.camera.projection == Projection::perspective ? fromEye * (end / z) : fromEye + axes.forward * (end - z);
}

bool isInView(const HardCase& c, const glm::dvec3& fromEye) {
  const Camera& camera = c.frame.camera;
  const Axes axes(camera);
  const double z = glm::dot(fromEye, axes.forward), x = glm::dot(fromEye, axes.right), y = glm::dot(fromEye, axes.up),
               w = camera.projection == Projection::perspective ? z : 1.0;
  return z >= c.near && z <= c.far && x >= -camera.left * w && x <= camera.right * w && y >= -camera.down * w && y <= camera.up * w;
}

void compare(Gpu& gpu, const HardCase& c, const Solution& solution, Random& random, Counts& counts) {
  const Frame& frame = c.frame;
  const Camera& camera = frame.camera;
  const Axes axes(camera);
  const bool isByWindow = (solution.block.info.y & GNOMON_FLAG_VIEW_DEPTH) == 0u;
  const glm::dvec3 eye = camera.positionWs - solution.originWs;  // the eye, where shaders have their origin
  std::vector<glm::vec4> byDepth, byIndex;
  for (int i = 0; i < 128; ++i) {
    const int k = random.index(solution.partitionCount);
    const Partition& map = solution.partitions[k];
    const double x = random.uniform(), y = random.uniform(), z = random.uniform(map.near, map.far);
    glm::dvec3 fromEye = viewPoint(camera, x, y, z);
    if (i % 2) fromEye = ontoBoundary(random, frame, map, fromEye);
    const glm::vec3 world(eye + fromEye);
    const double depth = glm::dot(glm::dvec3(world) - eye, axes.forward);
    byDepth.emplace_back(world, static_cast<float>(windowReference(camera, depth)));
    byIndex.emplace_back(world, static_cast<float>(k));
  }
  const auto selected = gpu.run(
      "  result = vec4(float(gnomonSelect(gnomon, point.w, world)), float(gnomonSelectMask(gnomon, world)), "
      "float(gnomonSelectCell(gnomon, world)), gnomonViewDepth(gnomon, world));\n",
      solution.block, byDepth);
  const auto lookups = gpu.run("  result = gnomonAtlas(gnomon, index, world);\n", solution.block, byIndex);
  bool hasPlanes = false;  // or says that depth never finds it
  for (int i = 0; i < solution.partitionCount; ++i)
    hasPlanes |= solution.partitions[i].planeCount > 0 || !(solution.block.partitions[i].interval.x < 1e38f);
  const auto fail = [&](const char* what, std::size_t i, double is, double allowed) {
    if (++counts.wrong <= 20)
      ADD_FAILURE() << what << ": " << is << ", allowed or expected " << allowed << ", point " << i << " |" << c.families;
  };
  ++counts.cases;
  counts.collapsed += !isByWindow;
  for (std::size_t i = 0; i < byDepth.size(); ++i) {
    const glm::dvec3 world(byDepth[i]), ws = solution.originWs + world, fromEye = world - eye;
    if (!isInView(c, fromEye)) continue;
    const double z = glm::dot(fromEye, axes.forward), reach = glm::length(world) + glm::length(eye) + 1e-9 * kUlp * glm::length(ws);
    const double perDepth = camera.projection == Projection::perspective ? z : 1.0,
                 corner = std::abs(z) + perDepth * (std::max(camera.left, camera.right) + std::max(camera.down, camera.up));
    ++counts.points;
    if (!(std::abs(selected[i].w - z) <= 4.0 * kUlp * reach)) fail("view depth", i, selected[i].w - z, 4.0 * kUlp * reach);
    const auto check = [&](const char* what, float answer, double unsure) {
      int claims = 0, certain = -1;
      bool isClaimed = false;
      for (int k = 0; k < solution.partitionCount; ++k) {
        const double inside = insideOf(solution.partitions[k], ws, z);
        // Where no partition adjoins, what it serves is widened, for the whole image alike.
        isClaimed |= answer == static_cast<float>(k) && inside >= -unsure - 8.0 * kUlp * corner;
        if (inside < -unsure) continue;
        ++claims;
        if (inside > unsure) certain = k;
      }
      if (claims == 1 && certain >= 0) {
        ++counts.decided;
        if (answer != static_cast<float>(certain)) fail(what, i, static_cast<double>(answer), certain);
      } else {
        counts.boundary += claims > 0;
        if (!isClaimed && (answer >= 0.0f || certain >= 0)) fail(what, i, static_cast<double>(answer), certain);
      }
    };
    const double unsure = unsureAt(camera, z, reach, false) + 1e-14 * glm::length(ws);
    if (!hasPlanes) check("by depth", selected[i].x, unsureAt(camera, z, reach, isByWindow) + 1e-14 * glm::length(ws));
    check("by mask", selected[i].y, unsure);
    if (hasRows(solution.block)) check("by cell", selected[i].z, unsure);

    const int k = static_cast<int>(byIndex[i].w);
    const Partition& map = solution.partitions[k];
    if (insideOf(map, ws, z) < -unsure) continue;
    const glm::dvec3 texel = texelReference(frame, map, world);
    const glm::dvec4 clip = glm::dmat4(map.clipFromWorld) * glm::dvec4(world, 1.0);
    if (!(clip.w > 0.0)) continue;
    const glm::dvec3 ndc = glm::dvec3(clip) / clip.w;
    if (std::max(std::abs(ndc.x), std::abs(ndc.y)) > 1.0) continue;  // no receiver there
    ++counts.inMaps;
    const auto row = [&](int r) { return glm::dvec3(map.clipFromWorld[0][r], map.clipFromWorld[1][r], map.clipFromWorld[2][r]); };
    for (int axis = 0; axis < 2; ++axis) {
      // Texels that a world unit moves the lookup.
      const double perUnit = glm::length(row(axis) - row(3) * ndc[axis]) / clip.w * map.viewport[2 + axis] / 2.0;
      const double allowed = 0.01 + 2.0 * kUlp * reach * perUnit,
                   is = std::abs(lookups[i][axis] * static_cast<double>(solution.atlas[axis]) - texel[axis]);
      counts.worstTexels = std::max(counts.worstTexels, is / allowed);
      if (!(is <= allowed)) fail("texels", i, is, allowed);
    }
    if (lookups[i].w != 1.0f) fail("in its map", i, static_cast<double>(lookups[i].w), 1.0);
  }
}

TEST(ParityHard, SelectionAndLookup) {
  Gpu gpu(kDialects[2]);
  auto solution = std::make_unique<Solution>();
  int collapsed = 0;
  for (const HardMethod& method : kHardMethods) {
    SCOPED_TRACE(method.name);
    Counts counts;
    for (std::uint64_t seed = 1; counts.cases < 200; ++seed) {
      Random random = hardRandom(seed);
      HardCase c;
      makeHardCase(random, method.isSampled, c);
      if (c.isPoisoned) continue;
      (void)method.solve(c, random, *solution);
      if (solution->status != Status::ok || solution->partitionCount == 0) continue;
      if (solution->warnings & static_cast<std::uint32_t>(Warning::worldSpacePrecision)) continue;  // it says so
      SCOPED_TRACE("seed " + std::to_string(seed));
      compare(gpu, c, *solution, random, counts);
    }
    std::ostringstream text;
    text << counts.points << " points, " << counts.decided << " decided, " << counts.boundary << " boundaries, " << counts.collapsed
         << " cases by view depth, " << counts.inMaps << " in maps, worst " << counts.worstTexels << " of what is allowed, wrong "
         << counts.wrong;
    RecordProperty(method.name, text.str());
    if (std::getenv("VERBOSE")) puts((std::string(method.name) + ": " + text.str()).c_str());
    EXPECT_GT(counts.decided, counts.points / 2) << text.str();
    EXPECT_GT(counts.boundary, counts.points / 20) << text.str();
    collapsed += counts.collapsed;
    EXPECT_GT(counts.inMaps, counts.points / 4) << text.str();
  }
  EXPECT_GT(collapsed, 40);
}

}  // namespace
}  // namespace gnomon::test
