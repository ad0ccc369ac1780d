// The shaders, run by the driver on points in a float texture, against the C++ functions and against formulas in double written here.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <functional>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include "shader.h"
#include "support.h"

namespace gnomon::test {
namespace {

using namespace gnomon::offscreen;

constexpr int kWidth = 512;  // points to a row

const char* const kVertex =
    "void main() { vec2 p = vec2((gl_VertexID << 1) & 2, gl_VertexID & 2); gl_Position = vec4(p * 2.0 - 1.0, 0.0, 1.0); }\n";

// Patterns of texels that the test can work out too.
const char* const kPattern = R"(
float gnomonCompare(int map, vec2 uv, float layer, float depth) {
  ivec2 texel = ivec2(floor(uv * gnomon.atlas.xy));
  return float((texel.x * 7 + texel.y * 3 + int(layer) * 11 + map * 5) % 8) / 8.0;
}
)";
double pattern(int x, int y, int layer, int map) { return ((x * 7 + y * 3 + layer * 11 + map * 5) % 8) / 8.0; }

// Each pixel reads its point and runs the body, which writes `result`.
std::string fragment(const std::string& hook, const std::string& body) {
  return R"(
#include "gnomon.glsl"
#include "gnomon_cast.glsl"
uniform sampler2D points;
layout(location = 0) out vec4 result;
)" + hook +
         "void main() {\n  vec4 point = texelFetch(points, ivec2(gl_FragCoord.xy), 0);\n  vec3 world = point.xyz;\n  int index = "
         "int(point.w);\n" +
         body + "}\n";
}

class Gpu {
 public:
  explicit Gpu(std::string version) : context_(createContext(defaultBackend(), 4, 5)), version_(std::move(version)) {
    gl::load(*context_);
    gl::GenVertexArrays(1, &vertexArray_);
    gl::GenBuffers(1, &buffer_);
  }
  Gpu(const Gpu&) = delete;
  Gpu& operator=(const Gpu&) = delete;
  ~Gpu() {
    for (const auto& [source, program] : programs_) gl::DeleteProgram(program);
    gl::DeleteBuffers(1, &buffer_);
    gl::DeleteVertexArrays(1, &vertexArray_);
  }

  // The body's result for each point.
  std::vector<glm::vec4> run(const std::string& body, const GnomonBlock& block, std::vector<glm::vec4> points,
                             const std::string& hook = kPattern) {
    const std::size_t count = points.size();
    const int height = static_cast<int>((count + kWidth - 1) / kWidth);
    points.resize(static_cast<std::size_t>(height) * kWidth, glm::vec4(0.0f));
    const std::string source = fragment(hook, body);
    GLuint& program = programs_[source];
    if (program == 0) program = buildProgram(version_, {{GL_VERTEX_SHADER, kVertex}, {GL_FRAGMENT_SHADER, source}});
    const GLuint blockIndex = gl::GetUniformBlockIndex(program, "gnomonUniforms");
    if (blockIndex != GL_INVALID_INDEX) gl::UniformBlockBinding(program, blockIndex, 0);
    gl::BindBuffer(GL_UNIFORM_BUFFER, buffer_);
    gl::BufferData(GL_UNIFORM_BUFFER, sizeof block, &block, GL_STATIC_DRAW);
    gl::BindBufferBase(GL_UNIFORM_BUFFER, 0, buffer_);
    std::array<GLuint, 2> textures{};
    gl::GenTextures(2, textures.data());
    gl::ActiveTexture(GL_TEXTURE0);
    for (std::size_t i = 0; i < 2; ++i) {
      gl::BindTexture(GL_TEXTURE_2D, textures[i]);
      gl::TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
      gl::TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
      gl::TexImage2D(GL_TEXTURE_2D, 0, GL_RGBA32F, kWidth, height, 0, GL_RGBA, GL_FLOAT, i == 0 ? points.data() : nullptr);
    }
    GLuint target = 0;
    gl::GenFramebuffers(1, &target);
    gl::BindFramebuffer(GL_FRAMEBUFFER, target);
    gl::FramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, textures[1], 0);
    EXPECT_EQ(gl::CheckFramebufferStatus(GL_FRAMEBUFFER), static_cast<GLenum>(GL_FRAMEBUFFER_COMPLETE));
    gl::BindTexture(GL_TEXTURE_2D, textures[0]);
    gl::Viewport(0, 0, kWidth, height);
    gl::UseProgram(program);
    gl::Uniform1i(gl::GetUniformLocation(program, "points"), 0);
    gl::BindVertexArray(vertexArray_);
    gl::DrawArrays(GL_TRIANGLES, 0, 3);
    std::vector<glm::vec4> out(points.size());
    gl::ReadPixels(0, 0, kWidth, height, GL_RGBA, GL_FLOAT, out.data());
    EXPECT_EQ(gl::GetError(), static_cast<GLenum>(GL_NO_ERROR));
    out.resize(count);
    gl::DeleteFramebuffers(1, &target);
    gl::DeleteTextures(2, textures.data());
    return out;
  }

 private:
  std::unique_ptr<Context> context_;
  std::string version_;
  GLuint vertexArray_ = 0, buffer_ = 0;
  std::map<std::string, GLuint> programs_;
};

// Window depth of a view depth in the closed forms of the errata to [Zhang 2006, sec. 3.6].
double windowReference(const Camera& camera, double z) {
  const double n = camera.near, f = camera.far;
  const bool isReversed = camera.depth == DepthConvention::reversedZeroToOne;
  if (camera.projection == Projection::orthographic) return isReversed ? (f - z) / (f - n) : (z - n) / (f - n);
  if (!std::isfinite(f)) return isReversed ? n / z : 1.0 - n / z;
  return isReversed ? n / (f - n) * (f / z - 1.0) : f / (f - n) * (1.0 - n / z);
}

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

double floatStep(double x) {
  const float magnitude = std::abs(static_cast<float>(x));
  return static_cast<double>(std::nextafter(magnitude, std::numeric_limits<float>::infinity())) - magnitude;
}

constexpr int kMayDiffer = -2;  // too close to an end: rounding may decide

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

struct Setting {
  std::string name;
  Frame frame;
  PssmSettings settings;
};

// Five views by three camera depths by 1, 4 and 16 maps; the map's depth, the fit, the clip style and the light turn so that every
// pair of them meets.
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

// Where a map's own matrix, viewport and clip style put a point: texels of the atlas, rows from v = 0, and stored depth.
glm::dvec3 texelReference(const Frame& frame, const Partition& map, const glm::dvec3& world) {
  const glm::dvec4 clip = glm::dmat4(map.clipFromWorld) * glm::dvec4(world, 1.0);
  const glm::dvec3 ndc = glm::dvec3(clip) / clip.w;
  const double v = frame.shadowMap.style == ClipStyle::direct3d ? 0.5 - 0.5 * ndc.y : 0.5 + 0.5 * ndc.y;
  return {map.viewport.x + (0.5 + 0.5 * ndc.x) * map.viewport.z, map.viewport.y + v * map.viewport.w,
          frame.shadowMap.depth == DepthConvention::negativeOneToOne ? 0.5 + 0.5 * ndc.z : ndc.z};
}

