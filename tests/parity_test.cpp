// The shaders, run by the driver on points in a float texture, against the C++ functions and against formulas in double written here.
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "shader.h"
#include "support.h"

namespace gnomon::test {
namespace {

using namespace gnomon::offscreen;

constexpr int kWidth = 512;  // points to a row

const char* const kVertex = "void main() { vec2 p = vec2((gl_VertexID << 1) & 2, gl_VertexID & 2); gl_Position = vec4(p * 2.0 - 1.0, 0.0, 1.0); }\n";

// Each pixel reads its point (xyz, w: window depth) and runs the body, which writes `result`.
std::string fragment(const std::string& body) {
  return R"(
#include "gnomon.glsl"
#include "gnomon_cast.glsl"
uniform sampler2D points;
layout(location = 0) out vec4 result;
float gnomonCompare(int map, vec2 uv, float layer, float depth) {  // a pattern of texels, known to the test
  ivec2 texel = ivec2(floor(uv * gnomon.atlas.xy));
  return (texel.x * 7 + texel.y * 3) % 5 < 2 ? 1.0 : 0.0;
}
void main() {
  vec4 point = texelFetch(points, ivec2(gl_FragCoord.xy), 0);
  vec3 world = point.xyz;
)" + body + "}\n";
}

class Gpu {
 public:
  explicit Gpu(std::string version) : context_(createContext(defaultBackend(), 4, 5)), version_(std::move(version)) {
    gl::load(*context_);
    gl::GenVertexArrays(1, &vertexArray_);
    gl::GenBuffers(1, &buffer_);
  }

