#include "support.h"

#include "gnomon/error.h"
#include "gnomon/lloyd.h"
#include "gnomon/lspsm.h"
#include "gnomon/sdsm.h"

namespace gnomon::test {
namespace {

TEST(Error, InfiniteWhereTheMapHasNoArea) {
  const TexelError flat = texelSize(glm::mat4(0.0f), {0, 0, 16, 16}, {0, -1, 0});
  EXPECT_EQ(flat.s, kInfinity);
  EXPECT_EQ(flat.extent, kInfinity);
}

// A map of 8 x 4 world units over 16 x 16 texels, light straight down: edges 0.5 and 0.25, longest stretch 0.5.
TEST(Error, PlainMap) {
  glm::mat4 clip(0.0f);
  clip[0][0] = 2.0f / 8.0f;
  clip[2][1] = 2.0f / 4.0f;
  clip[1][2] = -0.01f;
  clip[3][3] = 1.0f;
  const TexelError texel = texelSize(clip, {0, 0, 16, 16}, {0, -1, 0});
  EXPECT_NEAR(texel.s, 0.5, 1e-12);
  EXPECT_NEAR(texel.t, 0.25, 1e-12);
  EXPECT_NEAR(texel.extent, 0.5, 1e-12);
}

// Sheared by 45 degrees: s = x, t = x + z in texels of 1. Inverse Jacobian columns: edge s (1, -1), edge t (0, 1).
// Largest singular value of [[1, 0], [-1, 1]]: the golden ratio.
TEST(Error, ShearedMap) {
  glm::mat4 clip(0.0f);
  clip[0][0] = 2.0f / 16.0f;
  clip[0][1] = 2.0f / 16.0f;
  clip[2][1] = 2.0f / 16.0f;
  clip[3][3] = 1.0f;
  const TexelError texel = texelSize(clip, {0, 0, 16, 16}, {0, -1, 0});
  EXPECT_NEAR(texel.s, std::sqrt(2.0), 1e-12);
  EXPECT_NEAR(texel.t, 1.0, 1e-12);
  EXPECT_NEAR(texel.extent, (1.0 + std::sqrt(5.0)) / 2.0, 1e-12);
}

TEST(Error, AgreesWithDifferencesOfEmittedMatrices) {
  Random random(51);
  for (int i = 0; i < 300; ++i) {
    Frame frame = usualFrame();
    frame.camera.forwardWs = random.direction();
    frame.light.directionWs = random.direction();
    const auto solution = solve(frame, {.split = {}, .fit = static_cast<FitMode>(i % 3)});
    for (int k = 0; k < solution->partitionCount; ++k) {
      const Partition& map = solution->partitions[k];
      const TexelError texel = texelSize(map.clipFromWorld, map.viewport, glm::normalize(frame.light.directionWs));
      const glm::dvec2 measured = measuredTexel(map, viewPoint(frame.camera, 0.3, 0.6, map.far), frame.light.directionWs, map.far);
      EXPECT_NEAR(texel.s / measured.x, 1.0, 1e-6);
      EXPECT_NEAR(texel.t / measured.y, 1.0, 1e-6);
      EXPECT_GE(texel.extent, std::max(texel.s, texel.t) * (1.0 - 1e-12));
    }
  }
}

TEST(Error, CertificateIsPerPixelAndInflatedByAMillionth) {
  const TexelError certified = certify({3.0, 2.0, 4.0}, 0.5);
  EXPECT_NEAR(certified.s, 6.0 * (1.0 + 1e-6), 1e-12);
  EXPECT_NEAR(certified.t, 4.0 * (1.0 + 1e-6), 1e-12);
  EXPECT_NEAR(certified.extent, 8.0 * (1.0 + 1e-6), 1e-12);
}

// Texel edges and longest stretch at a point, over the pixel's width: by central differences of the emitted matrix, the stretch by the
// eigenvalues of the inverse Jacobian's square.
glm::dvec3 measuredError(const Frame& frame, const Partition& map, const glm::dvec3& rel, double z) {
  const glm::dvec3 d = glm::normalize(frame.light.directionWs),
                   a = glm::normalize(glm::cross(d, std::abs(d.x) < 0.6 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 0, 1))), b = glm::cross(d, a);
  const double pixel = pixelAt(frame, z), step = pixel;
  const auto texels = [&](const glm::dvec3& p) {
    const glm::dvec4 q = glm::dmat4(map.clipFromWorld) * glm::dvec4(p, 1.0);
    return glm::dvec2(q) / q.w * glm::dvec2(map.viewport.z, map.viewport.w) / 2.0;
  };
  const glm::dvec2 da = (texels(rel + a * step) - texels(rel - a * step)) / (2.0 * step),
                   db = (texels(rel + b * step) - texels(rel - b * step)) / (2.0 * step);
  const glm::dmat2 world = glm::inverse(glm::dmat2(da, db));  // from texels
  const double ss = glm::dot(world[0], world[0]), tt = glm::dot(world[1], world[1]), st = glm::dot(world[0], world[1]);
  return glm::dvec3(std::sqrt(ss), std::sqrt(tt), std::sqrt((ss + tt) / 2.0 + std::hypot((ss - tt) / 2.0, st))) / pixel;
}

// The certificate holds at every point that a map serves, of every method and warp, in views up to 150 degrees wide, densely sampled; of
// slices, whose corners are sampled too, it is no more than rounding above.
TEST(Error, CertificateHoldsInside) {
  Random random(91);
  auto solution = std::make_unique<Solution>();
  double above = 0.0;
  for (int k = 0; k < 300; ++k) {
    Frame frame;
    frame.camera = perspective({0, 0, 0}, random.direction(), random.direction(), random.uniform(0.3, 2.6), random.uniform(0.5, 2.5), 0.1,
                               0.1 * random.logUniform(2.0, 1000.0));
    frame.light.directionWs = random.direction();
    frame.budget.partitions = 1 + random.index(6);
    Samples samples;
    samples.near = frame.camera.near * 1.1;
    samples.far = frame.camera.far * 0.9;
    const Warp warp = static_cast<Warp>(k % 6);
    const double eta = random.uniform(-1.0, 1.0);
    const int method = k / 6 % 8;
    SdsmState state;
    if (k % 5 == 0) {  // overhead, where warps are strongest
      frame.camera.forwardWs = {0.0, 0.0, -1.0};
      frame.camera.upWs = {0.0, 1.0, 0.0};
      frame.light.directionWs = {0.0, -1.0, 0.0};
    }
    if (method == 0) (void)solvePssm(frame, {.fit = static_cast<FitMode>(k % 3)}, *solution);
    if (method == 1) frame.samples = &samples, (void)solveSdsm(frame, {}, state, *solution);
    if (method == 2) (void)solveLspsm(frame, {.rows = {.rule = k % 2 ? RowRule::error : RowRule::fitted}, .warp = {warp, eta}}, *solution);
    if (method > 2) (void)solveLloyd(frame, {.scheme = static_cast<LloydScheme>(method - 3), .warp = {warp, eta}}, *solution);
    ASSERT_EQ(solution->status, Status::ok) << k;
    for (int i = 0; i < solution->partitionCount; ++i) {
      const Partition& map = solution->partitions[i];
      glm::dvec3 most(0.0);
      for (int p = 0; p < 800; ++p) {
        const bool isCorner = p < 8;
        const double share = isCorner ? p / 4 : random.uniform(), z = map.near * std::pow(map.far / map.near, share);
        const glm::dvec3 rel = viewPoint(frame.camera, isCorner ? p % 2 : random.uniform(), isCorner ? p / 2 % 2 : random.uniform(), z);
        bool isServed = true;
        for (int side = 0; side < map.planeCount; ++side)
          isServed = isServed && glm::dot(glm::dvec3(map.planes[side]), rel) + map.planes[side].w >= 0.0;
        if (isServed) most = glm::max(most, measuredError(frame, map, rel, z));
      }
      const glm::dvec3 certified(map.error.s, map.error.t, map.error.extent);
      for (int c = 0; c < 3; ++c) {
        EXPECT_LE(most[c], certified[c] * (1.0 + 1e-6)) << k << " " << i << " " << c;
        if (map.planeCount == 0) above = std::max(above, certified[c] / most[c] - 1.0);
      }
    }
  }
  EXPECT_LE(above, 1e-4);
}

// The overhead light of [Lloyd 2006, appendix C]: S_optimum = ln(f/n) / (2 tan theta), for any aspect 1.
TEST(Error, LimitOverheadIsLloydsOptimum) {
  Frame frame;
  frame.camera = perspective({0, 0, 0}, {0, 0, -1}, {0, 1, 0}, kPi / 3.0, 1.0, 1.0, 1000.0);
  frame.light.directionWs = {0, -1, 0};
  frame.image = {1080, 1080};
  EXPECT_NEAR(solve(frame)->limitTexels / (1080.0 * 1080.0), std::log(1000.0) / (2.0 * std::tan(kPi / 6.0)), 1e-9);
}

// Of an orthographic view: its projection's area in pixels, |l_x| h d + |l_y| w d + |l_z| w h.
TEST(Error, LimitOfAnOrthographicViewIsItsShadow) {
  Frame frame;
  frame.camera = orthographic({1, 2, 3}, {0, 0, -1}, {0, 1, 0}, 10.0, 2.0, -5.0, 25.0);
  frame.image = {200, 100};
  frame.light.directionWs = {-2.0, -3.0, 6.0};  // length 7
  EXPECT_NEAR(solve(frame)->limitTexels, (2.0 * 10.0 * 30.0 + 3.0 * 20.0 * 30.0 + 6.0 * 20.0 * 10.0) / 7.0 * 100.0, 1e-6);
}

// A flat ground h below a level camera, light straight down: every point of it counts, from depth h / t on:
// the integral of 2 a t z / (2 t z / H)^2 is a H^2 ln(f / z) / 2t.
TEST(Error, LimitOfAFlatGround) {
  Frame frame = usualFrame();
  frame.camera = perspective({0, 2, 0}, {0, 0, -1}, {0, 1, 0}, kPi / 3.0, 1.5, 0.1, 500.0);
  frame.light.directionWs = {0, -1, 0};
  const Box ground{{-1e4, 0, -1e4}, {1e4, 0, 1e4}};
  frame.scene.receivers = {&ground, 1};
  const double t = std::tan(kPi / 6.0), height = frame.image.height;
  const double expected = 1.5 * height * height * std::log(500.0 / (2.0 / t)) / (2.0 * t);
  EXPECT_NEAR(solve(frame)->limitTexels / expected, 1.0, 1e-11);
}

// A view of any kind, cut by half-spaces and perhaps a box, all near what it sees.
struct CutView {
  Frame frame;
  std::vector<glm::dvec4> planes;
  Box box{};