// Same with the block's lookup matrix.
glm::dvec2 texelOf(const Solution& solution, int k, const glm::dvec3& world) {
  return glm::dvec2(atlasPosition(solution.block, k, world)) * glm::dvec2(solution.atlas);
}

// World vectors in the light plane that move the lookup by one texel along s and along t: central differences, in double.
std::array<glm::dvec3, 2> measuredEdges(const Frame& frame, const Solution& solution, int k, const glm::dvec3& world) {
  const glm::dvec3 light = glm::normalize(frame.light.directionWs);
  const glm::dvec3 a = glm::normalize(glm::cross(light, glm::dvec3(0.3, 0.4, 0.8))), b = glm::cross(light, a);
  const double step = 0.01 * std::max(std::abs(solution.partitions[k].near), 1.0);
  const glm::dvec2 da = (texelOf(solution, k, world + a * step) - texelOf(solution, k, world - a * step)) / (2.0 * step);
  const glm::dvec2 db = (texelOf(solution, k, world + b * step) - texelOf(solution, k, world - b * step)) / (2.0 * step);
  const double det = da.x * db.y - db.x * da.y;
  return {(a * db.y - b * da.y) / det, (b * da.x - a * db.x) / det};
}

class Parity : public ::testing::TestWithParam<const char*> {
 protected:
  const std::vector<Box> gapped_{{{-3, -3, -9}, {3, 3, -2}}, {{-90, -90, -400}, {90, 90, -200}}};
};

TEST_P(Parity, Selection) {
  Gpu gpu(GetParam());
  constexpr float kInf = std::numeric_limits<float>::infinity();
  std::size_t all = 0, served = 0, gaps = 0, undecided = 0;
  for (const Setting& setting : allSettings(gapped_)) {
    SCOPED_TRACE(setting.name);
    const Frame& frame = setting.frame;
    const Camera& camera = frame.camera;
    const auto solution = solve(frame, setting.settings);
    ASSERT_EQ(solution->status, Status::ok);
    const GnomonBlock& block = solution->block;
    const double near = camera.near, far = std::min(camera.far, camera.shadowDistance);
    Random random(91);
    std::vector<glm::vec4> points;  // x: view depth, w: window depth
    const auto add = [&](double z) {
      points.emplace_back(static_cast<float>(z), 0.0f, 0.0f, static_cast<float>(windowReference(camera, z)));
    };
    for (int i = 0; i < 700; ++i)
      add(camera.projection == Projection::perspective ? random.logUniform(near * 0.5, far * 2.0) : random.uniform(near - 5.0, far + 5.0));
    for (int i = 0; i < 100; ++i)
      points.emplace_back(static_cast<float>(random.uniform(near, far)), 0.0f, 0.0f, static_cast<float>(random.uniform()));
    for (int i = 0; i < solution->partitionCount; ++i) {
      const Partition& map = solution->partitions[i];
      for (const double z : {map.near, map.far}) {  // either side of the ends, to the last float step that may decide and past it
        const float view = static_cast<float>(z), window = static_cast<float>(windowReference(camera, z));
        for (int steps = -8; steps <= 8; ++steps)
          points.emplace_back(static_cast<float>(view + steps * floatStep(view)), 0.0f, 0.0f,
                              static_cast<float>(window + steps * floatStep(window)));
      }
      const float view = block.viewStart[i / 4][i % 4], window = block.windowStart[i / 4][i % 4] * block.depthRule.x;
      for (const float away : {-kInf, view, kInf})  // what the block holds, and one float either side
        points.emplace_back(std::nextafter(view, away), 0.0f, 0.0f, std::nextafter(window, away == view ? window : away));
      const float viewEnd = block.partitions[i].interval.y, windowEnd = block.partitions[i].interval.w * block.depthRule.x;
      for (const float away : {-kInf, viewEnd, kInf})
        points.emplace_back(std::nextafter(viewEnd, away), 0.0f, 0.0f, std::nextafter(windowEnd, away == viewEnd ? windowEnd : away));
    }
    for (const float odd : {0.0f, -0.0f, 1.0f, 2.0f, -1.0f, 3e38f, -3e38f, kInf, -kInf, std::nanf("")})
      points.emplace_back(odd, 0.0f, 0.0f, odd);
    const auto results =
        gpu.run("  result = vec4(gnomonSelectWindow(gnomon, point.w), gnomonSelectView(gnomon, point.x), 0.0, 0.0);\n", block, points);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const float view = points[i].x, window = points[i].w;
      const int byWindow = static_cast<int>(results[i].x), byView = static_cast<int>(results[i].y);
      EXPECT_EQ(byWindow, selectByWindowDepth(block, window)) << window;
      EXPECT_EQ(byView, selectByViewDepth(block, view)) << view;
      if (!std::isfinite(view)) {
        EXPECT_EQ(byWindow, -1) << window;
        EXPECT_EQ(byView, -1) << view;
        continue;
      }
      const int expectedWindow = servedAtWindow(frame, *solution, window), expectedView = servedAtView(frame, *solution, view);
      all += 2;
      undecided += (expectedWindow == kMayDiffer) + (expectedView == kMayDiffer);
      served += (expectedWindow >= 0) + (expectedView >= 0);
      if (expectedWindow != kMayDiffer) {
        EXPECT_EQ(byWindow, expectedWindow) << "window depth " << window;
      }
      if (expectedView != kMayDiffer) {
        EXPECT_EQ(byView, expectedView) << "view depth " << view;
      }
      gaps += expectedView == -1 && view > solution->partitions[0].far && view < solution->partitions[solution->partitionCount - 1].near;
    }
  }
  EXPECT_GT(all, 60000u);
  EXPECT_GT(served, all / 2);
  EXPECT_GT(gaps, 500u);
  EXPECT_LT(undecided, all / 5);
}

// Shaders that hold fewer maps, of a solve with as many: what the includes leave out is not needed.
TEST_P(Parity, ShadersWithFewerPartitionsSelectTheSame) {
  for (const int count : {1, 2, 4, 5, 8, 9, 12, 13, 16}) {
    Gpu gpu(std::string(GetParam()) + "\n#define GNOMON_MAX_PARTITIONS " + std::to_string(count));
    Frame frame = usualFrame();
    frame.budget.partitions = count;
    const auto solution = solve(frame);
    ASSERT_EQ(solution->partitionCount, count);
    Random random(102);
    std::vector<glm::vec4> points;
    for (int i = 0; i < 500; ++i) {
      const double z = random.logUniform(0.05, 200.0);
      points.emplace_back(static_cast<float>(z), 0.0f, 0.0f, static_cast<float>(windowReference(frame.camera, z)));
    }
    const auto results = gpu.run("  result = vec4(gnomonSelectWindow(gnomon, point.w), gnomonSelectView(gnomon, point.x), 0.0, 0.0);\n",
                                 solution->block, points);
    for (std::size_t i = 0; i < points.size(); ++i) {
      EXPECT_EQ(static_cast<int>(results[i].x), selectByWindowDepth(solution->block, points[i].w)) << count;
      EXPECT_EQ(static_cast<int>(results[i].y), selectByViewDepth(solution->block, points[i].x)) << count;
    }
  }
}

