#include "gnomon/block.h"

#include <cstddef>
#include <type_traits>

#include "gnomon/camera.h"
#include "gnomon/error.h"
#include "gnomon/fit.h"
#include "gnomon/split.h"
#include "numeric.h"

namespace gnomon {

// std140: mat4 is four vec4 columns; every member and every array element starts at a multiple of 16.
static_assert(std::is_trivially_copyable_v<GnomonBlock> && std::is_standard_layout_v<GnomonBlock>);
static_assert(sizeof(mat4) == 64 && sizeof(vec4) == 16 && sizeof(uvec4) == 16);
static_assert(offsetof(GnomonPartition, clipFromWorld) == 0);
static_assert(offsetof(GnomonPartition, atlasFromWorld) == 64);
static_assert(offsetof(GnomonPartition, viewport) == 128);
static_assert(offsetof(GnomonPartition, uvBounds) == 144);
static_assert(offsetof(GnomonPartition, interval) == 160);
static_assert(offsetof(GnomonPartition, layer) == 176);
static_assert(offsetof(GnomonPartition, axis) == 192);
static_assert(offsetof(GnomonPartition, left) == 208);
static_assert(offsetof(GnomonPartition, right) == 224);
static_assert(offsetof(GnomonPartition, range) == 240);
static_assert(sizeof(GnomonPartition) == 256);
static_assert(offsetof(GnomonBlock, info) == 0);
static_assert(offsetof(GnomonBlock, atlas) == 16);
static_assert(offsetof(GnomonBlock, origin) == 32);
static_assert(offsetof(GnomonBlock, originRest) == 48);
static_assert(offsetof(GnomonBlock, lightDirection) == 64);
static_assert(offsetof(GnomonBlock, viewPlane) == 80);
static_assert(offsetof(GnomonBlock, depthRule) == 96);
static_assert(offsetof(GnomonBlock, bias) == 112);
static_assert(offsetof(GnomonBlock, windowStart) == 128);
static_assert(offsetof(GnomonBlock, viewStart) == 192);
static_assert(offsetof(GnomonBlock, rowAlong) == 256);
static_assert(offsetof(GnomonBlock, rowAcross) == 272);
static_assert(offsetof(GnomonBlock, rowRule) == 288);
static_assert(offsetof(GnomonBlock, rowCells) == 304);
static_assert(offsetof(GnomonBlock, rowStart) == 320);
static_assert(offsetof(GnomonBlock, rows) == 384);
static_assert(offsetof(GnomonBlock, partitions) == 640);
static_assert(sizeof(GnomonBlock) == 640 + GNOMON_MAX_PARTITIONS * 256);

namespace {

constexpr float kNever = 3e38f;  // a start that no depth reaches

bool isFiniteVector(const vec4& v) noexcept { return (v.x + v.y + v.z + v.w) * 0.0f == 0.0f; }

bool isFiniteMatrix(const mat4& m) noexcept { return isFiniteVector((m[0] + m[1]) * 0.0f + (m[2] + m[3]) * 0.0f); }

// Rounding of the window depth of a view depth, as depthQuantum has it, in window depth itself.
double windowQuantum(const Camera& camera, double viewDepth, double window) noexcept {
  const double step = depthQuantum(camera, viewDepth);
  const double inner = camera.projection == Projection::perspective ? std::max(viewDepth - step, viewDepth / 2.0) : viewDepth - step;
  return std::abs(window - windowDepth(camera, inner));
}

// What a slice serves. Where no partition adjoins, the interval is widened by what float32 depth may confuse: half-open ends need a
// neighbour. sign: the depth rule's.
void writeInterval(const Splits& slices, int i, int count, const Camera& camera, double sign, double blend, GnomonBlock& block) noexcept {
  GnomonPartition& out = block.partitions[i];
  const DepthSpan& slice = slices.slices[i];
  const bool hasBefore = i > 0 && slices.slices[i - 1].far == slice.near,
             hasAfter = i + 1 < count && slices.slices[i + 1].near == slice.far;
  // Across a gap, no further than halfway: the slice before keeps what it serves.
  const bool hasGap = i > 0 && slices.slices[i - 1].far < slice.near;
  const double before = hasGap ? (slices.slices[i - 1].far + slice.near) / 2.0 : -kInfinity;
  const double viewNear = hasBefore ? slice.near : std::max(slice.near - viewQuantum(camera, slice.near), before);
  const double viewFar = hasAfter ? slice.far : slice.far + viewQuantum(camera, slice.far);
  const double atFar = windowDepth(camera, slice.far);
  const double windowFar = atFar * sign + (hasAfter ? 0.0 : windowQuantum(camera, slice.far, atFar));
  const double windowBefore = hasGap ? windowDepth(camera, before) * sign : -kInfinity;
  float windowNear = 0.0f;
  if (hasBefore) {
    windowNear = block.partitions[i - 1].interval.w;
  } else {
    const double atNear = windowDepth(camera, slice.near);
    windowNear = static_cast<float>(std::max(atNear * sign - windowQuantum(camera, slice.near, atNear), windowBefore));
  }
  out.interval = vec4(glm::vec2(glm::dvec2(viewNear, viewFar)), windowNear, static_cast<float>(windowFar));
  block.viewStart[i / 4][i % 4] = out.interval.x;
  block.windowStart[i / 4][i % 4] = windowNear;
  out.axis = block.viewPlane;
  out.left = out.right = vec4(0.0f, 0.0f, 0.0f, 1.0f);
  // The band that padSlices gave the next map; one too short for float32 is none.
  const double band = hasAfter ? blend * (slice.far - slice.near) : 0.0, perBand = band > 0.0 ? 1.0 / band : 0.0;
  out.layer.y = static_cast<float>(slice.far - band);
  out.layer.z = perBand < kNever ? static_cast<float>(perBand) : 0.0f;
  const auto end = static_cast<float>(viewFar);
  out.range = vec4(static_cast<float>(viewNear), hasAfter ? end : std::nextafter(end, kNever), 0.0f, 0.0f);  // the last is closed
}

// A plane of view space for points relative to the origin.
vec4 planeFromOrigin(const Region& region, const Plane& vs, const glm::dvec3& originWs) noexcept {
  const glm::dvec3 normalWs = region.worldFromView * vs.normal;
  return vec4(glm::dvec4(normalWs, vs.offset - glm::dot(normalWs, region.eyeWs - originWs)));
}

float bound(double x) noexcept { return static_cast<float>(std::clamp(x, -static_cast<double>(kNever), static_cast<double>(kNever))); }

// What a wedge serves; selection by depth never finds it.
void writeWedge(const Region& region, const Wedge& wedge, const glm::dvec3& originWs, GnomonPartition& out) noexcept {
  const auto side = [&](const Plane& vs) {
    return vs.normal == glm::dvec3(0.0) ? vec4(0.0f, 0.0f, 0.0f, 1.0f) : planeFromOrigin(region, vs, originWs);
  };
  out.axis = planeFromOrigin(region, wedge.axis, originWs);
  out.left = side(wedge.left);
  out.right = side(wedge.right);
  out.range = vec4(bound(wedge.start), bound(wedge.end), 0.0f, 0.0f);
  out.interval = vec4(kNever);
}

// Which cell a point lies in. The rule stands only where float32 finds each start close to its row: shaders then correct by one comparison.
void writeRows(const Region& region, const Rows& rows, const glm::dvec3& originWs, GnomonBlock& block) noexcept {
  block.rowAlong = planeFromOrigin(region, rows.along, originWs);
  block.rowAcross = planeFromOrigin(region, rows.across, originWs);
  int cells = 0;
  for (int i = 0; i < rows.count; ++i) {
    const Rows::Row& row = rows.rows[i];
    const float start = i > 0 ? bound(row.start) : -kNever;
    constexpr double kColumns = 32.0;  // more than a row has, and a power of two: both numbers stay exact
    block.rowStart[i / 4][i % 4] = start;
    block.rows[i] =
        vec4(bound(row.left), bound(1.0 / row.columnWidth), start, static_cast<float>(row.first + (row.columns - 1) / kColumns));
    cells = row.first + row.columns;
  }
  for (int c = 0; c < cells; ++c)
    if (rows.cells[c] >= 0) block.rowCells[c / 4] ^= (255u ^ static_cast<unsigned>(rows.cells[c])) << (8 * (c % 4));
  vec4& rule = block.rowRule;
  rule.x = static_cast<float>(rows.count - 1);
  const double atOrigin = 1.0 - rows.slope * rows.from;
  if (!(rows.growth > 0.0 && rows.slope > 0.0 && std::isfinite(atOrigin))) return;
  constexpr double kLogOfTwo = 0.6931471805599453;
  rule.y = bound(rows.slope);
  rule.z = bound(atOrigin);
  const float perOctave = bound(kLogOfTwo / rows.growth);
  for (int i = 1; i < rows.count; ++i) {
    constexpr float kClose = 0.02f;  // rows: the shader's slack of 0.05 allows for it
    const float row = std::log2(std::max(rule.y * block.rows[i].z + rule.z, 1.0f)) * perOctave;
    if (!(std::abs(row - static_cast<float>(i)) <= kClose)) return;
  }
  rule.w = perOctave;
}

}  // namespace

void clearBlock(GnomonBlock& block) noexcept {
  block.info = uvec4(0u, 0u, static_cast<unsigned>(GNOMON_LAYOUT_VERSION), 0u);
  block.atlas = vec4(1.0f);
  block.origin = block.originRest = block.viewPlane = block.bias = vec4(0.0f);
  block.lightDirection = vec4(0.0f, -1.0f, 0.0f, 0.0f);
  block.depthRule = vec4(1.0f, 0.0f, 0.0f, 0.0f);
  for (int i = 0; i < 4; ++i) block.windowStart[i] = block.viewStart[i] = block.rowStart[i] = vec4(kNever);
  block.rowAlong = block.rowAcross = vec4(0.0f);
  block.rowRule = vec4(0.0f, 0.0f, 0.0f, -1.0f);
  block.rowCells = uvec4(~0u);
  for (vec4& row : block.rows) row = vec4(0.0f, 0.0f, kNever, 0.0f);
}

glm::dmat4 atlasMatrix(const Frame& frame, const glm::dmat4& clipFromWorld, const glm::ivec4& viewport, const glm::ivec2& atlas) noexcept {
  const double flip = frame.shadowMap.style == ClipStyle::direct3d ? -0.5 : 0.5;
  const glm::dvec2 perAtlas = 1.0 / glm::dvec2(atlas), size = glm::dvec2(viewport.z, viewport.w) * perAtlas;
  const glm::dvec2 centre = glm::dvec2(viewport.x, viewport.y) * perAtlas + 0.5 * size;
  const bool isHalved = frame.shadowMap.depth == DepthConvention::negativeOneToOne;
  glm::dmat4 out;
  for (int c = 0; c < 4; ++c) {
    const glm::dvec4& clip = clipFromWorld[c];
    out[c] = {clip.x * (0.5 * size.x) + clip.w * centre.x, clip.y * (flip * size.y) + clip.w * centre.y,
              isHalved ? 0.5 * (clip.z + clip.w) : clip.z, clip.w};
  }
  return out;
}

bool writeBlock(const Frame& frame, const Region& region, const LightSpace& light, const Splits& slices, bool byViewDepth,
                const glm::dmat4* clipFromWorld, Solution& solution) noexcept {
  GnomonBlock& block = solution.block;
  const Camera& camera = region.camera;
  const int count = solution.partitionCount;
  clearBlock(block);
  const auto flags = (byViewDepth ? GNOMON_FLAG_VIEW_DEPTH : 0u) | (solution.depthClamp ? GNOMON_FLAG_DEPTH_CLAMP : 0u);
  block.info =
      uvec4(static_cast<unsigned>(count), flags, static_cast<unsigned>(GNOMON_LAYOUT_VERSION), static_cast<unsigned>(solution.layers));
  const glm::dvec2 atlas(solution.atlas), perAtlas = 1.0 / atlas;
  block.atlas = vec4(glm::dvec4(atlas, perAtlas));
  const glm::vec3 origin(solution.originWs);
  block.origin = vec4(origin, 0.0f);
  block.originRest = vec4(glm::vec3(solution.originWs - glm::dvec3(origin)), 0.0f);
  block.lightDirection = vec4(glm::vec3(light.directionWs), 0.0f);
  const glm::dvec3 forward = region.worldFromView[2];
  block.viewPlane = vec4(glm::dvec4(forward, -glm::dot(forward, region.eyeWs - solution.originWs)));
  const double sign = camera.depth == DepthConvention::reversedZeroToOne ? -1.0 : 1.0;
  const double fadeFrom = region.far - frame.fade * (region.far - region.near);
  block.depthRule = vec4(glm::dvec4(sign, fadeFrom, region.far, region.far > fadeFrom ? 1.0 / (region.far - fadeFrom) : 0.0));
  block.bias = vec4(glm::dvec4(frame.bias.slope, frame.bias.constant, 0.0, 0.0));

  if (slices.rows.count > 0) writeRows(region, slices.rows, solution.originWs, block);
  bool isFine = isFiniteVector(block.origin) && isFiniteVector(block.viewPlane) && isFiniteVector(block.depthRule) &&
                isFiniteVector(block.rowAlong) && isFiniteVector(block.rowAcross);
  for (int i = 0; i < slices.rows.count; ++i)
    isFine = isFine && std::isfinite(block.rows[i].x) && std::isfinite(block.rows[i].y) && std::isfinite(block.rows[i].z);
  for (int i = 0; i < count; ++i) {
    Partition& map = solution.partitions[i];
    GnomonPartition& out = block.partitions[i];
    out.clipFromWorld = map.clipFromWorld;
    out.atlasFromWorld = mat4(atlasMatrix(frame, clipFromWorld[i], map.viewport, solution.atlas));
    out.viewport = vec4(map.viewport);
    const glm::dvec2 least = glm::dvec2(map.viewport.x, map.viewport.y) * perAtlas,
                     size = glm::dvec2(map.viewport.z, map.viewport.w) * perAtlas;
    out.uvBounds = vec4(glm::dvec4(least, least + size));
    out.layer = vec4(static_cast<float>(map.layer), 0.0f, 0.0f, 0.0f);
    if (slices.isWedged) {
      writeWedge(region, slices.wedges[i], solution.originWs, out);
      isFine = isFine && isFiniteVector(out.axis) && isFiniteVector(out.left) && isFiniteVector(out.right);
    } else {
      writeInterval(slices, i, count, camera, sign, frame.margin.blend, block);
    }
    isFine = isFine && isFiniteMatrix(out.clipFromWorld) && std::isfinite(map.error.extent);  // atlasFromWorld's numbers are no larger
  }
  return isFine;
}

}  // namespace gnomon
