// Pictures against ray tracing: built-in scenes always, outside scenes where GNOMON_EXTRA_DATA has them.
#include <filesystem>

#include "gnomon/lloyd.h"
#include "job.h"
#include "scene.h"
#include "support.h"

namespace gnomon::test {
namespace {

using namespace gnomon::offscreen;
namespace fs = std::filesystem;

struct Judged {
  WrongPixels wrong;
  RenderOutput image;
};

Judged judge(Renderer& renderer, const Mesh& mesh, const Tracer& tracer, Frame frame, int resolution, const PssmSettings& settings = {},
             RenderOptions options = {}) {
  const Box bounds{mesh.min, mesh.max};
  frame.image = {static_cast<double>(options.width), static_cast<double>(options.height)};
  frame.budget.resolution = resolution;
  frame.scene.receivers = {&bounds, 1};
  const auto solution = solve(frame, settings);
  EXPECT_EQ(solution->status, Status::ok) << statusField(solution->status);
  options.time = false;
  Picture picture = makePicture(renderer, tracer, frame, *solution, options);
  return {picture.wrong, std::move(picture.image)};
}

// More texels, fewer wrong pixels; what is wrong lies at shadow edges: no acne, no leaks, no lost casters.
TEST(Job, WrongPixelsFallWithResolutionOnBuiltInScenes) {
  for (const std::string& name : builtInNames()) {
    const BuiltIn scene = makeBuiltIn(name);
    Renderer renderer;
    renderer.load(scene.mesh);
    const Tracer tracer(scene.mesh);
    EXPECT_GE(scene.views.size(), 2u);
    for (const View& view : scene.views) {
      Frame frame;
      frame.camera = view.cam;
      frame.light.directionWs = view.lightDirectionWs;
      double last = 1.0;
      for (const int resolution : {512, 1024, 2048, 4096}) {
        const WrongPixels wrong = judge(renderer, scene.mesh, tracer, frame, resolution).wrong;
        EXPECT_LT(wrong.share(), last) << name << " " << view.light << " " << resolution;
        last = wrong.share();
        if (resolution != 2048) continue;
        EXPECT_LT(wrong.share(), 0.025) << name << " " << view.light;
        EXPECT_LE(wrong.farShare(), 1.0 / 3.0) << name << " " << view.light;
        EXPECT_GT(wrong.edge, 500u) << name;
      }
    }
  }
}

// Warped maps and faces: no acne (their stored depth varies with w, which the bias must know: without, nine wrong pixels in ten lie away from
// any edge), no leaks, no lost casters.
TEST(Job, WarpedMapsShadowWhatPlainOnesDo) {
  for (const std::string& name : builtInNames()) {
    const BuiltIn scene = makeBuiltIn(name);
    Renderer renderer;
    renderer.load(scene.mesh);
    const Tracer tracer(scene.mesh);
    const Box bounds{scene.mesh.min, scene.mesh.max};
    for (const View& view : scene.views) {
      Frame frame;
      frame.camera = view.cam;
      frame.light.directionWs = view.lightDirectionWs;
      frame.image = {1280.0, 720.0};
      frame.scene.receivers = {&bounds, 1};
      RenderOptions options;
      options.time = false;
      const auto wrongOf = [&](LloydScheme scheme, Warp warp, int maps) {
        frame.budget = {.partitions = maps, .resolution = 1024};
        auto solution = std::make_unique<Solution>();
        EXPECT_EQ(solveLloyd(frame, {.scheme = scheme, .split = {}, .warp = {.warp = warp}}, *solution), Status::ok);
        return makePicture(renderer, tracer, frame, *solution, options).wrong;
      };
      const WrongPixels plain = wrongOf(LloydScheme::zp, Warp::none, 6), warped = wrongOf(LloydScheme::zpw, Warp::least, 6);
      EXPECT_LE(warped.farShare(), 1.0 / 3.0) << name << " " << view.light;
      EXPECT_LE(warped.share(), plain.share() * 1.3) << name << " " << view.light;
      const WrongPixels rows = wrongOf(LloydScheme::fpzpw, Warp::lispsm, 16);
      EXPECT_LE(rows.farShare(), 0.4) << name << " " << view.light;
      EXPECT_LE(rows.share(), plain.share() * 2.5) << name << " " << view.light;  // faces pay late; with acne it would be ten times
    }
  }
}

// Every convention of camera and shadow map, every fit and layout, selection by view depth, both languages: the same shadows.
TEST(Job, EveryConventionGivesTheSameShadows) {
  const BuiltIn scene = makeBuiltIn("colonnade");
  const Tracer tracer(scene.mesh);
  const RenderOptions small{.width = 320, .height = 180};
  for (const std::string version : {"330 core", "450"}) {
    Renderer renderer(defaultBackend(), version);
    renderer.load(scene.mesh);
    const auto share = [&](const Frame& frame, const PssmSettings& settings, const RenderOptions& options) {
      return judge(renderer, scene.mesh, tracer, frame, 1024, settings, options).wrong.share();
    };
    Frame plain;
    plain.camera = scene.views[0].cam;
    plain.light.directionWs = scene.views[0].lightDirectionWs;
    const double reference = share(plain, {}, small);
    EXPECT_LT(reference, 0.02);
    const double most = 1.5 * reference + 1e-3;
    for (const DepthConvention depth :
         {DepthConvention::negativeOneToOne, DepthConvention::zeroToOne, DepthConvention::reversedZeroToOne}) {
      Frame frame = plain;
      frame.camera.depth = depth;
      EXPECT_LT(share(frame, {}, small), most);
      frame = plain;
      frame.shadowMap.depth = depth;
      for (const ClipStyle style : {ClipStyle::openGl, ClipStyle::vulkan, ClipStyle::direct3d}) {
        frame.shadowMap.style = style;
        EXPECT_LT(share(frame, {}, small), most) << static_cast<int>(depth) << static_cast<int>(style);
      }
    }
    Frame infinite = plain;
    infinite.camera.shadowDistance = infinite.camera.far;
    infinite.camera.far = kInfinity;
    EXPECT_LT(share(infinite, {}, small), most);
    Frame layered = plain;
    layered.shadowMap.layout = MapLayout::layers;
    EXPECT_LT(share(layered, {}, small), 2.0 * most);
    Frame world = plain;
    world.worldSpace = true;
    EXPECT_LT(share(world, {}, small), most);
    RenderOptions byView = small;
    byView.selectByViewDepth = true;
    EXPECT_LT(share(plain, {}, byView), most);
    for (const FitMode fit : {FitMode::slice, FitMode::stable}) EXPECT_LT(share(plain, {.split = {}, .fit = fit}, small), 4.0 * most);
    Frame off = plain;  // asymmetric
    off.camera.left *= 0.4;
    off.camera.up *= 1.3;
    EXPECT_LT(share(off, {}, small), 2.0 * most);
    Frame filtered = plain;
    filtered.margin.filter = 2.0;
    for (const Filter filter : {Filter::box3x3, Filter::tent}) {
      RenderOptions soft = small;
      soft.filter = filter;
      EXPECT_LT(share(filtered, {}, soft), 3.0 * most);
    }
  }
}

// The ways of drawing the maps give the same shadows but for the rasteriser's rounding of other viewports.
TEST(Job, EveryWayOfCastingGivesTheSameShadows) {
  const BuiltIn scene = makeBuiltIn("hall");
  const Tracer tracer(scene.mesh);
  Renderer renderer;
  renderer.load(scene.mesh);
  for (const MapLayout layout : {MapLayout::atlas, MapLayout::layers}) {
    Frame frame;
    frame.camera = scene.views[0].cam;
    frame.light.directionWs = scene.views[0].lightDirectionWs;
    frame.shadowMap.layout = layout;
    RenderOptions options{.width = 320, .height = 180};
    const std::vector<std::uint8_t> reference = judge(renderer, scene.mesh, tracer, frame, 1024, {}, options).image.lit;
    for (const CastPath path : {CastPath::fragmentDepth, layout == MapLayout::atlas ? CastPath::wholeAtlas : CastPath::layers}) {
      options.castPath = path;
      const std::vector<std::uint8_t> lit = judge(renderer, scene.mesh, tracer, frame, 1024, {}, options).image.lit;
      int different = 0;
      for (std::size_t i = 0; i < lit.size(); ++i) different += lit[i] != reference[i];
      EXPECT_LT(different, 320 * 180 / 1000) << static_cast<int>(path);
    }
  }
}

TEST(Job, BothContextsDrawTheSame) {
  const BuiltIn scene = makeBuiltIn("hall");
  const Tracer tracer(scene.mesh);
  Frame frame;
  frame.camera = scene.views[0].cam;
  frame.light.directionWs = scene.views[0].lightDirectionWs;
  const RenderOptions small{.width = 320, .height = 180};
  std::vector<std::uint8_t> first;
  for (const Backend backend : {Backend::osmesa, Backend::egl}) {
    Renderer renderer(backend);
    renderer.load(scene.mesh);
    const Judged judged = judge(renderer, scene.mesh, tracer, frame, 512, {}, small);
    if (first.empty()) first = judged.image.lit;
    EXPECT_EQ(judged.image.lit, first);
  }
}

// A refused or empty solution draws a lit picture, never a black one.
TEST(Job, NothingToShadowIsLit) {
  const BuiltIn scene = makeBuiltIn("hall");
  Renderer renderer;
  renderer.load(scene.mesh);
  Frame frame;
  frame.camera = scene.views[0].cam;
  frame.light.directionWs = glm::dvec3(0.0);
  const auto refused = solve(frame);
  ASSERT_EQ(refused->status, Status::lightDirection);
  const RenderOutput image = renderer.render(frame, *refused, {.width = 160, .height = 90});
  EXPECT_EQ(std::count(image.lit.begin(), image.lit.end(), 0), 0);
  EXPECT_GT(std::count(image.lit.begin(), image.lit.end(), 1), 1000);
}

// The published limits, on scenes that stay outside the repository.
TEST(Job, OutsideScenesStayWithinTheirLimits) {
  const fs::path scenes = fs::path(GNOMON_EXTRA_DATA) / "scenes";
  if (std::string(GNOMON_EXTRA_DATA).empty() || !fs::exists(scenes)) GTEST_SKIP() << "GNOMON_EXTRA_DATA has no scenes";
  struct Outside {
    const char* name;
    glm::dvec3 eye, target;
    double near, far, most;
    glm::dvec3 lights[2];
  };
  const Outside all[] = {{"sponza", {11, 3.2, 0.3}, {-12, 4.5, -0.3}, 0.8, 31, 0.015, {{0.2, -1, 0.15}, {-0.5, -1, -0.3}}},
                         {"columns", {100, 10, -8}, {-400, 0, 0}, 11, 915, 0.003, {{0.5, -0.7, 0.3}, {0.9, -0.4, -0.1}}},
                         {"chess", {-200, 150, 200}, {0, 0, 0}, 192, 450, 0.02, {{0.4, -0.8, 0.3}, {-0.6, -0.5, -0.6}}},
                         {"terrain", {-14000, 1500, -15000}, {0, 400, 0}, 1380, 42340, 0.025, {{0.7, -0.25, 0.5}, {-0.6, -0.35, 0.3}}}};
  for (const Outside& outside : all) {
    const fs::path file = scenes / outside.name / (std::string(outside.name) + ".glb");
    if (!fs::exists(file)) continue;
    const Mesh mesh = loadGlb(file.string());
    Renderer renderer;
    renderer.load(mesh);
    const Tracer tracer(mesh);
    for (const glm::dvec3& light : outside.lights) {
      Frame frame;
      frame.camera = perspective(outside.eye, outside.target - outside.eye, {0, 1, 0}, kPi / 3.0, 16.0 / 9.0, outside.near, outside.far);
      frame.light.directionWs = light;
      double last = 1.0;
      for (const int resolution : {512, 1024, 2048, 4096}) {
        const WrongPixels wrong = judge(renderer, mesh, tracer, frame, resolution).wrong;
        EXPECT_LT(wrong.share(), last) << outside.name << " " << resolution;
        last = wrong.share();
        if (resolution != 2048) continue;
        EXPECT_LE(wrong.share(), outside.most) << outside.name;
        EXPECT_LE(wrong.farShare(), 1.0 / 3.0) << outside.name;
      }
    }
  }
}

}  // namespace
}  // namespace gnomon::test