// A block with more partitions than the shader holds: those it does not hold serve nothing, rather than an index past its array.
TEST_P(Parity, ABlockLargerThanTheShaderStaysInside) {
  Frame frame = usualFrame();
  frame.budget.partitions = 8;
  const auto solution = solve(frame);
  for (const int held : {1, 4, 5, 7}) {
    Gpu gpu(std::string(GetParam()) + "\n#define GNOMON_MAX_PARTITIONS " + std::to_string(held));
    Random random(103);
    std::vector<glm::vec4> points;
    for (int i = 0; i < 500; ++i) {
      const double z = random.logUniform(0.1, 100.0);
      points.emplace_back(static_cast<float>(z), 0.0f, 0.0f, static_cast<float>(windowReference(frame.camera, z)));
    }
    const auto results = gpu.run("  result = vec4(gnomonSelectWindow(gnomon, point.w), gnomonSelectView(gnomon, point.x), 0.0, 0.0);\n",
                                 solution->block, points);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const int full = selectByViewDepth(solution->block, points[i].x), expected = full < held ? full : -1;
      const double toNext = full >= 0 ? points[i].x / solution->partitions[full].far : 0.0;
      if (toNext > 0.999) continue;  // so near a split that the two depths may disagree
      EXPECT_EQ(static_cast<int>(results[i].x), expected) << held;
      EXPECT_EQ(static_cast<int>(results[i].y), expected) << held;
    }
  }
}

// gnomonSelect takes the window depth, unless the block says that it cannot tell the splits apart.
TEST_P(Parity, SelectFollowsTheFlag) {
  Gpu gpu(GetParam());
  for (const bool isFar : {false, true}) {
    Frame frame = usualFrame();
    if (isFar) frame.camera.near = 1e-3, frame.camera.far = 1e5;
    frame.budget.partitions = 16;
    PssmSettings settings;
    settings.split.scheme = SplitScheme::uniform;
    const auto solution = solve(frame, settings);
    ASSERT_EQ(solution->status, Status::ok);
    ASSERT_EQ((solution->block.info.y & GNOMON_FLAG_VIEW_DEPTH) != 0u, isFar);
    Random random(96);
    std::vector<glm::vec4> points;
    std::vector<double> depths;
    for (int i = 0; i < 2000; ++i) {
      const double z = random.uniform(frame.camera.near, frame.camera.far * 1.1);
      depths.push_back(z);
      // A window depth that has nothing to do with the point tells which one decided.
      points.emplace_back(glm::vec3(viewPoint(frame.camera, random.uniform(), random.uniform(), z)),
                          static_cast<float>(windowReference(frame.camera, random.uniform(frame.camera.near, frame.camera.far))));
    }
    const auto results = gpu.run("  result = vec4(gnomonSelect(gnomon, point.w, world), gnomonViewDepth(gnomon, world), 0.0, 0.0);\n",
                                 solution->block, points);
    int different = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      EXPECT_NEAR(results[i].y, depths[i], 1e-6 * glm::length(glm::dvec3(points[i])));
      const int byWindow = selectByWindowDepth(solution->block, points[i].w), byView = selectByViewDepth(solution->block, results[i].y);
      different += byWindow != byView;
      EXPECT_EQ(static_cast<int>(results[i].x), isFar ? byView : byWindow);
    }
    EXPECT_GT(different, 1000);
  }
}

TEST_P(Parity, Lookup) {
  Gpu gpu(GetParam());
  int counted = 0, outside = 0;
  double worst = 0.0;
  for (const Setting& setting : allSettings(gapped_)) {
    SCOPED_TRACE(setting.name);
    const Frame& frame = setting.frame;
    const auto solution = solve(frame, setting.settings);
    ASSERT_EQ(solution->status, Status::ok);
    const glm::dvec2 atlas(solution->atlas);
    Random random(92);
    std::vector<glm::vec4> points;  // w: partition
    for (int i = 0; i < 700; ++i) {
      const int k = random.index(solution->partitionCount);
      const Partition& map = solution->partitions[k];
      const double z = i % 50 == 0 ? map.near : (i % 50 == 1 ? map.far : random.uniform(map.near, map.far));
      points.emplace_back(glm::vec3(viewPoint(frame.camera, random.uniform(), random.uniform(), z)), static_cast<float>(k));
    }
    const std::size_t inView = points.size();
    for (int i = 0; i < 200; ++i) {  // anywhere, behind the eye too
      const int k = random.index(solution->partitionCount);
      points.emplace_back(glm::vec3(random.direction() * random.logUniform(0.1, 4.0 * std::abs(solution->partitions[k].far))),
                          static_cast<float>(k));
    }
    const auto lookups = gpu.run("  result = gnomonAtlas(gnomon, index, world);\n", solution->block, points);
    const auto casts = gpu.run("  result = gnomonCastPosition(gnomon, index, world);\n", solution->block, points);
    const auto wholes = gpu.run("  result = gnomonCastAtlas(gnomon, index, world);\n", solution->block, points);
    const auto clips = gpu.run("  result = gnomonCastClip(gnomon, index, world);\n", solution->block, points);
    const auto flats = gpu.run("  result = gnomonCastFlat(gnomonCastPosition(gnomon, index, world));\n", solution->block, points);
    const auto others = gpu.run(
        "  float depth = gnomonCastWindowDepth(gnomon, index, world);\n  result = vec4(float(gnomonCastLayer(gnomon, index)), depth, "
        "gnomonCastDepth(depth), "
        "gnomonGrid(gnomon, index, world));\n",
        solution->block, points);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const int k = static_cast<int>(points[i].w);
      const Partition& map = solution->partitions[k];
      const glm::dvec3 world(points[i]);
      const glm::dvec3 reference = texelReference(frame, map, world), cpp = atlasPosition(solution->block, k, world);
      const glm::dvec2 texel = glm::dvec2(lookups[i].x, lookups[i].y) * atlas;
      const glm::dvec2 least(map.viewport.x, map.viewport.y), size(map.viewport.z, map.viewport.w);
      const glm::dvec2 past = glm::max(least - glm::dvec2(reference), glm::dvec2(reference) - least - size);
      const double out = std::max(past.x, past.y);  // texels outside the map; negative inside
      constexpr double kSlack = 1.0 / 64.0;
      if (std::abs(out - 1.0) > kSlack) {
        EXPECT_EQ(lookups[i].w, out < 1.0 ? 1.0f : 0.0f) << out;
      }
      outside += out > 1.0;
      EXPECT_EQ(others[i].x, static_cast<float>(frame.shadowMap.layout == MapLayout::layers ? k : 0));
      if (i >= inView && out > 0.0) continue;
      if (frame.scene.receivers.empty() && i < inView) {
        EXPECT_EQ(lookups[i].w, 1.0f);
      }
      if (out > size.x) continue;  // no receiver; far from what the map's numbers are good for
      ++counted;
      constexpr double kTexel = 1.0 / 256.0;
      for (int c = 0; c < 2; ++c) {
        worst = std::max({worst, std::abs(texel[c] - cpp[c] * atlas[c]), std::abs(texel[c] - reference[c])});
        EXPECT_NEAR(texel[c], cpp[c] * atlas[c], kTexel);
        EXPECT_NEAR(texel[c], reference[c], kTexel);
      }
      constexpr double kDepth = 2e-6;
      EXPECT_NEAR(lookups[i].z, std::clamp(cpp.z, 0.0, 1.0), kDepth);
      EXPECT_NEAR(lookups[i].z, std::clamp(reference.z, 0.0, 1.0), kDepth);
      EXPECT_NEAR(others[i].y, reference.z, kDepth * (1.0 + std::abs(reference.z)));
      EXPECT_EQ(others[i].z, std::clamp(others[i].y, 0.0f, 1.0f));
      // The draw side, through the map's own viewport and through the whole atlas as one viewport, lands on the same texel.
      // Direct3D alone has row 0 at clip y = +1, so there the host negates y of gnomonCastAtlas; both signs cancel in `one`.
      const double up = frame.shadowMap.style == ClipStyle::direct3d ? -1.0 : 1.0;
      const glm::dvec4 cast(casts[i]), whole(wholes[i]), clip(clips[i]);
      const glm::dvec2 own = least + (glm::dvec2(cast.x, up * cast.y) / cast.w * 0.5 + 0.5) * size,
                       one = (glm::dvec2(whole) / whole.w * 0.5 + 0.5) * atlas;
      for (int c = 0; c < 2; ++c) {
        EXPECT_NEAR(own[c], reference[c], kTexel);
        EXPECT_NEAR(one[c], reference[c], 2.0 * kTexel);
      }
      const glm::dvec4 exact = glm::dmat4(map.clipFromWorld) * glm::dvec4(world, 1.0);
      for (int c = 0; c < 4; ++c) EXPECT_NEAR(cast[c], exact[c], 4.0 * kDepth);
      EXPECT_EQ(whole.z, cast.z);
      EXPECT_EQ(whole.w, cast.w);
      const glm::dvec4 sides{1.0 + exact.x, 1.0 - exact.x, 1.0 + exact.y, 1.0 - exact.y};  // w is 1 for a directional light
      for (int c = 0; c < 4; ++c) EXPECT_NEAR(clip[c], sides[c], 4.0 * kDepth);
      EXPECT_EQ(glm::vec2(flats[i]), glm::vec2(casts[i]));
      EXPECT_EQ(flats[i].w, casts[i].w);
      EXPECT_EQ(flats[i].z, 0.5f * casts[i].w);  // inside the depth range of every convention
      const glm::dvec2 inTexel = glm::abs(glm::fract(glm::dvec2(reference)) - 0.5);
      if (const double border = std::max(inTexel.x, inTexel.y); std::abs(border - 0.45) > 2.0 * kTexel && border < 0.5 - 2.0 * kTexel) {
        EXPECT_EQ(others[i].w, border > 0.45 ? 1.0f : 0.0f);
      }
    }
  }
  EXPECT_GT(counted, 25000);
  EXPECT_GT(outside, 1000);
  RecordProperty("worstTexels", std::to_string(worst));
}