  // The body's result for each point.
  std::vector<glm::vec4> run(const std::string& body, const GnomonBlock& block, std::vector<glm::vec4> points) {
    const std::size_t count = points.size();
    const int height = static_cast<int>((count + kWidth - 1) / kWidth);
    points.resize(static_cast<std::size_t>(height) * kWidth, glm::vec4(0.0f));
    const GLuint program = buildProgram(version_, {{GL_VERTEX_SHADER, kVertex}, {GL_FRAGMENT_SHADER, fragment(body)}});
    const GLuint blockIndex = gl::GetUniformBlockIndex(program, "gnomonUniforms");
    if (blockIndex != GL_INVALID_INDEX) gl::UniformBlockBinding(program, blockIndex, 0);
    gl::BindBuffer(GL_UNIFORM_BUFFER, buffer_);
    gl::BufferData(GL_UNIFORM_BUFFER, sizeof block, &block, GL_STATIC_DRAW);
    gl::BindBufferBase(GL_UNIFORM_BUFFER, 0, buffer_);
    std::array<GLuint, 2> textures{};
    gl::GenTextures(2, textures.data());
    for (std::size_t i = 0; i < 2; ++i) {
      gl::ActiveTexture(GL_TEXTURE0);
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
    gl::DeleteProgram(program);
    return out;
  }

 private:
  std::unique_ptr<Context> context_;
  std::string version_;
  GLuint vertexArray_ = 0, buffer_ = 0;
};

// Window depth of a view depth in the closed forms of the errata to [Zhang 2006, sec. 3.6].
double windowReference(const Camera& camera, double z) {
  const double n = camera.near, f = camera.far;
  const bool isReversed = camera.depth == DepthConvention::reversedZeroToOne;
  if (camera.projection == Projection::orthographic) return isReversed ? (f - z) / (f - n) : (z - n) / (f - n);
  if (!std::isfinite(f)) return isReversed ? n / z : 1.0 - n / z;
  return isReversed ? n / (f - n) * (f / z - 1.0) : f / (f - n) * (1.0 - n / z);
}

struct Setting {
  std::string name;
  Frame frame;
  PssmSettings settings;
};

std::vector<Setting> allSettings(const std::vector<Box>& gapped) {
  std::vector<Setting> out;
  for (const DepthConvention depth : {DepthConvention::negativeOneToOne, DepthConvention::zeroToOne, DepthConvention::reversedZeroToOne})
    for (const int kind : {0, 1, 2, 3, 4}) {
      Frame frame = usualFrame();
      PssmSettings settings;
      std::string name = "depth " + std::to_string(static_cast<int>(depth)) + ", ";
      if (kind == 1) {  // asymmetric, sixteen maps
        frame.camera.left *= 0.3;
        frame.camera.up *= 1.4;
        frame.budget.partitions = 16;
        name += "asymmetric";
      } else if (kind == 2) {
        frame.camera.far = kInfinity;
        frame.camera.shadowDistance = 250.0;
        settings.fit = FitMode::slice;
        name += "infinite";
      } else if (kind == 3) {
        frame.camera = orthographic(frame.camera.positionWs, frame.camera.forwardWs, frame.camera.upWs, 20.0, 1.5, -15.0, 80.0);
        settings.fit = FitMode::stable;
        name += "orthographic";
      } else if (kind == 4) {
        frame.camera = perspective({0, 0, 0}, {0, 0, -1}, {0, 1, 0}, 1.0, 1.5, 0.5, 500.0);
        frame.scene.receivers = gapped;
        name += "receivers with a gap";
      } else {
        name += "plain";
      }
      frame.camera.depth = depth;
      frame.shadowMap.depth = depth;
      out.push_back({name, frame, settings});
    }
  return out;
}

class Parity : public ::testing::TestWithParam<const char*> {
 protected:
  const std::vector<Box> gapped_{{{-3, -3, -9}, {3, 3, -2}}, {{-90, -90, -400}, {90, 90, -200}}};
};

TEST_P(Parity, Selection) {
  Gpu gpu(GetParam());
  for (const Setting& setting : allSettings(gapped_)) {
    const auto solution = solve(setting.frame, setting.settings);
    ASSERT_EQ(solution->status, Status::ok) << setting.name;
    const GnomonBlock& block = solution->block;
    const Camera& camera = setting.frame.camera;
    const double near = camera.near, far = std::min(camera.far, camera.shadowDistance);
    Random random(91);
    std::vector<glm::vec4> points;  // x: view depth, w: window depth
    const auto add = [&](double z) { points.emplace_back(static_cast<float>(z), 0.0f, 0.0f, static_cast<float>(windowReference(camera, z))); };
    for (int i = 0; i < 8000; ++i) add(camera.projection == Projection::perspective ? random.logUniform(near * 0.5, far * 2.0) : random.uniform(near - 5.0, far + 5.0));
    for (int i = 0; i < solution->partitionCount; ++i)  // the splits themselves, and one float either side of what the block holds
      for (const double z : {solution->partitions[i].near, solution->partitions[i].far}) {
        add(z);
        const float window = block.windowStart[i / 4][i % 4] * block.depthRule.x, view = block.viewStart[i / 4][i % 4];
        for (const float away : {-3e38f, 3e38f}) points.emplace_back(std::nextafter(view, away), 0.0f, 0.0f, std::nextafter(window, away));
        points.emplace_back(view, 0.0f, 0.0f, window);
      }
    const auto results = gpu.run("  result = vec4(gnomonSelectWindow(gnomon, point.w), gnomonSelectView(gnomon, point.x), 0.0, 0.0);\n", block, points);
    int served = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      EXPECT_EQ(static_cast<int>(results[i].x), selectByWindowDepth(block, points[i].w)) << setting.name << " " << points[i].x;
      EXPECT_EQ(static_cast<int>(results[i].y), selectByViewDepth(block, points[i].x)) << setting.name << " " << points[i].x;
      if (i >= 8000) continue;
      const double z = points[i].x, ulp = 4.0 * 0x1p-23;
      bool isNearAnEnd = false;  // closer than four float steps of the window depth: rounding may decide
      for (int k = 0; k < solution->partitionCount; ++k)
        for (const double end : {solution->partitions[k].near, solution->partitions[k].far})
          isNearAnEnd |= std::abs(windowReference(camera, end) - windowReference(camera, z)) <= ulp || std::abs(end - z) <= ulp * (std::abs(z) + 1.0) * 4.0;
      if (isNearAnEnd) continue;
      const int expected = servedBy(*solution, z, 0.0);
      served += expected >= 0;
      EXPECT_EQ(static_cast<int>(results[i].x), expected) << setting.name << " " << z;
      EXPECT_EQ(static_cast<int>(results[i].y), expected) << setting.name << " " << z;
    }
    EXPECT_GT(served, 1000) << setting.name;
  }
}

TEST_P(Parity, Lookup) {
  Gpu gpu(GetParam());
  for (const Setting& setting : allSettings(gapped_)) {
    const auto solution = solve(setting.frame, setting.settings);
    Random random(92);
    std::vector<glm::vec4> points;  // w: partition
    std::vector<glm::dvec3> exact;
    for (int i = 0; i < 6000; ++i) {
      const int k = random.index(solution->partitionCount);
      const Partition& map = solution->partitions[k];
      const glm::vec3 rel(viewPoint(setting.frame.camera, random.uniform(), random.uniform(), random.uniform(map.near, map.far)));
      points.emplace_back(rel, static_cast<float>(k));
      exact.emplace_back(rel);
    }
    const auto results = gpu.run("  result = gnomonAtlas(gnomon, int(point.w), world);\n", solution->block, points);
    const auto casts = gpu.run("  result = gnomonCastPosition(gnomon, int(point.w), world);\n", solution->block, points);
    const auto wholes = gpu.run("  result = gnomonCastAtlas(gnomon, int(point.w), world);\n", solution->block, points);
    const auto depths = gpu.run("  result = vec4(gnomonViewDepth(gnomon, world), gnomonCastWindowDepth(gnomon, int(point.w), world), 0.0, 0.0);\n", solution->block, points);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const int k = static_cast<int>(points[i].w);
      const Partition& map = solution->partitions[k];
      // In double, from the draw matrix and the viewport: not the lookup matrix under test.
      const glm::dvec4 clip = glm::dmat4(map.clipFromWorld) * glm::dvec4(exact[i], 1.0);
      const glm::dvec2 texel = glm::dvec2(map.viewport.x, map.viewport.y) + (glm::dvec2(clip) / clip.w * 0.5 + 0.5) * glm::dvec2(map.viewport.z, map.viewport.w);
      EXPECT_NEAR(results[i].x * static_cast<double>(solution->atlas.x), texel.x, 1.0 / 64.0) << setting.name;  // two float matrices apart
      const glm::dvec3 reference = atlasPosition(solution->block, k, exact[i]);
      EXPECT_NEAR(results[i].x * static_cast<double>(solution->atlas.x), reference.x * solution->atlas.x, 1.0 / 256.0) << setting.name;
      EXPECT_NEAR(results[i].y * static_cast<double>(solution->atlas.y), reference.y * solution->atlas.y, 1.0 / 256.0) << setting.name;
      EXPECT_NEAR(results[i].z, std::clamp(reference.z, 0.0, 1.0), 1e-5) << setting.name;
      if (setting.frame.scene.receivers.empty()) {  // else the point need not be a receiver's
        EXPECT_EQ(results[i].w, 1.0f) << setting.name;
      }
      for (int c = 0; c < 4; ++c) EXPECT_NEAR(casts[i][c], clip[c], 1e-4);
      const glm::dvec2 whole = (glm::dvec2(wholes[i].x, wholes[i].y) / static_cast<double>(wholes[i].w) * 0.5 + 0.5) * glm::dvec2(solution->atlas);
      EXPECT_NEAR(whole.x, texel.x, 1.0 / 32.0);
      EXPECT_NEAR(whole.y, texel.y, 1.0 / 32.0);
      EXPECT_NEAR(depths[i].x, viewDepth(solution->block, exact[i]), 1e-5 * (1.0 + glm::length(exact[i])));
      EXPECT_NEAR(depths[i].y, reference.z, 1e-5);
    }
  }
}

