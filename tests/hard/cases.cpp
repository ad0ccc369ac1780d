#include "hard/cases.h"

#include <cstring>
#include <limits>
#include <sstream>

namespace gnomon::test {
namespace {

const double kNan = std::numeric_limits<double>::quiet_NaN();

void makeCamera(Random& random, HardCase& c) {
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
void makeEyes(Random& random, HardCase& c) {
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

void makeLight(Random& random, HardCase& c) {
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

void makeScene(Random& random, HardCase& c) {
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

void makeBudget(Random& random, HardCase& c) {
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
void makeSamples(Random& random, HardCase& c) {
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
        const double slack = std::max(depthQuantum(camera, depths[p]), viewQuantum(camera, depths[p]));  // counts on both sides
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
void poison(Random& random, HardCase& c) {
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

}  // namespace

void makeHardCase(Random& random, bool isSampled, HardCase& c) {
  makeCamera(random, c);
  if (!isSampled) makeEyes(random, c);
  makeLight(random, c);
  makeScene(random, c);
  makeBudget(random, c);
  if (isSampled) makeSamples(random, c);
  c.frame.worldSpace = c.is(random, 12, "world-space");
  if (c.is(random, 10, "poison")) poison(random, c);
  attach(c);
  if (isSampled) c.frame.samples = &c.samples;
}
void attach(HardCase& c) {
  c.frame.scene = {c.receivers, c.casters, c.planes};
  if (!c.eyes.empty()) c.frame.cornersWs = c.cornersWs;
  c.samples.histogram = c.histogram;
  c.samples.weights = c.weights;
  c.samples.bounds = c.bounds;
  if (c.frame.samples) c.frame.samples = &c.samples;
}

namespace {

WarpSettings someWarp(Random& random) { return {.warp = static_cast<Warp>(random.index(6)), .eta = random.uniform(-1.0, 1.0)}; }

std::string solveByPssm(HardCase& c, Random& random, Solution& solution) {
  PssmSettings settings{.split = {.scheme = static_cast<SplitScheme>(random.index(3)), .lambda = random.uniform()},
                        .fit = static_cast<FitMode>(random.index(3))};
  c.mayBeSnapped = settings.fit == FitMode::stable;
  settings.split.automatic = settings.fit != FitMode::stable && random.index(3) == 0;
  (void)solvePssm(c.frame, settings, solution);
  return "fit " + std::to_string(static_cast<int>(settings.fit)) + " split " + std::to_string(static_cast<int>(settings.split.scheme));
}

std::string solveByLloyd(HardCase& c, Random& random, Solution& solution) {
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
}

std::string solveByLspsm(HardCase& c, Random& random, Solution& solution) {
  const LspsmSettings settings{.rows = {.rule = static_cast<RowRule>(random.index(3)),
                                        .zeta = random.uniform(0.01, 0.49),
                                        .sigma = random.logUniform(1e-2, 1e2),
                                        .maxRows = 1 + random.index(16),
                                        .maxColumns = 1 + random.index(16)},
                               .warp = someWarp(random)};
  (void)solveLspsm(c.frame, settings, solution);
  return "rule " + std::to_string(static_cast<int>(settings.rows.rule)) + " warp " + std::to_string(static_cast<int>(settings.warp.warp));
}

std::string solveBySdsm(HardCase& c, Random& random, Solution& solution) {
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
}

// The second of two frames under one state, whose first saw the same view a little aside.
// A choice may be kept from a frame with another light, and without what is sampled.
std::string solveByAuto(HardCase& c, Random& random, Solution& solution) {
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
}  // namespace

const HardMethod kHardMethods[kHardMethodCount] = {{"Pssm", false, solveByPssm},   {"Lloyd", false, solveByLloyd},
                                                   {"Lspsm", false, solveByLspsm}, {"Sdsm", true, solveBySdsm},
                                                   {"Auto", false, solveByAuto},   {"AutoOfSamples", true, solveByAuto}};

std::uint64_t hashOf(const Solution& solution) {
  std::uint64_t hash = 0xcbf29ce484222325ULL;  // FNV-1a
  const auto add = [&](const auto& value) {
    unsigned char bytes[sizeof value];
    std::memcpy(bytes, &value, sizeof value);
    for (const unsigned char byte : bytes) hash = (hash ^ byte) * 0x100000001b3ULL;
  };
  add(solution.status), add(solution.refusedIndex), add(solution.warnings), add(solution.originWs), add(solution.partitionCount);
  add(solution.atlas), add(solution.layers), add(solution.depthClamp), add(solution.maxError), add(solution.neededTexels);
  add(solution.storageFactor), add(solution.limitTexels), add(solution.block);
  for (int i = 0; i < solution.partitionCount; ++i) {
    const Partition& map = solution.partitions[i];
    add(map.near), add(map.far), add(map.clipFromWorld), add(map.viewport), add(map.layer), add(map.warp);
    add(map.error.s), add(map.error.t), add(map.error.extent);
    for (int p = 0; p < map.planeCount; ++p) add(map.planes[p]);
    for (int p = 0; p < map.cullPlaneCount; ++p) add(map.cullPlanes[p]);
  }
  return hash;
}

}  // namespace gnomon::test