// The columns of the inverse Jacobian against differences of the lookup, in double.
TEST_P(Parity, TexelEdges) {
  Gpu gpu(GetParam());
  for (const Setting& setting : allSettings(gapped_)) {
    SCOPED_TRACE(setting.name);
    const auto solution = solve(setting.frame, setting.settings);
    Random random(97);
    std::vector<glm::vec4> points;
    for (int i = 0; i < 60; ++i) {
      const int k = random.index(solution->partitionCount);
      const double z = random.uniform(solution->partitions[k].near, solution->partitions[k].far);
      points.emplace_back(glm::vec3(viewPoint(setting.frame.camera, random.uniform(), random.uniform(), z)), static_cast<float>(k));
    }
    const std::string body = "  vec3 edgeS, edgeT;\n  gnomonTexelEdges(gnomon, index, world, edgeS, edgeT);\n";
    const std::array<std::vector<glm::vec4>, 2> edges{gpu.run(body + "  result = vec4(edgeS, 0.0);\n", solution->block, points),
                                                      gpu.run(body + "  result = vec4(edgeT, 0.0);\n", solution->block, points)};
    for (std::size_t i = 0; i < points.size(); ++i) {
      const auto measured = measuredEdges(setting.frame, *solution, static_cast<int>(points[i].w), glm::dvec3(points[i]));
      for (std::size_t e = 0; e < 2; ++e) EXPECT_LT(glm::length(glm::dvec3(edges[e][i]) - measured[e]), 1e-5 * glm::length(measured[e]));
    }
  }
}

// Filters against sums over a pattern of texels worked out here; taps stay inside the map, whatever the margin.
TEST_P(Parity, FiltersSumTheirTexels) {
  Gpu gpu(GetParam());
  for (const MapLayout layout : {MapLayout::atlas, MapLayout::layers}) {
    Frame frame = usualFrame();
    frame.budget.resolution = 64;  // small maps: many points near their borders
    frame.margin.filter = layout == MapLayout::atlas ? 0.0 : 2.0;
    frame.shadowMap.layout = layout;
    frame.bias = {.slope = 0.0, .constant = 0.0};
    const auto solution = solve(frame);
    ASSERT_EQ(solution->status, Status::ok);
    Random random(94);
    std::vector<glm::vec4> points;
    for (int i = 0; i < 6000; ++i) {
      const int k = random.index(solution->partitionCount);
      const double z = random.uniform(solution->partitions[k].near, solution->partitions[k].far);
      points.emplace_back(glm::vec3(viewPoint(frame.camera, random.uniform(), random.uniform(), z)), static_cast<float>(k));
    }
    const auto results = gpu.run(
        "  vec3 up = vec3(0.0, 1.0, 0.0);\n  result = vec4(gnomonShadow(gnomon, 1, index, world, up), gnomonShadow3x3(gnomon, 2, index, "
        "world, up),\n"
        "                gnomonShadowTent(gnomon, 3, index, world, up), gnomonShadow(gnomon, 0, -1, world, world));\n",
        solution->block, points);
    int checked = 0, clamped = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const int k = static_cast<int>(points[i].w);
      const Partition& map = solution->partitions[k];
      const glm::dvec2 texel(texelReference(frame, map, glm::dvec3(points[i])));
      const glm::dvec2 inTexel = glm::fract(texel), inTent = glm::fract(texel - 0.5);
      constexpr double kClose = 0.02;  // float rounding may choose the neighbour closer to a border than this
      if (std::min({inTexel.x, inTexel.y, inTent.x, inTent.y}) < kClose ||
          std::max({inTexel.x, inTexel.y, inTent.x, inTent.y}) > 1.0 - kClose)
        continue;
      ++checked;
      const glm::ivec2 middle(glm::floor(texel)), least(map.viewport.x, map.viewport.y),
          most = least + glm::ivec2(map.viewport.z, map.viewport.w) - 1;
      const auto tap = [&](int x, int y, int number) {
        const glm::ivec2 at = glm::clamp(middle + glm::ivec2(x, y), least, most);
        clamped += at != middle + glm::ivec2(x, y);
        return pattern(at.x, at.y, layout == MapLayout::layers ? k : 0, number);
      };
      double box = 0.0, tent = 0.0, weights = 0.0;
      for (int y = -1; y <= 1; ++y)
        for (int x = -1; x <= 1; ++x) box += tap(x, y, 2) / 9.0;
      for (int y = -2; y <= 2; ++y)  // every texel whose centre lies within the tent's half width of 2
        for (int x = -2; x <= 2; ++x) {
          const glm::dvec2 away = glm::abs(glm::dvec2(middle + glm::ivec2(x, y)) + 0.5 - texel);
          const double weight = std::max(2.0 - away.x, 0.0) * std::max(2.0 - away.y, 0.0);
          weights += weight;
          tent += tap(x, y, 3) * weight;
        }
      EXPECT_NEAR(results[i].x, tap(0, 0, 1), 1e-6);
      EXPECT_NEAR(results[i].y, box, 1e-6);
      EXPECT_NEAR(results[i].z, tent / weights, 1e-3);
      EXPECT_EQ(results[i].w, 1.0f);  // no partition: lit
    }
    EXPECT_GT(checked, 4000);
    EXPECT_GT(clamped, layout == MapLayout::atlas ? 100 : -1);
  }
}

