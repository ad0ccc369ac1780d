#include "parity.h"

namespace gnomon::test {

double windowReference(const Camera& camera, double z) {
  const double n = camera.near, f = camera.far;
  const bool isReversed = camera.depth == DepthConvention::reversedZeroToOne;
  if (camera.projection == Projection::orthographic) return isReversed ? (f - z) / (f - n) : (z - n) / (f - n);
  if (!std::isfinite(f)) return isReversed ? n / z : 1.0 - n / z;
  return isReversed ? n / (f - n) * (f / z - 1.0) : f / (f - n) * (1.0 - n / z);
}

double floatStep(double x) {
  const float magnitude = std::abs(static_cast<float>(x));
  return static_cast<double>(std::nextafter(magnitude, std::numeric_limits<float>::infinity())) - magnitude;
}

namespace {

// How far the window depth may widen an interval where no partition adjoins: four float steps of the depth's terms.
double windowPad(const Camera& camera, double z) {
  constexpr double kSteps = 4.0 * 0x1p-23;
  if (camera.projection == Projection::orthographic || camera.depth != DepthConvention::reversedZeroToOne) return kSteps;
  return kSteps * (windowReference(camera, z) + (std::isfinite(camera.far) ? camera.near / (camera.far - camera.near) : 0.0));
}

// The same in view depth, by the closed forms' slope.
double viewPad(const Camera& camera, double z) {
  constexpr double kSteps = 4.0 * 0x1p-23;
  const double n = camera.near, f = camera.far,
               reach = std::abs(z) + (camera.projection == Projection::perspective ? 2.0 * std::abs(z) : 50.0);
  const double slope = camera.projection == Projection::orthographic ? 1.0 / (f - n) : (std::isfinite(f) ? n * f / (f - n) : n) / (z * z);
  return windowPad(camera, z) / slope + kSteps * reach;
}

// The partition that serves a depth, in double: intervals are half-open where the next one begins. `depth` rises away from the eye.
int servedAt(const Solution& solution, double depth, const std::function<double(double)>& ofView,
             const std::function<double(double)>& padAt) {
  const double tolerance = 4.0 * floatStep(depth);
  for (int i = 0; i < solution.partitionCount; ++i) {
    const Partition& map = solution.partitions[i];
    const double from = ofView(map.near), to = ofView(map.far);
    const bool isJoinedBefore = i > 0 && solution.partitions[i - 1].far == map.near;
    const bool isJoinedAfter = i + 1 < solution.partitionCount && solution.partitions[i + 1].near == map.far;
    if (std::abs(depth - from) <= tolerance || std::abs(depth - to) <= tolerance) return kMayDiffer;
    if (!isJoinedBefore && depth < from && depth >= from - padAt(map.near) - tolerance) return kMayDiffer;
    if (!isJoinedAfter && depth > to && depth <= to + padAt(map.far) + tolerance) return kMayDiffer;
    if (depth >= from && depth < to) return i;
  }
  return -1;
}

}  // namespace

int servedAtWindow(const Frame& frame, const Solution& solution, double windowDepth) {
  const double sign = frame.camera.depth == DepthConvention::reversedZeroToOne ? -1.0 : 1.0;
  return servedAt(
      solution, sign * windowDepth, [&](double z) { return sign * windowReference(frame.camera, z); },
      [&](double z) { return windowPad(frame.camera, z); });
}

int servedAtView(const Frame& frame, const Solution& solution, double z) {
  return servedAt(
      solution, z, [](double view) { return view; }, [&](double view) { return viewPad(frame.camera, view); });
}

std::vector<Setting> allSettings(const std::vector<Box>& gapped) {
  const std::array<DepthConvention, 3> depths{DepthConvention::negativeOneToOne, DepthConvention::zeroToOne,
                                              DepthConvention::reversedZeroToOne};
  const std::array<FitMode, 3> fits{FitMode::tight, FitMode::slice, FitMode::stable};
  const std::array<ClipStyle, 3> styles{ClipStyle::openGl, ClipStyle::vulkan, ClipStyle::direct3d};
  const std::array<glm::dvec3, 3> lights{glm::dvec3(0.3, -0.8, 0.2), glm::dvec3(-0.7, -0.4, 0.9), glm::dvec3(0.1, -0.3, -1.0)};
  const std::array<int, 3> counts{1, 4, 16};
  const std::array<const char*, 5> names{"symmetric", "asymmetric", "infinite", "orthographic", "receivers with a gap"};
  std::vector<Setting> out;
  for (std::size_t view = 0; view < 5; ++view)
    for (std::size_t d = 0; d < 3; ++d)
      for (std::size_t c = 0; c < 3; ++c) {
        Setting setting;
        Frame& frame = setting.frame;
        frame = usualFrame();
        if (view == 1) {
          frame.camera.left *= 0.3;
          frame.camera.up *= 1.4;
          frame.camera.down *= -0.1;  // the horizon is outside
        } else if (view == 2) {
          frame.camera.far = kInfinity;
          frame.camera.shadowDistance = 250.0;
        } else if (view == 3) {
          frame.camera = orthographic(frame.camera.positionWs, frame.camera.forwardWs, frame.camera.upWs, 20.0, 1.5, -15.0, 80.0);
        } else if (view == 4) {
          frame.camera = perspective({0, 0, 0}, {0, 0, -1}, {0, 1, 0}, 1.0, 1.5, 0.5, 500.0);
          frame.scene.receivers = gapped;
        }
        const std::size_t mapDepth = (d + view + c) % 3, fit = (view + 2 * c + d) % 3, style = (view + c + 2 * d) % 3;
        frame.camera.depth = depths[d];
        frame.shadowMap.depth = depths[mapDepth];
        frame.shadowMap.style = styles[style];
        frame.shadowMap.layout = (d + c) % 2 == 0 ? MapLayout::atlas : MapLayout::layers;
        frame.light.directionWs = lights[(view + d) % 3];
        frame.budget.partitions = counts[c];
        setting.settings.fit = fits[fit];
        setting.settings.split.scheme = SplitScheme::practical;
        setting.name = std::string(names[view]) + ", camera depth " + std::to_string(d) + ", map depth " + std::to_string(mapDepth) +
                       ", fit " + std::to_string(fit) + ", style " + std::to_string(style) + ", " + std::to_string(counts[c]) + " maps";
        out.push_back(setting);
      }
  return out;
}

std::vector<glm::vec4> pointsInMaps(Random& random, const Frame& frame, const Solution& solution, int count) {
  std::vector<glm::vec4> points;
  for (int i = 0; i < count; ++i) {
    const int k = random.index(solution.partitionCount);
    const double z = random.uniform(solution.partitions[k].near, solution.partitions[k].far);
    points.emplace_back(glm::vec3(viewPoint(frame.camera, random.uniform(), random.uniform(), z)), static_cast<float>(k));
  }
  return points;
}

glm::dvec3 texelReference(const Frame& frame, const Partition& map, const glm::dvec3& world) {
  const glm::dvec4 clip = glm::dmat4(map.clipFromWorld) * glm::dvec4(world, 1.0);
  const glm::dvec3 ndc = glm::dvec3(clip) / clip.w;
  const double v = frame.shadowMap.style == ClipStyle::direct3d ? 0.5 - 0.5 * ndc.y : 0.5 + 0.5 * ndc.y;
  return {map.viewport.x + (0.5 + 0.5 * ndc.x) * map.viewport.z, map.viewport.y + v * map.viewport.w,
          frame.shadowMap.depth == DepthConvention::negativeOneToOne ? 0.5 + 0.5 * ndc.z : ndc.z};
}

std::array<glm::dvec3, 2> measuredEdges(const glm::dvec3& light, const std::function<glm::dvec2(const glm::dvec3&)>& texelAt,
                                        const glm::dvec3& world, double step) {
  const glm::dvec3 a = glm::normalize(glm::cross(light, glm::dvec3(0.3, 0.4, 0.8))), b = glm::cross(light, a);
  const glm::dvec2 da = (texelAt(world + a * step) - texelAt(world - a * step)) / (2.0 * step),
                   db = (texelAt(world + b * step) - texelAt(world - b * step)) / (2.0 * step);
  const double det = da.x * db.y - db.x * da.y;
  return {(a * db.y - b * da.y) / det, (b * da.x - a * db.x) / det};
}

std::array<glm::dvec3, 2> measuredEdges(const Frame& frame, const Solution& solution, int k, const glm::dvec3& world) {
  const auto texelAt = [&](const glm::dvec3& at) { return glm::dvec2(atlasPosition(solution.block, k, at)) * glm::dvec2(solution.atlas); };
  return measuredEdges(glm::normalize(frame.light.directionWs), texelAt, world,
                       0.01 * std::max(std::abs(solution.partitions[k].near), 1.0));
}

}  // namespace gnomon::test