  CutView(Random& random, int k, int cuts, bool hasBox) {
    const double near = random.logUniform(0.01, 10.0), far = near * random.logUniform(2.0, 1e3);
    const glm::dvec3 eye = random.direction() * near, forward = random.direction();
    frame.camera = k % 4 == 3
                       ? orthographic(eye, forward, random.direction(), far * 0.6, 1.3, -0.2 * far, 0.8 * far)
                       : perspective(eye, forward, random.direction(), random.uniform(0.3, 2.0), random.uniform(0.5, 2.0), near, far);
    if (k % 4 == 1) frame.camera.left *= random.uniform(-0.9, 1.5);
    frame.light.directionWs = k % 5 == 0 ? forward : random.direction();
    for (int i = 0; i < cuts; ++i) {
      const glm::dvec3 normal = random.direction();
      planes.emplace_back(normal, -glm::dot(normal, inside(random)));
    }
    if (hasBox) {
      const glm::dvec3 a = inside(random), b = inside(random);
      box = {glm::min(a, b), glm::max(a, b)};
      frame.scene.receivers = {&box, 1};
    }
    frame.scene.planes = planes;
  }
  CutView(const CutView&) = delete;

  glm::dvec3 inside(Random& random) const {
    const Camera& c = frame.camera;
    const double z = c.near > 0.0 ? random.logUniform(c.near, c.far) : random.uniform(c.near, c.far);
    return c.positionWs + viewPoint(c, random.uniform(), random.uniform(), z);
  }
};

// The definition, over a log-polar grid of light rays around the eye: each clipped to every half-space of the region.
double integrateLimit(const Frame& frame) {
  const Camera& c = frame.camera;
  const Axes axes(c);
  const bool isPerspective = c.projection == Projection::perspective;
  std::vector<glm::dvec4> halves;  // from the eye
  const auto add = [&](const glm::dvec3& n, double w) { halves.emplace_back(n, w); };
  const double slope = isPerspective ? 1.0 : 0.0, flat = 1.0 - slope;
  add(axes.right + axes.forward * (c.left * slope), c.left * flat);
  add(-axes.right + axes.forward * (c.right * slope), c.right * flat);
  add(axes.up + axes.forward * (c.down * slope), c.down * flat);
  add(-axes.up + axes.forward * (c.up * slope), c.up * flat);
  add(axes.forward, -c.near);
  add(-axes.forward, c.far);
  for (const glm::dvec4& p : frame.scene.planes) add(glm::dvec3(p), p.w + glm::dot(glm::dvec3(p), c.positionWs));
  for (const Box& box : frame.scene.receivers)
    for (int i = 0; i < 3; ++i) {
      glm::dvec3 n(0.0);
      n[i] = 1.0;
      add(n, c.positionWs[i] - box.minWs[i]);
      add(-n, box.maxWs[i] - c.positionWs[i]);
    }
  const glm::dvec3 l = glm::normalize(frame.light.directionWs);
  const glm::dvec3 x = glm::normalize(glm::cross(l, std::abs(l.x) < 0.6 ? glm::dvec3(1, 0, 0) : glm::dvec3(0, 0, 1))), y = glm::cross(l, x);
  const double reach = c.far * 10.0, least = (isPerspective ? c.near : c.far) * 1e-3;
  constexpr int kRings = 700, kSpokes = 700;
  const double step = std::log(reach / least) / kRings, turn = 2.0 * kPi / kSpokes, lz = glm::dot(l, axes.forward);
  double sum = 0.0;
  for (int i = 0; i < kRings; ++i) {
    const double radius = least * std::exp((i + 0.5) * step);
    for (int k = 0; k < kSpokes; ++k) {
      const double angle = (k + 0.5) * turn;
      const glm::dvec3 q = (x * std::cos(angle) + y * std::sin(angle)) * radius;
      double from = -kInfinity, to = kInfinity;
      for (const glm::dvec4& half : halves) {
        const double d = glm::dot(glm::dvec3(half), q) + half.w, along = glm::dot(glm::dvec3(half), l);
        if (along > 0.0)
          from = std::max(from, -d / along);
        else if (along < 0.0)
          to = std::min(to, -d / along);
        else if (d < 0.0)
          to = -kInfinity;
      }
      if (!(to > from)) continue;
      const double z = glm::dot(axes.forward, q) + (lz >= 0.0 ? from : to) * lz, pixel = pixelAt(frame, z);
      sum += radius * radius / (pixel * pixel);
    }
  }
  return sum * step * turn;
}

// Regions of every kind against the definition.
TEST(Error, LimitIsTheIntegralOverTheLightPlane) {
  Random random(53);
  int count = 0;
  for (int k = 0; k < 24; ++k) {
    const CutView view(random, k, k % 3, k % 2 == 0);
    const double expected = integrateLimit(view.frame), limit = solve(view.frame)->limitTexels;
    if (!(expected > 0.02 * view.frame.image.height * view.frame.image.height)) continue;  // too few rays hit it
    ++count;
    EXPECT_NEAR(limit / expected, 1.0, 0.01) << k;
  }
  EXPECT_GT(count, 12);
}

// A plane that holds the light's direction splits no light ray: the two sides' limits add up to the whole.
TEST(Error, LimitsAcrossAPlaneAlongTheLightAddUp) {
  Random random(54);
  int count = 0;
  for (int k = 0; k < 2000; ++k) {
    CutView view(random, k, k % 4, k % 3 != 0);
    const double whole = solve(view.frame)->limitTexels;
    const glm::dvec3 normal = glm::normalize(glm::cross(view.frame.light.directionWs, random.direction()));
    const glm::dvec4 plane(normal, -glm::dot(normal, view.inside(random)));
    double sum = 0.0;
    view.planes.push_back(plane);
    for (const double side : {1.0, -1.0}) {
      view.planes.back() = plane * side;
      view.frame.scene.planes = view.planes;
      sum += solve(view.frame)->limitTexels;
    }
    EXPECT_NEAR(sum, whole, 1e-12 * whole) << k;
    count += whole > 0.0;
  }
  EXPECT_GT(count, 1000);
}

// The camera's own corners take the way of a cut region: the closed form again.
TEST(Error, LimitOfCutsThatDoNothingIsTheClosedForm) {
  Random random(55);
  for (int k = 0; k < 500; ++k) {
    CutView view(random, k, 0, false);
    Frame& frame = view.frame;
    const double closed = solve(frame)->limitTexels;
    std::vector<glm::dvec3> corners;
    for (int i = 0; i < 8; ++i)
      corners.push_back(frame.camera.positionWs +
                        viewPoint(frame.camera, i & 1, (i >> 1) & 1, (i & 4) ? frame.camera.far : frame.camera.near));
    frame.cornersWs = corners;
    EXPECT_NEAR(solve(frame)->limitTexels / closed, 1.0, 1e-12) << k;
  }
}

// Next to nothing of depth, or of a difference in it: the two ways of evaluation meet, and neither cancels.
TEST(Error, LimitOfAThinSliceIsItsAreaInPixels) {
  for (const double thickness : {1e-1, 1.1e-2, 1e-2, 9e-3, 1e-3, 1e-6, 1e-9, 1e-12})
    for (const double scale : {1e-6, 1.0, 1e6}) {
      // Light along the image: through the side of a slice of square section, z from 1 to 1 + thickness: the integral of
      // 2 t z / (2 t z / H)^2 dz is H^2 ln(1 + thickness) / 2t.
      Frame frame = usualFrame();
      frame.camera = perspective({0, 0, 0}, {0, 0, -1}, {0, 1, 0}, kPi / 2.0, 1.0, 0.5 * scale, 100.0 * scale);
      frame.light.directionWs = {0, -1, 0};
      const std::vector<glm::dvec4> planes{{0, 0, -1, -1.0 * scale}, {0, 0, 1, scale * (1.0 + thickness)}};
      frame.scene.planes = planes;
      const double depth = (1.0 + thickness) - 1.0;  // as rounded
      EXPECT_NEAR(solve(frame)->limitTexels / (frame.image.height * frame.image.height * std::log1p(depth) / 2.0), 1.0,
                  1e-11 + 1e-15 / thickness)
          << thickness << " " << scale;
    }
}

// Of several boxes: no less than any of them needs, no more than all of them, and their sum where their shadows lie apart.
TEST(Error, LimitOfSeveralBoxesIsABound) {
  Random random(56);
  for (int k = 0; k < 200; ++k) {
    Frame frame = usualFrame();
    frame.light.directionWs = random.direction();
    std::vector<Box> boxes;
    double most = 0.0, sum = 0.0;
    for (int i = 0; i < 2 + k; ++i) {
      const glm::dvec3 at = frame.camera.positionWs + viewPoint(frame.camera, random.uniform(), random.uniform(), random.logUniform(1, 90));
      boxes.push_back({at, at + random.uniform(0.0, 3.0)});
      frame.scene.receivers = {&boxes.back(), 1};
      const double alone = solve(frame)->limitTexels;
      most = std::max(most, alone);
      sum += alone;
    }
    frame.scene.receivers = boxes;
    const double limit = solve(frame)->limitTexels;
    EXPECT_GE(limit, most * (1.0 - 1e-12)) << k;
    EXPECT_LE(limit, sum * (1.0 + 1e-12)) << k;
  }
  // Side by side under a light from above.
  Frame frame = usualFrame();
  frame.camera = perspective({0, 0, 0}, {0, 0, -1}, {0, 1, 0}, kPi / 2.0, 1.0, 1.0, 100.0);
  frame.light.directionWs = {0, -1, 0};
  const std::vector<Box> row{{{-3, -1, -9}, {-2, 1, -8}}, {{-2, -1, -9}, {-1, 1, -8}}, {{1, 0, -9}, {2, 1, -8}}};
  double sum = 0.0;
  for (const Box& box : row) {
    frame.scene.receivers = {&box, 1};
    sum += solve(frame)->limitTexels;
  }
  frame.scene.receivers = row;
  EXPECT_NEAR(solve(frame)->limitTexels / sum, 1.0, 1e-12);
}

// No solution needs fewer texels than the limit, of whole views, cut ones and several boxes.
TEST(Error, NothingBeatsTheLimit) {
  Random random(52);
  for (int i = 0; i < 1500; ++i) {
    CutView view(random, i, i % 2 == 0 ? 0 : i % 3, i % 6 == 1);
    std::vector<Box> boxes;
    for (int k = 0; i % 6 == 3 && k < 5; ++k) {
      const glm::dvec3 a = view.inside(random), b = view.inside(random);
      boxes.push_back({glm::min(a, b), glm::max(a, b)});
      view.frame.scene.receivers = boxes;
    }
    view.frame.budget.partitions = 1 + random.index(16);
    Solution solution;
    const Status status = i % 2 == 0
                              ? solvePssm(view.frame, {}, solution)
                              : solveLloyd(view.frame, {.scheme = LloydScheme::best, .split = {}, .warp = {.warp = Warp::least}}, solution);
    ASSERT_EQ(status, Status::ok);
    EXPECT_TRUE(solution.limitTexels > 0.0 || i % 2 != 0);
    EXPECT_GE(solution.neededTexels, solution.limitTexels) << i;
  }
}

// Receivers at the eye of a view smaller than the rounding of its position: the planes of their sides hold all of its near face.
TEST(Error, NothingBeatsTheLimitOfAViewBelowRounding) {
  Frame frame;
  frame.camera = perspective({3796602.5570814111, -43321039.673282042, 4725135.6157634584},
                             {0.98332577639841567, -0.17583533245462288, 0.046393462158209609},
                             {-0.48017780657331244, -0.73139889077164033, -0.48423644705087687}, kPi / 3.0, 16.0 / 9.0,
                             3.1722048166990687e-11, 4.451970458690896e-07);
  frame.light.directionWs = {-2.5377772445717498e-05, -8.012494870618446e-05, 0.99984409049082268};
  const Box eye{frame.camera.positionWs, frame.camera.positionWs};
  frame.scene.receivers = {&eye, 1};
  Solution solution;
  ASSERT_EQ(solvePssm(frame, {}, solution), Status::ok);
  ASSERT_EQ(solution.partitionCount, 1);
  EXPECT_LE(solution.limitTexels, solution.neededTexels);
}

TEST(Error, CostOfAMapAndOfAllOfThem) {
  Solution solution;
  solution.partitionCount = 2;
  solution.partitions[0].viewport = {0, 0, 10, 20};
  solution.partitions[0].error = {2.0, 3.0, 4.0};
  solution.partitions[1].viewport = {10, 0, 5, 2};
  solution.partitions[1].error = {1.0, 0.5, 1.5};
  solution.maxError = 3.0;
  solution.neededTexels = 2.0 * 3.0 * 200.0 + 0.5 * 10.0;
  const TexelCost first = texelCost(solution.partitions[0], {30.0, 20.0}), whole = texelCost(solution, {30.0, 20.0});
  EXPECT_EQ(first.extent, 4.0);
  EXPECT_EQ(first.needed, 1200.0);
  EXPECT_EQ(first.spent, 1800.0);
  EXPECT_EQ(first.storageFactor, 2.0);
  EXPECT_EQ(whole.extent, 4.0);
  EXPECT_EQ(whole.needed, 1205.0);
  EXPECT_EQ(whole.spent, 210.0 * 9.0);
  EXPECT_NEAR(whole.storageFactor, 1205.0 / 600.0, 1e-12);
}

// The greatest ratio of two maps' texels over points that both serve, by differences of their matrices.
double measuredRatio(const Frame& frame, const Solution& solution, int a, int b, const glm::dvec3& point, double z) {
  const auto widest = [&](int map) {
    const glm::dvec2 texel = measuredTexel(solution.partitions[map], point, frame.light.directionWs, 1e-3 * z);
    return std::max(texel.x, texel.y);
  };
  const double ratio = widest(a) / widest(b);
  return std::max(ratio, 1.0 / ratio);
}

// Between slices: a grid over the seam, its corners included, finds the same.
TEST(Error, SeamsBetweenSlices) {
  Random random(57);
  for (int k = 0; k < 40; ++k) {
    Frame frame = usualFrame();
    frame.light.directionWs = random.direction();
    Solution solution;
    ASSERT_EQ(
        solveLloyd(frame, {.scheme = k % 2 ? LloydScheme::zpw : LloydScheme::zp, .split = {}, .warp = {.warp = Warp::least}}, solution),
        Status::ok);
    for (int i = 0; i + 1 < solution.partitionCount; ++i) {
      const double z = solution.partitions[i].far;
      double most = 0.0;
      for (int p = 0; p < 21 * 21; ++p)
        most = std::max(most, measuredRatio(frame, solution, i, i + 1, viewPoint(frame.camera, p % 21 / 20.0, p / 21 / 20.0, z), z));
      EXPECT_NEAR(seamJump(frame, solution, i, i + 1) / most, 1.0, 0.02) << k << " " << i;
      EXPECT_NEAR(seamJump(frame, solution, i + 1, i) / seamJump(frame, solution, i, i + 1), 1.0, 1e-12);
      if (i + 2 < solution.partitionCount) {
        EXPECT_EQ(seamJump(frame, solution, i, i + 2), 0.0);
      }
    }
    EXPECT_EQ(seamJump(frame, solution, 0, solution.partitionCount), 0.0);
  }
}

// Between faces and their rows: no point on a map's plane that another map serves too sees a greater jump.
TEST(Error, SeamsBetweenFaces) {
  Random random(58);
  int found = 0;
  for (int k = 0; k < 20; ++k) {
    Frame frame = usualFrame();
    frame.light.directionWs = random.direction();
    frame.budget.partitions = 10;
    Solution solution;
    ASSERT_EQ(solveLloyd(frame, {.scheme = LloydScheme::fpzpw, .split = {}}, solution), Status::ok);
    for (int n = 0; n < 2000; ++n) {
      const int a = random.index(solution.partitionCount);
      if (solution.partitions[a].planeCount == 0) continue;
      const glm::dvec4 plane = solution.partitions[a].planes[random.index(solution.partitions[a].planeCount)];
      // Along a ray of the view to the plane.
      const glm::dvec3 way = viewPoint(frame.camera, random.uniform(), random.uniform(), 1.0);
      const double z = -(glm::dot(glm::dvec3(plane), frame.camera.positionWs) + plane.w) / glm::dot(glm::dvec3(plane), way);
      if (!(z >= frame.camera.near && z <= frame.camera.far)) continue;
      const glm::dvec3 ws = frame.camera.positionWs + way * z;
      const auto serves = [&](const Partition& map) {
        bool isServed = true;
        for (int p = 0; p < map.planeCount; ++p)
          isServed = isServed && glm::dot(glm::dvec3(map.planes[p]), ws) + map.planes[p].w >= -1e-9 * z;
        return isServed;
      };
      if (!serves(solution.partitions[a])) continue;
      for (int b = 0; b < solution.partitionCount; ++b) {
        if (b == a || !serves(solution.partitions[b])) continue;
        ++found;
        EXPECT_LE(measuredRatio(frame, solution, a, b, way * z, z), seamJump(frame, solution, a, b) * 1.05) << k << " " << a << " " << b;
      }
    }
  }
  EXPECT_GT(found, 1000);
}

}  // namespace
}  // namespace gnomon::test