// The tent's weights sum to one, and its answer is continuous: across a straight edge it is the tent's integral, step by step.
TEST_P(Parity, TheTentIsContinuous) {
  Gpu gpu(GetParam());
  Frame frame = usualFrame();
  frame.bias = {.slope = 0.0, .constant = 0.0};
  frame.margin.filter = 8.0;
  const auto solution = solve(frame);
  constexpr int k = 1, kSteps = 1024, kPerTexel = 128;
  const Partition& map = solution->partitions[k];
  glm::dvec3 start = viewPoint(frame.camera, 0.5, 0.5, 0.5 * (map.near + map.far));
  const auto edges = measuredEdges(frame, *solution, k, start);
  const std::string body = "  result = vec4(gnomonShadowTent(gnomon, 0, index, world, vec3(0.0, 1.0, 0.0)));\n";
  for (int axis = 0; axis < 2; ++axis) {
    const double first = texelReference(frame, map, start)[axis];
    const double border = std::floor(first) + 4.0;  // texels before this are lit
    std::vector<glm::vec4> points;
    for (int i = 0; i < kSteps; ++i)
      points.emplace_back(glm::vec3(start + edges[static_cast<std::size_t>(axis)] * (static_cast<double>(i) / kPerTexel)),
                          static_cast<float>(k));
    const std::string component = axis == 0 ? "x" : "y";
    const std::string hook = "float gnomonCompare(int map, vec2 uv, float layer, float depth) { return uv." + component +
                             " * gnomon.atlas." + component + " < " + std::to_string(border) + " ? 1.0 : 0.0; }\n";
    const auto steps = gpu.run(body, solution->block, points, hook);
    const auto ones =
        gpu.run(body, solution->block, points, "float gnomonCompare(int map, vec2 uv, float layer, float depth) { return 1.0; }\n");
    for (std::size_t i = 0; i < points.size(); ++i) {
      EXPECT_NEAR(ones[i].x, 1.0, 1e-6);
      const double at = texelReference(frame, map, glm::dvec3(points[i]))[axis];
      double lit = 0.0;
      for (double centre = std::floor(at) - 2.5; centre < at + 4.0; centre += 1.0)
        lit += centre < border ? std::max(2.0 - std::abs(centre - at), 0.0) / 4.0 : 0.0;
      EXPECT_NEAR(steps[i].x, lit, 2e-3);
      if (i > 0) {  // the tent's height is half a unit for each texel of motion
        EXPECT_LE(steps[i].x, steps[i - 1].x + 1e-6);
        EXPECT_GE(steps[i].x, steps[i - 1].x - 0.5 / kPerTexel - 2e-3);
      }
    }
    EXPECT_EQ(steps.front().x, 1.0f);
    EXPECT_EQ(steps.back().x, 0.0f);
  }
}

// What the hook is given: the stored depth of the biased point, the same for every tap.
TEST_P(Parity, TheHookGetsTheStoredDepth) {
  Gpu gpu(GetParam());
  const std::string hook = "float gnomonCompare(int map, vec2 uv, float layer, float depth) { return depth; }\n";
  for (const DepthConvention depth : {DepthConvention::negativeOneToOne, DepthConvention::zeroToOne, DepthConvention::reversedZeroToOne}) {
    Frame frame = usualFrame();
    frame.shadowMap.depth = depth;
    const auto solution = solve(frame);
    Random random(98);
    std::vector<glm::vec4> points;
    for (int i = 0; i < 500; ++i) {
      const int k = random.index(solution->partitionCount);
      const double z = random.uniform(solution->partitions[k].near, solution->partitions[k].far);
      points.emplace_back(glm::vec3(viewPoint(frame.camera, random.uniform(), random.uniform(), z)), static_cast<float>(k));
    }
    const glm::dvec3 normal = glm::normalize(glm::dvec3(0.2, 1.0, -0.3));
    const std::string up = "  vec3 up = normalize(vec3(0.2, 1.0, -0.3));\n";
    const auto results =
        gpu.run(up + "  result = vec4(gnomonShadow(gnomon, 0, index, world, up), gnomonShadow3x3(gnomon, 0, index, world, up), "
                     "gnomonShadowTent(gnomon, 0, index, world, up), 0.0);\n",
                solution->block, points, hook);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const int k = static_cast<int>(points[i].w);
      const glm::dvec3 world(points[i]);
      const auto edges = measuredEdges(frame, *solution, k, world);
      const double across = std::abs(glm::dot(normal, edges[0])) + std::abs(glm::dot(normal, edges[1]));
      const double longest = std::max(glm::length(edges[0]), glm::length(edges[1]));
      const std::array<double, 3> reach{0.5, 1.5, 2.0};
      for (int c = 0; c < 3; ++c) {
        const glm::dvec3 moved =
            world + normal * (frame.bias.slope * reach[static_cast<std::size_t>(c)] * across + frame.bias.constant * longest);
        EXPECT_NEAR(results[i][c], std::clamp(texelReference(frame, solution->partitions[k], moved).z, 0.0, 1.0), 4e-6);
      }
    }
  }
}

TEST_P(Parity, TintsAreDistinctColours) {
  Gpu gpu(GetParam());
  std::vector<glm::vec4> points;
  for (int i = -1; i < kMaxPartitions; ++i) points.emplace_back(0.0f, 0.0f, 0.0f, static_cast<float>(i));
  const auto tints = gpu.run("  result = vec4(gnomonTint(index), gnomonGrid(gnomon, -1, world));\n", GnomonBlock{}, points);
  EXPECT_EQ(tints[0], glm::vec4(0.5f, 0.5f, 0.5f, 0.0f));
  for (std::size_t i = 0; i < tints.size(); ++i)
    for (int c = 0; c < 3; ++c) {
      EXPECT_GE(tints[i][c], 0.0f);
      EXPECT_LE(tints[i][c], 1.0f);
    }
  constexpr float kEightBitSteps = 8.0f / 255.0f;  // neighbours and everything else can be told apart in a picture
  for (std::size_t i = 0; i < tints.size(); ++i)
    for (std::size_t j = 0; j < i; ++j) EXPECT_GT(glm::length(glm::vec3(tints[i]) - glm::vec3(tints[j])), kEightBitSteps) << i << " " << j;
}