// Bias: a point of a plane, moved as the shader moves it, clears the plane's depth anywhere in the filter's footprint, by no more than the bias.
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
    const glm::vec3 rel(viewPoint(frame.camera, random.uniform(), random.uniform(), random.uniform(solution->partitions[k].near, solution->partitions[k].far)));
    points.emplace_back(rel, static_cast<float>(k));
    normals.emplace_back(normal);
  }
  // One program for each normal would be slow: the normal of point i follows it as point i + n.
  const std::size_t n = points.size();
  for (const glm::vec3& normal : normals) points.emplace_back(normal, 0.0f);
  const std::string body = "  int at = int(gl_FragCoord.y) * 512 + int(gl_FragCoord.x) + " + std::to_string(n) +
                           ";\n  vec3 normal = texelFetch(points, ivec2(at % 512, at / 512), 0).xyz;\n  result = vec4(gnomonBias(gnomon, int(point.w), world, normal, 0.5) - world, 0.0);\n";
  const auto moved = gpu.run(body, solution->block, points);
  for (std::size_t i = 0; i < n; ++i) {
    const int k = static_cast<int>(points[i].w);
    const glm::dvec3 rel(points[i]), normal(normals[i]), offset(moved[i]);
    // World vectors of half a texel along s and t by differences of the lookup, in double.
    const glm::dvec3 a = glm::normalize(glm::cross(light, glm::dvec3(0.3, 0.4, 0.8))), b = glm::cross(light, a);
    const double step = 0.01 * solution->partitions[k].near;
    const auto texel = [&](const glm::dvec3& p) { return glm::dvec2(atlasPosition(solution->block, k, p)) * glm::dvec2(solution->atlas); };
    const glm::dvec2 da = (texel(rel + a * step) - texel(rel - a * step)) / (2.0 * step), db = (texel(rel + b * step) - texel(rel - b * step)) / (2.0 * step);
    const double det = da.x * db.y - db.x * da.y;
    const glm::dvec3 s = (a * db.y - b * da.y) / det, t = (b * da.x - a * db.x) / det;
    const double needed = 0.5 * (std::abs(glm::dot(normal, s)) + std::abs(glm::dot(normal, t)));  // height over the plane that its farthest texel corner asks for
    EXPECT_NEAR(glm::dot(offset, normal) / needed, 1.0, 1e-2);
    EXPECT_LT(glm::length(glm::cross(offset, normal)), 1e-5 * glm::length(rel) + 1e-2 * needed);
  }
}

