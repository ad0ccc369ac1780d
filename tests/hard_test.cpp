// A soak of every method over views, lights and scenes where shadow code is known to fail. Each case is a seed: on a failure the seed is
// printed, and GNOMON_SOAK_SEED=<seed> GNOMON_SOAK=1 runs that case alone. GNOMON_SOAK: cases for each method.
#include "support.h"

#include <cstdlib>
#include <limits>
#include <sstream>
#include <string>

namespace gnomon::test {
namespace {

const double kNan = std::numeric_limits<double>::quiet_NaN();

std::uint64_t numberOf(const char* variable, std::uint64_t otherwise) {
  const char* text = std::getenv(variable);
  return text ? std::strtoull(text, nullptr, 10) : otherwise;
}

// A frame and all that it points to.
struct Case {
  Frame frame;
  std::vector<Box> receivers, casters;
  std::vector<glm::dvec4> planes;
  Samples samples;
  std::vector<std::uint32_t> histogram;
  std::vector<double> weights;
  std::vector<SampleBounds> bounds;
  std::vector<glm::dvec3> cloud;  // what was sampled, relative to the eye
  std::vector<Camera> eyes;  // whose views the corners enclose
  glm::dvec3 cornersWs[8];
  double near = 0.0, far = 0.0;  // of what is shadowed
  bool isPoisoned = false;
  bool isFromDepths = false;  // samples are depth values: shaders compare those, so that a quantum is not known
  bool mayBeSnapped = false;  // a snapped map needs two texels a side
  std::string families;
  bool is(Random& random, int oneIn, const char* family) {
    if (random.index(oneIn) != 0) return false;
    families += std::string(" ") + family;
    return true;
  }
};

void makeCamera(Random& random, Case& c) {
  Camera& camera = c.frame.camera;
  const double scale = c.is(random, 4, "scaled") ? random.logUniform(1e-9, 1e9) : 1.0;
  glm::dvec3 position = glm::dvec3(random.uniform(-10, 10), random.uniform(-10, 10), random.uniform(-10, 10)) * scale;
  if (c.is(random, 6, "moved")) position += random.direction() * random.logUniform(1e4, 1e9) * (random.index(2) ? 1.0 : scale);
  glm::dvec3 forward = random.direction(), up = random.direction();
  if (c.is(random, 6, "axis-forward")) forward = glm::dvec3(0), forward[random.index(3)] = random.index(2) ? 1.0 : -1.0;
  if (c.is(random, 6, "axis-up")) {
    up = glm::dvec3(0);
    up[random.index(3)] = random.index(2) ? 1.0 : -1.0;
    if (std::abs(glm::dot(up, forward)) > 0.999) up = {up.y, up.z, up.x};
  }
  if (c.is(random, 20, "up-along-forward")) up = forward + random.direction() * random.logUniform(1e-6, 1e-2);
  const double near = scale * random.logUniform(0.01, 1.0);
  const double ratio = c.is(random, 6, "thin")   ? 1.0 + random.logUniform(1e-4, 1e-1)
                       : c.is(random, 6, "deep") ? random.logUniform(1e4, 1e9)
                                                 : random.logUniform(2.0, 1e4);
  const double far = near * ratio, aspect = c.is(random, 6, "aspect") ? random.logUniform(0.05, 20.0) : 16.0 / 9.0;
  if (c.is(random, 4, "orthographic")) {
    const int side = random.index(3);
    camera = orthographic(position, forward, up, far * random.logUniform(0.01, 2.0), aspect,
                          side == 0   ? -far
                          : side == 1 ? 0.0
                                      : near,
                          far);
  } else {
    const double fov = c.is(random, 4, "fov") ? (random.index(2) ? random.logUniform(0.5, 5.0) : random.uniform(120.0, 175.0)) : 60.0;
    camera = perspective(position, forward, up, fov * kPi / 180.0, aspect, near, far);
  }
  if (c.is(random, 5, "off-axis")) {
    double* const sides[] = {&camera.left, &camera.right, &camera.down, &camera.up};
    const int k = random.index(4);
    double &side = *sides[k], &other = *sides[k ^ 1];
    const double share = random.index(3) == 0 ? 0.0 : random.uniform(-0.999, 3.0);
    side = other * share;
    if (random.index(2) == 0) std::swap(side, other);
  }
  if (camera.projection == Projection::perspective && c.is(random, 12, "infinite-far")) {
    camera.shadowDistance = camera.far;
    camera.far = kInfinity;
  } else if (c.is(random, 8, "shadow-distance")) {
    camera.shadowDistance = camera.near + (camera.far - camera.near) * random.uniform(0.01, 2.0);
  }
  if (camera.projection == Projection::orthographic) c.near = camera.near;
  c.near = camera.near;
  c.far = std::min(camera.far, camera.shadowDistance);
  camera.depth = static_cast<DepthConvention>(random.index(3));
}

// A headset: two cameras beside the one that the solve is given, canted, whose views its corners enclose.
void makeEyes(Random& random, Case& c) {
  Camera& camera = c.frame.camera;
  if (c.is(random, 8, "eyes") && camera.far < kInfinity && camera.projection == Projection::perspective) {
    const Axes axes(camera);
    const double apart = camera.near * random.logUniform(1e-3, 10.0), cant = random.index(2) ? random.uniform(-0.2, 0.2) : 0.0;
    for (const double side : {-1.0, 1.0}) {
      Camera eye = camera;
      eye.positionWs += axes.right * (apart * side);
      eye.forwardWs = axes.forward * std::cos(cant) + axes.right * (side * std::sin(cant));
      eye.upWs = axes.up;
      c.eyes.push_back(eye);
    }
    enclose(c.eyes, camera, c.cornersWs);
    c.frame.cornersWs = c.cornersWs;
  }
}

void makeLight(Random& random, Case& c) {
  const Axes axes(c.frame.camera);
  glm::dvec3 axis = random.direction();
  if (c.is(random, 2, "light")) {
    const int k = random.index(6);
    axis = k == 0 ? axes.forward : k == 1 ? axes.up : k == 2 ? axes.right : glm::dvec3(k == 3, k == 4, k == 5);
    if (random.index(2)) axis = -axis;
    if (random.index(3)) axis += random.direction() * random.logUniform(1e-15, 1e-3);
  }
  c.frame.light.directionWs = axis * (random.index(3) ? 1.0 : random.logUniform(1e-6, 1e6));
}

void makeScene(Random& random, Case& c) {
  const Axes axes(c.frame.camera);
  const glm::dvec3 eye = c.frame.camera.positionWs;
  const double size = std::max(std::abs(c.near), std::abs(c.far));
  const auto boxAt = [&](double z, double half) {
    const glm::dvec3 centre = eye + viewPoint(c.frame.camera, random.uniform(-0.2, 1.2), random.uniform(-0.2, 1.2), z),
                     extent = glm::abs(random.direction() * half);
    return Box{centre - extent, centre + extent};
  };
  const bool isRatio = c.frame.camera.projection == Projection::perspective;
  const auto depth = [&] { return isRatio ? random.logUniform(c.near, c.far) : random.uniform(c.near, c.far); };
  if (c.is(random, 2, "receivers")) {
    const int kind = random.index(8);
    static const char* const names[] = {"few", "flat", "point", "behind", "enclosing", "touching", "hundreds", "line"};
    c.families += std::string(":") + names[kind];
    const int count = kind == 6 ? 100 + random.index(300) : 1 + random.index(5);
    for (int i = 0; i < count; ++i) {
      const double z = depth();
      Box box = boxAt(z, (isRatio ? z : size) * random.logUniform(1e-4, 1.0));
      const int axis = random.index(3);
      if (kind == 1) box.minWs[axis] = box.maxWs[axis];
      if (kind == 2) box.maxWs = box.minWs;
      if (kind == 3 && i % 2 == 0) box = boxAt(-z, z * 0.5);
      if (kind == 4) box = {eye - glm::dvec3(size * random.logUniform(0.1, 1e3)), eye + glm::dvec3(size * random.logUniform(0.1, 1e3))};
      if (kind == 5)
        box.minWs[axis] = (eye + axes.forward * (random.index(2) ? c.near : c.far))[axis],
        box.maxWs[axis] = std::max(box.maxWs[axis], box.minWs[axis]);
      if (kind == 7) box.maxWs[axis] = box.minWs[axis], box.maxWs[(axis + 1) % 3] = box.minWs[(axis + 1) % 3];
      c.receivers.push_back(box);
    }
  }
  if (c.is(random, 4, "planes"))
    for (int i = 0, n = random.index(8) == 0 ? 40 : 1 + random.index(3); i < n; ++i) {
      glm::dvec3 normal = random.direction();
      if (random.index(3) == 0) normal = random.index(2) ? axes.forward : axes.up;
      normal *= random.index(2) ? 1.0 : random.logUniform(1e-6, 1e6);
      const glm::dvec3 through = eye + viewPoint(c.frame.camera, random.uniform(), random.uniform(), random.index(4) ? depth() : c.near);
      c.planes.emplace_back(normal, -glm::dot(normal, through));
    }
  if (c.is(random, 3, "casters"))
    for (int i = 0, n = 1 + random.index(3); i < n; ++i) {
      const int kind = random.index(3);
      c.casters.push_back(kind == 0   ? boxAt(depth(), size * 0.1)
                          : kind == 1 ? Box{eye - glm::dvec3(size * 1e6), eye + glm::dvec3(size * 1e6)}
                                      : boxAt(depth(), size * 1e-9));
    }
}

void makeBudget(Random& random, Case& c) {
  Frame& frame = c.frame;
  frame.shadowMap.depth = static_cast<DepthConvention>(random.index(3));
  frame.shadowMap.style = static_cast<ClipStyle>(random.index(3));
  frame.shadowMap.layout = static_cast<MapLayout>(random.index(2));
  frame.budget.partitions = c.is(random, 5, "one-map") ? 1 : c.is(random, 5, "sixteen") ? 16 : 1 + random.index(8);
  frame.budget.resolution = c.is(random, 12, "one-texel") ? 1 : 1 << (2 + random.index(11));
  if (c.is(random, 5, "texels")) frame.budget.texels = random.logUniform(16.0, 1e8);
  if (c.is(random, 8, "odd-atlas")) frame.budget.atlas = {1 + random.index(5000), 1 + random.index(5000)};
  if (c.is(random, 4, "margins")) {
    frame.margin.filter = random.uniform(0.0, 5.0);
    frame.margin.normalOffset = random.uniform(0.0, 3.0);
    frame.margin.border = random.index(9);
  }
  if (c.is(random, 4, "blend")) frame.margin.blend = random.index(4) ? random.uniform(0.0, 0.5) : 0.999;
  if (c.is(random, 8, "motion"))
    for (double& motion : frame.margin.motion) motion = std::abs(c.far) * random.logUniform(1e-6, 1.0);
  if (c.is(random, 8, "image")) frame.image = {random.logUniform(1.0, 16384.0), random.logUniform(1.0, 16384.0)};
  frame.budget.targetError = random.logUniform(0.01, 100.0);
  frame.fade = random.index(2) ? 0.0 : random.uniform();
}

// Samples of a cloud of points of the view; bounds as lightForSamples() lays them out.
void makeSamples(Random& random, Case& c) {
  const Camera& camera = c.frame.camera;
  const double x0 = random.uniform(), y0 = random.uniform(), spread = random.index(4) ? random.uniform() : random.logUniform(1e-9, 1.0);
  const bool isRatio = camera.projection == Projection::perspective;
  const auto mixDepth = [&](double share) {
    return isRatio ? c.near * std::pow(c.far / c.near, share) : c.near + (c.far - c.near) * share;
  };
  double from = random.index(4) ? random.uniform() : 0.0, to = random.index(4) ? random.uniform() : 1.0;
  if (random.index(8) == 0) to = from;
  std::vector<double> depths;
  const int count = random.index(6) ? 1 + random.index(100) : 1;
  for (int i = 0; i < count; ++i) {
    const double z = std::clamp(mixDepth(from + (to - from) * random.uniform()), c.near, c.far);
    const double x = std::clamp(x0 + spread * random.uniform(-1.0, 1.0), 0.0, 1.0),
                 y = std::clamp(y0 + spread * random.uniform(-1.0, 1.0), 0.0, 1.0);
    c.cloud.push_back(viewPoint(camera, x, y, z));
    depths.push_back(z);
    c.samples.near = std::min(c.samples.near, z);
    c.samples.far = std::max(c.samples.far, z);
  }
  if (c.samples.near > 0.0 && random.index(3)) {
    c.histogram.assign(static_cast<std::size_t>(1 + random.index(600)), 0u);
    const double perLog = 1.0 / std::max(std::log(c.samples.far / c.samples.near), 1e-300);
    for (const double z : depths) {
      const double share = std::log(z / c.samples.near) * perLog, bins = static_cast<double>(c.histogram.size());
      for (const double nudge : {-1e-9, 1e-9})  // what lies at a border counts on both sides
        ++c.histogram[std::min(static_cast<std::size_t>(std::max(share * bins + nudge * bins, 0.0)), c.histogram.size() - 1)];
    }
    c.samples.histogram = c.histogram;
    if (random.index(4) == 0) {
      for (std::size_t i = 0; i < c.histogram.size(); ++i) c.weights.push_back(random.index(3) ? random.logUniform(1e-3, 1e3) : 0.0);
      c.samples.weights = c.weights;
    }
  }
  if (random.index(3)) {
    glm::dmat3 lsFromView;
    if (lightForSamples(c.frame, lsFromView) != Status::ok) return;
    const Axes axes(camera);
    const int parts = 1 + random.index(16);
    for (int i = 0; i < parts; ++i) {
      const auto edge = [&](int k) {
        const double a = c.samples.near, b = c.samples.far, share = static_cast<double>(k) / parts;
        return k == parts ? b : isRatio ? a * std::pow(b / a, share) : a + (b - a) * share;
      };
      SampleBounds part{edge(i), std::max(edge(i + 1), edge(i)), glm::dvec2(kInfinity), glm::dvec2(-kInfinity)};
      for (std::size_t p = 0; p < depths.size(); ++p) {
        const double slack = 1e-9 * std::abs(depths[p]);
        if (!(depths[p] >= part.near - slack && depths[p] <= part.far + slack)) continue;
        const glm::dvec3 q = c.cloud[p];
        const glm::dvec2 ls(lsFromView * glm::dvec3(glm::dot(q, axes.right), glm::dot(q, axes.up), glm::dot(q, axes.forward)));
        part.least = glm::min(part.least, ls);
        part.most = glm::max(part.most, ls);
      }
      if (part.least.x <= part.most.x) c.bounds.push_back(part);
    }
    c.samples.bounds = c.bounds;
  }
  if (random.index(4) == 0) c.samples.latency = std::abs(c.far) * random.logUniform(1e-9, 1.0);
}

// One field of the input: subnormal, huge, infinite or NaN.
void poison(Random& random, Case& c) {
  Frame& f = c.frame;
  std::vector<double*> fields{&f.camera.positionWs.x,
                              &f.camera.positionWs.z,
                              &f.camera.forwardWs.x,
                              &f.camera.forwardWs.y,
                              &f.camera.upWs.y,
                              &f.camera.upWs.z,
                              &f.camera.left,
                              &f.camera.right,
                              &f.camera.down,
                              &f.camera.up,
                              &f.camera.near,
                              &f.camera.far,
                              &f.camera.shadowDistance,
                              &f.light.directionWs.x,
                              &f.light.directionWs.y,
                              &f.light.directionWs.z,
                              &f.image.width,
                              &f.image.height,
                              &f.margin.filter,
                              &f.margin.normalOffset,
                              &f.margin.blend,
                              &f.margin.motion[0],
                              &f.budget.texels,
                              &f.budget.targetError,
                              &f.bias.slope,
                              &f.bias.constant,
                              &f.fade,
                              &c.samples.near,
                              &c.samples.far,
                              &c.samples.latency};
  for (Box& box : c.receivers) fields.insert(fields.end(), {&box.minWs.x, &box.maxWs.y});
  for (Box& box : c.casters) fields.insert(fields.end(), {&box.minWs.y, &box.maxWs.z});
  for (glm::dvec4& plane : c.planes) fields.insert(fields.end(), {&plane.x, &plane.w});
  for (double& weight : c.weights) fields.push_back(&weight);
  for (SampleBounds& b : c.bounds) fields.insert(fields.end(), {&b.near, &b.far, &b.least.x, &b.most.y});
  const double values[] = {0.0,  -0.0,  5e-324, -5e-324, 1e-310,  1e-300,    1e-160,     1e-45, 1e38,
                           1e39, 1e160, 1e300,  -1e300,  1.7e308, kInfinity, -kInfinity, kNan};
  for (int i = 0, n = 1 + random.index(2); i < n; ++i) {
    const int k = random.index(static_cast<int>(fields.size()));
    const double value = values[random.index(static_cast<int>(std::size(values)))];
    *fields[static_cast<std::size_t>(k)] = value;
    std::ostringstream text;
    text << " poison" << k << "=" << value;
    c.families += text.str();
  }
  c.isPoisoned = true;
}

void makeCase(Random& random, bool isSampled, Case& c) {
  makeCamera(random, c);
  if (!isSampled) makeEyes(random, c);
  makeLight(random, c);
  makeScene(random, c);
  makeBudget(random, c);
  if (isSampled) makeSamples(random, c);
  c.frame.worldSpace = c.is(random, 12, "world-space");
  if (c.is(random, 10, "poison")) poison(random, c);
  c.frame.scene = {c.receivers, c.casters, c.planes};
  if (isSampled) c.frame.samples = &c.samples;
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

// What went wrong, in words; empty: nothing.
std::string checkPoint(const Case& c, const Solution& solution, const glm::dvec3& wanted, bool isSample) {
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
    const bool isInside = q.w > 0.0 && std::abs(ndc.x) <= 1.0 + slack + lost && std::abs(ndc.y) <= 1.0 + slack + lost &&
                          ndc.z >= lowest - slack - lost && ndc.z <= 1.0 + slack + lost;
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
    const glm::dvec2 texel = texelAt(map, rel, frame.light.directionWs) / pixel;
    if (!(texel.x <= map.error.s * (1.0 + 1e-5) && texel.y <= map.error.t * (1.0 + 1e-5))) {
      wrong << "map " << i << " at depth " << z << " error over predicted: " << texel.x / map.error.s << " " << texel.y / map.error.t
            << " warp " << static_cast<int>(map.warp);
      return wrong.str();
    }
  }
  if (isCovered) return {};
  wrong << (isClaimedAtAll ? "outside its map" : "unclaimed") << " at depth " << z << " of " << camera.near << " to " << far;
  return wrong.str();
}

bool isAllowed(const Case& c, Status status) {
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

std::string verify(const Case& c, const Solution& solution, Random& random) {
  if (solution.status != Status::ok) {
    if (solution.partitionCount != 0 || solution.block.info.x != 0u) return "refused with partitions";
    if (!*statusField(solution.status) || !*statusRule(solution.status)) return "refused without a reason";
    return isAllowed(c, solution.status) ? "" : std::string("refused: ") + statusField(solution.status) + " " + statusRule(solution.status);
  }
  if (!isFinite(solution)) return "not finite";
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

// Runs `solveCase(case, random, solution)` for each seed.
template <typename SolveCase>
void soak(std::uint64_t otherwise, bool isSampled, SolveCase solveCase) {
  const std::uint64_t first = numberOf("GNOMON_SOAK_SEED", 1), count = numberOf("GNOMON_SOAK", otherwise);
  auto solution = std::make_unique<Solution>();
  int failures = 0;
  for (std::uint64_t seed = first; seed < first + count; ++seed) {
    Random random(seed * 0xd6e8feb86659fd93ULL);  // unrelated streams: the generator's own increment would give the same one, shifted
    Case c;
    makeCase(random, isSampled, c);
    const std::string settings = solveCase(c, random, *solution);
    const std::string wrong = verify(c, *solution, random);
    if (wrong.empty()) continue;
    if (++failures <= 200) ADD_FAILURE() << "seed " << seed << ": " << wrong << " | " << settings << " |" << c.families;
  }
}

WarpSettings someWarp(Random& random) { return {.warp = static_cast<Warp>(random.index(6)), .eta = random.uniform(-1.0, 1.0)}; }

TEST(Hard, Pssm) {
  soak(kCases, false, [](Case& c, Random& random, Solution& solution) {
    PssmSettings settings{.split = {.scheme = static_cast<SplitScheme>(random.index(3)), .lambda = random.uniform()},
                          .fit = static_cast<FitMode>(random.index(3))};
    c.mayBeSnapped = settings.fit == FitMode::stable;
    settings.split.automatic = settings.fit != FitMode::stable && random.index(3) == 0;
    (void)solvePssm(c.frame, settings, solution);
    return "fit " + std::to_string(static_cast<int>(settings.fit)) + " split " + std::to_string(static_cast<int>(settings.split.scheme));
  });
}

TEST(Hard, Lloyd) {
  soak(kCases, false, [](Case& c, Random& random, Solution& solution) {
    LloydSettings settings{.scheme = static_cast<LloydScheme>(random.index(6)),
                           .minimax = random.index(4) == 0,
                           .warp = someWarp(random),
                           .shares = static_cast<Shares>(random.index(2)),
                           .nearFace = static_cast<NearFace>(random.index(2)),
                           .rows = random.index(2) == 0};
    settings.split.automatic = random.index(4) == 0;
    (void)solveLloyd(c.frame, settings, solution);
    return "scheme " + std::to_string(static_cast<int>(settings.scheme)) + " warp " + std::to_string(static_cast<int>(settings.warp.warp)) +
           (settings.minimax ? " minimax" : "");
  });
}

TEST(Hard, Lspsm) {
  soak(kCases, false, [](Case& c, Random& random, Solution& solution) {
    const LspsmSettings settings{.rows = {.rule = static_cast<RowRule>(random.index(3)),
                                          .zeta = random.uniform(0.01, 0.49),
                                          .sigma = random.logUniform(1e-2, 1e2),
                                          .maxRows = 1 + random.index(16),
                                          .maxColumns = 1 + random.index(16)},
                                 .warp = someWarp(random)};
    (void)solveLspsm(c.frame, settings, solution);
    return "rule " + std::to_string(static_cast<int>(settings.rows.rule)) + " warp " + std::to_string(static_cast<int>(settings.warp.warp));
  });
}

TEST(Hard, Sdsm) {
  soak(kCases, true, [](Case& c, Random& random, Solution& solution) {
    const SdsmSettings settings{.scheme = static_cast<SdsmScheme>(random.index(4)),
                                .norm = static_cast<SampleNorm>(random.index(3)),
                                .bounds = random.index(4) != 0,
                                .hysteresis = random.index(3) ? 0.0 : random.uniform(),
                                .quantise = random.index(4) == 0,
                                .automatic = random.index(4) == 0};
    SdsmState state;
    c.mayBeSnapped = settings.quantise;
    (void)solveSdsm(c.frame, settings, state, solution);
    return "scheme " + std::to_string(static_cast<int>(settings.scheme)) + (settings.hysteresis > 0.0 ? " held" : "") +
           (settings.quantise ? " doubled" : "") + (settings.bounds ? " bounds" : "") + (settings.automatic ? " automatic" : "");
  });
}

// The second of two frames under one state, whose first saw the same view a little aside.
// A choice may be kept from a frame with another light, and without what is sampled.
std::string solveByAuto(Case& c, Random& random, Solution& solution) {
  AutoSettings settings;
  settings.hasTarget = random.index(4) != 0;
  c.frame.budget.targetError = random.logUniform(1e-2, 1e3);
  AutoState state;
  if (random.index(2) == 0) {
    Frame before = c.frame;
    before.samples = nullptr;
    before.light.directionWs += random.direction() * (0.05 * glm::length(before.light.directionWs));
    (void)solveAuto(before, settings, state, solution);
  }
  (void)solveAuto(c.frame, settings, state, solution);
  return std::string(settings.hasTarget ? "target " : "no target ") + std::to_string(c.frame.budget.targetError);
}
TEST(Hard, Auto) { soak(kCases, false, solveByAuto); }
TEST(Hard, AutoOfSamples) { soak(kCases, true, solveByAuto); }

// What a float depth buffer says: whatever was rendered to a pixel lies in a map.
TEST(Hard, DepthImage) {
  soak(kCases, false, [](Case& c, Random& random, Solution& solution) {
    const Camera& camera = c.frame.camera;
    c.receivers.clear();
    c.planes.clear();
    c.frame.scene = {};
    c.frame.cornersWs = {};
    c.eyes.clear();
    const int width = 1 + random.index(20), height = 1 + random.index(12), gap = random.index(4);
    std::vector<float> depths(static_cast<std::size_t>((width + gap) * height), std::numeric_limits<float>::quiet_NaN());
    const bool isReversed = camera.depth == DepthConvention::reversedZeroToOne,
               isPerspective = camera.projection == Projection::perspective;
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
  });
}

}  // namespace
}  // namespace gnomon::test