// Bias: a point of a plane, moved as the shader moves it, clears the plane's depth anywhere in the texel, by no more than that.
TEST_P(Parity, BiasClearsAPlaneWithinTheTexel) {
  Gpu gpu(GetParam());
  Frame frame = usualFrame();
  frame.bias = {.slope = 1.0, .constant = 0.0};
  const auto solution = solve(frame);
  const glm::dvec3 light = glm::normalize(frame.light.directionWs);
  Random random(93);
  std::vector<glm::vec4> points;
  std::vector<glm::vec3> normals;
  for (int i = 0; i < 400; ++i) {
    glm::dvec3 normal = random.direction();
    if (glm::dot(normal, light) > 0.0) normal = -normal;
    if (glm::dot(normal, light) > -0.05) continue;
    const int k = random.index(solution->partitionCount);
    const glm::vec3 rel(viewPoint(frame.camera, random.uniform(), random.uniform(),
                                  random.uniform(solution->partitions[k].near, solution->partitions[k].far)));
    points.emplace_back(rel, static_cast<float>(k));
    normals.emplace_back(normal);
  }
  // One program for each normal would be slow: the normal of point i follows it as point i + n.
  const std::size_t n = points.size();
  for (const glm::vec3& normal : normals) points.emplace_back(normal, 0.0f);
  const std::string body = "  int at = int(gl_FragCoord.y) * 512 + int(gl_FragCoord.x) + " + std::to_string(n) +
                           ";\n  vec3 normal = texelFetch(points, ivec2(at % 512, at / 512), 0).xyz;\n  result = vec4(gnomonBias(gnomon, "
                           "int(point.w), world, normal, 0.5) - world, 0.0);\n";
  const auto moved = gpu.run(body, solution->block, points);
  for (std::size_t i = 0; i < n; ++i) {
    const int k = static_cast<int>(points[i].w);
    const glm::dvec3 rel(points[i]), normal(normals[i]), offset(moved[i]);
    // World vectors of half a texel along s and t by differences of the lookup, in double.
    const glm::dvec3 a = glm::normalize(glm::cross(light, glm::dvec3(0.3, 0.4, 0.8))), b = glm::cross(light, a);
    const double step = 0.01 * solution->partitions[k].near;
    const auto texel = [&](const glm::dvec3& p) { return glm::dvec2(atlasPosition(solution->block, k, p)) * glm::dvec2(solution->atlas); };
    const glm::dvec2 da = (texel(rel + a * step) - texel(rel - a * step)) / (2.0 * step),
                     db = (texel(rel + b * step) - texel(rel - b * step)) / (2.0 * step);
    const double det = da.x * db.y - db.x * da.y;
    const glm::dvec3 s = (a * db.y - b * da.y) / det, t = (b * da.x - a * db.x) / det;
    const double needed = 0.5 * (std::abs(glm::dot(normal, s)) +
                                 std::abs(glm::dot(normal, t)));  // height over the plane that its farthest texel corner asks for
    EXPECT_NEAR(glm::dot(offset, normal) / needed, 1.0, 1e-2);
    EXPECT_LT(glm::length(glm::cross(offset, normal)), 1e-5 * glm::length(rel) + 1e-2 * needed);
  }
}

TEST_P(Parity, FadeAndOutside) {
  Gpu gpu(GetParam());
  Frame frame = usualFrame();
  frame.camera.shadowDistance = 50.1;
  frame.fade = 0.2;  // from 40.1 to 50.1
  const auto solution = solve(frame);
  std::vector<glm::vec4> points;
  for (const float z : {-1.0f, 0.1f, 40.0f, 40.1f, 42.6f, 45.1f, 50.0f, 50.1f, 60.0f}) points.emplace_back(z, 0.0f, 0.0f, 0.0f);
  const auto fades = gpu.run("  result = vec4(gnomonFade(gnomon, point.x));\n", solution->block, points);
  for (std::size_t i = 0; i < points.size(); ++i)
    EXPECT_NEAR(fades[i].x, std::clamp((50.1 - points[i].x) / 10.0, 0.0, 1.0), 1e-5) << points[i].x;
  // Far to the side of the first map: outside, lit.
  const auto outside =
      gpu.run("  result = vec4(gnomonAtlas(gnomon, 0, world).w, gnomonShadow(gnomon, 0, 0, world, vec3(0.0, 1.0, 0.0)), 0.0, 0.0);\n",
              solution->block, {{1000.0f, 0.0f, 0.0f, 0.0f}, {0.0f, 0.0f, 900.0f, 0.0f}});
  for (const glm::vec4& each : outside) {
    EXPECT_EQ(each.x, 0.0f);
    EXPECT_EQ(each.y, 1.0f);
  }
}

// A refused solve's block: nothing served, all lit, nothing that is not finite.
TEST_P(Parity, ARefusedBlockIsLit) {
  Gpu gpu(GetParam());
  Frame frame = usualFrame();
  frame.camera.near = std::nan("");
  const auto solution = solve(frame);
  ASSERT_NE(solution->status, Status::ok);
  std::vector<glm::vec4> points;
  Random random(95);
  for (int i = 0; i < 1000; ++i)
    points.emplace_back(glm::vec3(random.direction() * random.logUniform(0.01, 1e6)), static_cast<float>(random.uniform()));
  const auto results = gpu.run(
      "  int at = gnomonSelect(gnomon, point.w, world);\n  result = vec4(at, gnomonShadow(gnomon, 0, at, world, vec3(0.0, 1.0, 0.0)), "
      "gnomonFade(gnomon, gnomonViewDepth(gnomon, world)), "
      "gnomonSelectView(gnomon, gnomonViewDepth(gnomon, world)));\n",
      solution->block, points);
  for (const glm::vec4& each : results) EXPECT_EQ(each, glm::vec4(-1.0f, 1.0f, 1.0f, -1.0f));
}