// Filters against the sum of the hook's pattern worked out here.
TEST_P(Parity, FiltersSumTheirTexels) {
  Gpu gpu(GetParam());
  Frame frame = usualFrame();
  frame.margin.filter = 2.0;
  frame.bias = {.slope = 0.0, .constant = 0.0};
  const auto solution = solve(frame);
  const auto pattern = [](double x, double y) { return (static_cast<int>(std::floor(x)) * 7 + static_cast<int>(std::floor(y)) * 3) % 5 < 2 ? 1.0 : 0.0; };
  Random random(94);
  std::vector<glm::vec4> points;
  for (int i = 0; i < 3000; ++i) {
    const int k = random.index(solution->partitionCount);
    points.emplace_back(glm::vec3(viewPoint(frame.camera, random.uniform(), random.uniform(), random.uniform(solution->partitions[k].near, solution->partitions[k].far))), static_cast<float>(k));
  }
  const auto results = gpu.run(
      "  int k = int(point.w);\n  result = vec4(gnomonShadow(gnomon, 0, k, world, vec3(0.0, 1.0, 0.0)), gnomonShadow3x3(gnomon, 0, k, world, vec3(0.0, 1.0, 0.0)),\n"
      "                gnomonShadowTent(gnomon, 0, k, world, vec3(0.0, 1.0, 0.0)), gnomonShadow(gnomon, 0, -1, world, world));\n",
      solution->block, points);
  int checked = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const glm::dvec2 texel = glm::dvec2(atlasPosition(solution->block, static_cast<int>(points[i].w), glm::dvec3(points[i]))) * glm::dvec2(solution->atlas);
    const glm::dvec2 inTexel = glm::fract(texel), inTent = glm::fract(texel - 0.5);
    const double margin = 0.02;  // float rounding may choose the neighbour closer to a border than this
    if (std::min({inTexel.x, inTexel.y, inTent.x, inTent.y}) < margin || std::max({inTexel.x, inTexel.y, inTent.x, inTent.y}) > 1.0 - margin) continue;
    ++checked;
    double box = 0.0, tent = 0.0;
    for (int y = -1; y <= 1; ++y)
      for (int x = -1; x <= 1; ++x) box += pattern(texel.x + x, texel.y + y) / 9.0;
    for (int y = -2; y <= 2; ++y)  // every texel whose centre lies within the tent's half width of 2
      for (int x = -2; x <= 2; ++x) {
        const double cx = std::floor(texel.x) + 0.5 + x, cy = std::floor(texel.y) + 0.5 + y;
        const double weight = std::max(2.0 - std::abs(cx - texel.x), 0.0) * std::max(2.0 - std::abs(cy - texel.y), 0.0);
        tent += pattern(cx, cy) * weight / 16.0;
      }
    EXPECT_EQ(results[i].x, pattern(texel.x, texel.y));
    EXPECT_NEAR(results[i].y, box, 1e-5);
    EXPECT_NEAR(results[i].z, tent, 2e-3);
    EXPECT_EQ(results[i].w, 1.0f);  // no partition: lit
  }
  EXPECT_GT(checked, 2000);
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
  for (std::size_t i = 0; i < points.size(); ++i) EXPECT_NEAR(fades[i].x, std::clamp((50.1 - points[i].x) / 10.0, 0.0, 1.0), 1e-5) << points[i].x;
  // Far to the side of the first map: outside, lit.
  const auto outside = gpu.run("  result = vec4(gnomonAtlas(gnomon, 0, world).w, gnomonShadow(gnomon, 0, 0, world, vec3(0.0, 1.0, 0.0)), 0.0, 0.0);\n", solution->block,
                               {{1000.0f, 0.0f, 0.0f, 0.0f}, {0.0f, 0.0f, 900.0f, 0.0f}});
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
  for (int i = 0; i < 1000; ++i) points.emplace_back(glm::vec3(random.direction() * random.logUniform(0.01, 1e6)), static_cast<float>(random.uniform()));
  const auto results = gpu.run(
      "  int index = gnomonSelect(gnomon, point.w, world);\n  result = vec4(index, gnomonShadow(gnomon, 0, index, world, vec3(0.0, 1.0, 0.0)), gnomonFade(gnomon, gnomonViewDepth(gnomon, world)), "
      "gnomonSelectView(gnomon, gnomonViewDepth(gnomon, world)));\n",
      solution->block, points);
  for (const glm::vec4& each : results) EXPECT_EQ(each, glm::vec4(-1.0f, 1.0f, 1.0f, -1.0f));
}

INSTANTIATE_TEST_SUITE_P(Versions, Parity, ::testing::Values("330 core", "450"));

}  // namespace
}  // namespace gnomon::test