// A block made by hand: projective, with texels longer along t, as a light with a position would have it. A directional solve has w = 1.
TEST_P(Parity, AProjectiveMapIsDividedByW) {
  Gpu gpu(GetParam());
  GnomonBlock block;
  clearBlock(block);
  block.info.x = 1;
  const glm::dvec2 atlas(512.0, 64.0);
  block.atlas = glm::vec4(glm::dvec4(atlas, 1.0 / atlas));
  const glm::dvec3 light = glm::normalize(glm::dvec3(0.2, -0.9, 0.3));
  block.lightDirection = glm::vec4(glm::vec3(light), 0.0f);
  block.bias = {0.75f, 0.5f, 0.0f, 0.0f};
  GnomonPartition& map = block.partitions[0];
  map.atlasFromWorld =
      glm::mat4(0.11f, 0.02f, 0.01f, 0.03f, -0.02f, 0.05f, 0.04f, -0.02f, 0.03f, 0.12f, -0.02f, 0.05f, 0.5f, 0.45f, 0.4f, 1.0f);
  map.clipFromWorld = glm::mat4(0.2f, 0.1f, 0.05f, 0.03f, -0.1f, 0.3f, 0.04f, -0.02f, 0.06f, 0.2f, -0.02f, 0.05f, 0.1f, -0.1f, 0.3f, 1.0f);
  map.uvBounds = {0.0f, 0.0f, 1.0f, 1.0f};
  Random random(100);
  std::vector<glm::vec4> points;
  for (int i = 0; i < 2000; ++i) points.emplace_back(glm::vec3(random.direction() * random.uniform(0.0, i % 4 == 0 ? 60.0 : 3.0)), 0.0f);
  const glm::dmat4 worldFromAtlas = glm::inverse(glm::dmat4(map.atlasFromWorld));
  for (int i = 0; i < 4000; ++i) {  // points behind that the division puts into the middle of the map
    const glm::dvec4 r = worldFromAtlas * glm::dvec4(random.uniform(0.1, 0.9), random.uniform(0.1, 0.9), random.uniform(-20.0, 20.0), 1.0);
    if (r.w < -0.01 && r.w > -1.0) points.emplace_back(glm::vec3(glm::dvec3(r) / r.w), 0.0f);
  }
  const std::string body =
      "  vec3 up = vec3(0.6, 0.8, 0.0);\n  vec3 edgeS, edgeT;\n  gnomonTexelEdges(gnomon, index, world, edgeS, edgeT);\n";
  const auto lookups = gpu.run("  result = gnomonAtlas(gnomon, index, world);\n", block, points);
  const auto edgesS = gpu.run(body + "  result = vec4(edgeS, gnomonCastWindowDepth(gnomon, index, world));\n", block, points);
  const auto edgesT = gpu.run(body + "  result = vec4(edgeT, 0.0);\n", block, points);
  const auto biases = gpu.run(body + "  result = vec4(gnomonBias(gnomon, index, world, up, 1.5) - world, 0.0);\n", block, points);
  const auto casts = gpu.run("  result = gnomonCastAtlas(gnomon, index, world);\n", block, points);
  const auto clips = gpu.run("  result = gnomonCastClip(gnomon, index, world);\n", block, points);
  int behind = 0, behindInside = 0, inside = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const glm::dvec3 world(points[i]);
    const glm::dvec4 q = glm::dmat4(map.atlasFromWorld) * glm::dvec4(world, 1.0),
                     own = glm::dmat4(map.clipFromWorld) * glm::dvec4(world, 1.0);
    const glm::dvec3 p = glm::dvec3(q) / q.w;
    if (q.w < -0.01) {  // behind the light, wherever the division puts it
      ++behind;
      EXPECT_EQ(lookups[i].w, 0.0f);
      behindInside += p.x > 0.05 && p.x < 0.95 && p.y > 0.05 && p.y < 0.95;
    }
    const double out = std::max(std::max(-p.x, p.x - 1.0) * atlas.x, std::max(-p.y, p.y - 1.0) * atlas.y);
    if (q.w < 0.2 || out > 8.0) continue;
    if (std::abs(out - 1.0) > 0.01) {
      EXPECT_EQ(lookups[i].w, out < 1.0 ? 1.0f : 0.0f);
    }
    ++inside;
    const glm::dvec3 cpp = atlasPosition(block, 0, world);
    for (int c = 0; c < 2; ++c) {
      EXPECT_NEAR(lookups[i][c] * atlas[c], p[c] * atlas[c], 1.0 / 256.0);
      EXPECT_NEAR(cpp[c], p[c], 1e-12);
      EXPECT_NEAR(casts[i][c], 2.0 * q[c] - own.w, 1e-5);
    }
    EXPECT_NEAR(lookups[i].z, std::clamp(p.z, 0.0, 1.0), 1e-5);
    EXPECT_NEAR(edgesS[i].w, p.z, 1e-5 * (1.0 + std::abs(p.z)));
    EXPECT_NEAR(cpp.z, p.z, 1e-12);
    EXPECT_NEAR(casts[i].z, own.z, 1e-5);
    const std::array<double, 4> sides{own.w + own.x, own.w - own.x, own.w + own.y, own.w - own.y};
    for (std::size_t c = 0; c < 4; ++c) EXPECT_NEAR(clips[i][static_cast<int>(c)], sides[c], 1e-5);
    // Differences of the lookup along two directions of the light plane, inverted.
    const glm::dvec3 a = glm::normalize(glm::cross(light, glm::dvec3(0.3, 0.4, 0.8))), b = glm::cross(light, a);
    const auto texel = [&](const glm::dvec3& at) {
      const glm::dvec4 r = glm::dmat4(map.atlasFromWorld) * glm::dvec4(at, 1.0);
      return glm::dvec2(r) / r.w * atlas;
    };
    constexpr double kStep = 1e-5;
    const glm::dvec2 da = (texel(world + a * kStep) - texel(world - a * kStep)) / (2.0 * kStep),
                     db = (texel(world + b * kStep) - texel(world - b * kStep)) / (2.0 * kStep);
    const double det = da.x * db.y - db.x * da.y;
    if (std::abs(det) < 0.05 * glm::length(da) * glm::length(db)) continue;  // texels that are nearly lines
    const glm::dvec3 s = (a * db.y - b * da.y) / det, t = (b * da.x - a * db.x) / det;
    EXPECT_LT(glm::length(glm::dvec3(edgesS[i]) - s), 1e-3 * glm::length(s));
    EXPECT_LT(glm::length(glm::dvec3(edgesT[i]) - t), 1e-3 * glm::length(t));
    const glm::dvec3 up(0.6, 0.8, 0.0);
    const double height =
        0.75 * 1.5 * (std::abs(glm::dot(up, s)) + std::abs(glm::dot(up, t))) + 0.5 * std::max(glm::length(s), glm::length(t));
    EXPECT_LT(glm::length(glm::dvec3(biases[i]) - up * height), 1e-3 * height + 1e-5);
  }
  EXPECT_GT(behind, 50);
  EXPECT_GT(behindInside, 50);
  EXPECT_GT(inside, 500);
}

// World space: the block's origin is zero and the plane of view depth has an offset.
TEST_P(Parity, WorldSpaceMatricesTakeWorldPositions) {
  Gpu gpu(GetParam());
  Frame frame = usualFrame();
  frame.worldSpace = true;
  const auto solution = solve(frame);
  ASSERT_EQ(solution->status, Status::ok);
  EXPECT_EQ(glm::vec3(solution->block.origin), glm::vec3(0.0f));
  Random random(101);
  std::vector<glm::vec4> points;
  std::vector<double> depths;
  for (int i = 0; i < 2000; ++i) {
    const int k = random.index(solution->partitionCount);
    depths.push_back(random.uniform(solution->partitions[k].near, solution->partitions[k].far));
    points.emplace_back(glm::vec3(frame.camera.positionWs + viewPoint(frame.camera, random.uniform(), random.uniform(), depths.back())),
                        static_cast<float>(k));
  }
  const auto results =
      gpu.run("  result = vec4(gnomonAtlas(gnomon, index, world).xyw, gnomonViewDepth(gnomon, world));\n", solution->block, points);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const glm::dvec3 reference = texelReference(frame, solution->partitions[static_cast<int>(points[i].w)], glm::dvec3(points[i]));
    EXPECT_NEAR(results[i].x * static_cast<double>(solution->atlas.x), reference.x, 1.0 / 64.0);  // terms as large as the camera's distance
    EXPECT_NEAR(results[i].y * static_cast<double>(solution->atlas.y), reference.y, 1.0 / 64.0);
    EXPECT_EQ(results[i].z, 1.0f);
    EXPECT_NEAR(results[i].w, depths[i], 1e-6 * (glm::length(glm::dvec3(points[i])) + 4.0));
    EXPECT_NEAR(viewDepth(solution->block, glm::dvec3(points[i])), depths[i], 1e-6 * (glm::length(glm::dvec3(points[i])) + 4.0));
  }
}

// Index -1 reads no partition: the memory before the array is laid out so that a map there would cover everything.
TEST_P(Parity, NoPartitionReadsNothing) {
  Gpu gpu(GetParam());
  GnomonBlock block;
  clearBlock(block);
  block.lightDirection = {0.0f, -1.0f, 0.0f, 0.0f};
  const std::ptrdiff_t before =
      static_cast<std::ptrdiff_t>(offsetof(GnomonBlock, partitions)) - static_cast<std::ptrdiff_t>(sizeof(GnomonPartition));
  const auto put = [&](std::size_t offset, const std::vector<float>& values) {
    std::memcpy(reinterpret_cast<std::byte*>(&block) + before + static_cast<std::ptrdiff_t>(offset), values.data(),
                values.size() * sizeof(float));
  };
  put(offsetof(GnomonPartition, atlasFromWorld), {1e-3f, 0, 0, 0, 0, 0, 1e-3f, 0, 0, 1e-3f, 0, 0, 0.5f, 0.5f, 0.5f, 1.0f});
  put(offsetof(GnomonPartition, uvBounds), {0.0f, 0.0f, 1.0f, 1.0f});
  const std::vector<glm::vec4> points{{0.0f, 0.0f, 0.0f, -1.0f}, {1.0f, 2.0f, 3.0f, -1.0f}};
  const std::string dark = "float gnomonCompare(int map, vec2 uv, float layer, float depth) { return 0.0; }\n";
  const auto results = gpu.run(
      "  vec3 up = vec3(0.0, 1.0, 0.0);\n  result = vec4(gnomonShadow(gnomon, 0, index, world, up), gnomonShadow3x3(gnomon, 0, index, "
      "world, up), "
      "gnomonShadowTent(gnomon, 0, index, world, up), 1.0);\n",
      block, points, dark);
  for (const glm::vec4& each : results) EXPECT_EQ(each, glm::vec4(1.0f));
}

// A cleared block over memory that is not a number: what its partitions hold is never used.
TEST_P(Parity, AClearedBlockIsLitWhateverItHeld) {
  Gpu gpu(GetParam());
  GnomonBlock block;
  std::fill_n(reinterpret_cast<float*>(&block), sizeof block / sizeof(float), std::nanf(""));
  clearBlock(block);
  std::vector<glm::vec4> points;
  Random random(99);
  for (int i = 0; i < 1000; ++i)
    points.emplace_back(glm::vec3(random.direction() * random.logUniform(0.01, 1e6)), static_cast<float>(random.uniform()));
  points.emplace_back(0.0f, 0.0f, 0.0f, std::numeric_limits<float>::infinity());
  points.emplace_back(0.0f, 0.0f, 0.0f, std::nanf(""));
  for (const std::string shadow : {"gnomonShadow", "gnomonShadow3x3", "gnomonShadowTent"}) {
    const auto results = gpu.run(
        "  int at = gnomonSelect(gnomon, point.w, world);\n  float z = gnomonViewDepth(gnomon, world);\n  result = vec4(at, mix(1.0, " +
            shadow +
            "(gnomon, 0, at, world, vec3(0.0, 1.0, 0.0)), gnomonFade(gnomon, z)), gnomonFade(gnomon, z), gnomonSelectView(gnomon, z));\n",
        block, points);
    for (const glm::vec4& each : results) EXPECT_EQ(each, glm::vec4(-1.0f, 1.0f, 1.0f, -1.0f));
  }
}

const char* const kMapIsLit = "float gnomonCompare(int map, vec2 uv, float layer, float depth) { return layer * 0.25; }\n";

// A lookup in map i answers i / 4: the mixed result over depth has no step, and is i / 4 where one map serves alone.
TEST_P(Parity, BlendMixesWithoutASeam) {
  Gpu gpu(GetParam());
  for (const bool byWindow : {false, true}) {
    Frame frame = usualFrame();
    frame.margin.blend = 0.2;
    frame.shadowMap.layout = MapLayout::layers;
    const auto solution = solve(frame);
    ASSERT_EQ(solution->partitionCount, 4);
    std::vector<glm::vec4> points;
    std::vector<double> depths;
    for (int k = 0; k <= 4000; ++k) {
      const double z = 0.1 * std::pow(1000.0, k / 4000.0 * 0.9999);
      depths.push_back(z);
      const double window = 100.0 / 99.9 * (1.0 - 0.1 / z);
      points.emplace_back(glm::vec3(viewPoint(frame.camera, 0.3, 0.6, z)), static_cast<float>(window));
    }
    for (int i = 0; i + 1 < 4; ++i)  // at the seams, where rounding decides who serves
      for (int k = -20; k <= 20; ++k) {
        const double z = solution->partitions[i].far * (1.0 + k * 1e-7);
        depths.push_back(z);
        points.emplace_back(glm::vec3(viewPoint(frame.camera, 0.3, 0.6, z)), static_cast<float>(100.0 / 99.9 * (1.0 - 0.1 / z)));
      }
    const std::string select =
        byWindow ? "gnomonSelectWindow(gnomon, point.w)" : "gnomonSelectView(gnomon, gnomonViewDepth(gnomon, world))";
    const auto out = gpu.run("index = " + select + R"(;
  float weight = gnomonBlendWeight(gnomon, index, gnomonViewDepth(gnomon, world));
  float lit = gnomonShadow(gnomon, 0, index, world, vec3(0.0));
  if (weight > 0.0) lit = mix(lit, gnomonShadow(gnomon, 0, index + 1, world, vec3(0.0)), weight);
  result = vec4(lit, weight, float(index), 0.0);
)",
                             solution->block, points, kMapIsLit);
    for (std::size_t k = 0; k < points.size(); ++k) {
      const double z = depths[k];
      int index = 0;
      while (index + 1 < 4 && solution->partitions[index + 1].near <= z) ++index;
      const double band = 0.2 * (solution->partitions[index].far - solution->partitions[index].near);
      const double share = index + 1 < 4 ? std::clamp(1.0 - (solution->partitions[index].far - z) / band, 0.0, 1.0) : 0.0;
      const double want = 0.25 * (index + share);
      ASSERT_NEAR(out[k].x, want, 1e-4) << "view depth " << z << " byWindow " << byWindow;
    }
  }
}

// Dithering: as many picks of the next map as the weight says, over any patch of pixels.
TEST_P(Parity, BlendDithersByTheWeight) {
  Gpu gpu(GetParam());
  const auto solution = solve(usualFrame());
  for (const float weight : {0.0f, 0.1f, 0.25f, 0.5f, 0.9f, 1.0f}) {
    const std::vector<glm::vec4> points(512 * 64, glm::vec4(weight, 0, 0, 2));
    const auto out = gpu.run("result = vec4(float(gnomonBlendDither(index, point.x, gl_FragCoord.xy)));\n", solution->block, points);
    for (int patch = 0; patch < 16; ++patch) {  // 32 x 64 pixels each
      double next = 0.0;
      for (int y = 0; y < 64; ++y)
        for (int x = 0; x < 32; ++x) {
          const float index = out[static_cast<std::size_t>(y * 512 + patch * 32 + x)].x;
          ASSERT_TRUE(index == 2.0f || index == 3.0f);
          next += index == 3.0f;
        }
      EXPECT_NEAR(next / (32.0 * 64.0), weight, 0.02) << weight;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Versions, Parity, ::testing::Values("330 core", "450"));

}  // namespace
}  // namespace gnomon::test
