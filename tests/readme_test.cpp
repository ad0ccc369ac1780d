// The README's snippets: the C++ ones are compiled as they stand (tests/CMakeLists.txt cuts them out into readme_snippets.cpp), the GLSL ones
// and drawn with by a driver.
#include <algorithm>
#include <array>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "shader.h"
#include "support.h"

namespace {

std::vector<std::string> snippets(const std::string& language) {
  std::ifstream file(std::string(GNOMON_SOURCE_DIR) + "/README.md");
  std::vector<std::string> out;
  bool isInside = false;
  for (std::string line; std::getline(file, line);) {
    if (line.rfind("```", 0) == 0) {
      isInside = !isInside && line == "```" + language;
      if (isInside) out.emplace_back();
    } else if (isInside) {
      out.back() += line + "\n";
    }
  }
  return out;
}

TEST(Readme, ShaderSnippetsCompile) {
  const auto context = gnomon::offscreen::createContext(gnomon::offscreen::defaultBackend(), 4, 5);
  gnomon::offscreen::gl::load(*context);
  const std::vector<std::string> all = snippets("glsl");
  ASSERT_GE(all.size(), 2u);
  const std::string vertex =
      "out vec3 world; out vec3 normal;\nvoid main() { world = normal = vec3(1.0); gl_Position = vec4(world, 1.0); }\n";
  const auto compiles = [&](const std::string& fragment) {
    for (const char* version : {"330 core", "450"})
      EXPECT_NO_THROW((void)gnomon::offscreen::buildProgram(version, {{GL_VERTEX_SHADER, vertex}, {GL_FRAGMENT_SHADER, fragment}}))
          << fragment;
  };
  // The first screen's lines are statements with an include; the second snippet is global and gives the hook. Those that follow add to it, or,
  // with an include of their own, stand alone.
  const std::string interface = "in vec3 world; in vec3 normal; out vec4 colour;\n";
  const std::size_t body = all[0].find('\n') + 1;
  EXPECT_EQ(all[0].substr(0, body), "#include \"gnomon.glsl\"\n");
  compiles(all[1] + interface + "void main() {\n" + all[0].substr(body) + "colour = vec4(lit);\n}\n");
  for (std::size_t i = 2; i < all.size(); ++i) {
    const bool isWhole = all[i].find("#include") != std::string::npos;
    compiles((isWhole ? "" : all[1]) + all[i] + interface + "void main() { colour = vec4(world, 1.0); }\n");
  }
}

// The snippet that has a word.
std::string snippetWith(const std::string& word) {
  for (const std::string& snippet : snippets("glsl"))
    if (snippet.find(word) != std::string::npos) return snippet;
  return "";
}

namespace gl = gnomon::offscreen::gl;

const char* const kVertex = R"(
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 face;
uniform mat4 clipFromWorld;
out vec3 world, normal;
void main() {
  world = position;
  normal = face;
  gl_Position = clipFromWorld * vec4(position, 1.0);
}
)";
const char* const kScreen =
    "void main() { vec2 p = vec2((gl_VertexID << 1) & 2, gl_VertexID & 2); gl_Position = vec4(p * 2.0 - 1.0, 0.0, 1.0); }\n";
const char* const kOutputs = "layout(location = 0) out vec4 first;\nlayout(location = 1) out vec4 second;\n";

// Posts on a plain, drawn with the README's shader snippets under two lights.
class ReadmeDrawing : public ::testing::Test {
 protected:
  static constexpr int kWidth = 320, kHeight = 200;
  using Image = std::vector<glm::vec4>;

  ReadmeDrawing() : context_(gnomon::offscreen::createContext(gnomon::offscreen::defaultBackend(), 3, 3)) {
    gl::load(*context_);
    frame_.camera = gnomon::perspective({500.0, 4.0, -300.0}, {0.1, -0.2, -1.0}, {0.0, 1.0, 0.0}, 1.0, 1.6, 0.3, 60.0);
    frame_.image = {kWidth, kHeight};
    frame_.shadowMap.depth = gnomon::DepthConvention::negativeOneToOne;
    frame_.budget.resolution = 512;
    frame_.margin.blend = 0.2;
    frame_.fade = 0.3;
    const glm::dvec3 here(500.0, 0.0, -300.0);
    boxes_.push_back({here + glm::dvec3(-200, -3, -200), here + glm::dvec3(200, 0, 200)});
    for (int i = 0; i < 60; ++i) {
      const glm::dvec3 at = here + glm::dvec3((i * 37 % 61 - 30) * 0.25, 0.0, -2.0 - i);
      boxes_.push_back({at, at + glm::dvec3(0.6, 1.0 + i % 7, 0.6)});
    }
    std::vector<glm::vec3> vertices;
    for (const gnomon::Box& box : boxes_)
      for (int face = 0; face < 6; ++face)
        for (const int corner : {0, 1, 2, 2, 1, 3}) {
          const int axis = face / 2, u = (axis + 1) % 3, v = (axis + 2) % 3;
          glm::dvec3 position(0.0), normal(0.0);
          position[axis] = face % 2 ? box.maxWs[axis] : box.minWs[axis];
          position[u] = corner & 1 ? box.maxWs[u] : box.minWs[u];
          position[v] = corner & 2 ? box.maxWs[v] : box.minWs[v];
          normal[axis] = face % 2 ? 1.0 : -1.0;
          vertices.insert(vertices.end(), {glm::vec3(position - frame_.camera.positionWs), glm::vec3(normal)});
        }
    GLuint vertexArray = 0, buffer = 0;
    gl::GenVertexArrays(1, &vertexArray);
    gl::BindVertexArray(vertexArray);
    gl::GenBuffers(1, &buffer);
    gl::BindBuffer(GL_ARRAY_BUFFER, buffer);
    gl::BufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(vertices.size() * sizeof vertices[0]), vertices.data(), GL_STATIC_DRAW);
    for (GLuint i = 0; i < 2; ++i) {
      gl::EnableVertexAttribArray(i);
      gl::VertexAttribPointer(i, 3, GL_FLOAT, GL_FALSE, 2 * sizeof(glm::vec3), reinterpret_cast<const void*>(i * sizeof(glm::vec3)));
    }
    // What takes position - origin to clip space, depth -1 to 1, and its inverse.
    const gnomon::test::Axes axes(frame_.camera);
    const glm::dmat4 viewFromWorld(glm::transpose(glm::dmat3(axes.right, axes.up, axes.forward)));
    const gnomon::Camera& c = frame_.camera;
    glm::dmat4 clipFromView(0.0);
    clipFromView[0][0] = 1.0 / c.right;
    clipFromView[1][1] = 1.0 / c.up;
    clipFromView[2] = {0.0, 0.0, (c.far + c.near) / (c.far - c.near), 1.0};
    clipFromView[3][2] = -2.0 * c.far * c.near / (c.far - c.near);
    clipFromWorld_ = glm::mat4(clipFromView * viewFromWorld);
    worldFromClip_ = glm::mat4(glm::inverse(clipFromView * viewFromWorld));
    cast_ = gnomon::offscreen::buildProgram("330 core", {{GL_VERTEX_SHADER, kVertex}, {GL_FRAGMENT_SHADER, "void main() {}\n"}});
    gl::Enable(GL_DEPTH_TEST);
  }

  static GLuint makeTexture(GLint format, GLenum pixels, int width, int height) {
    GLuint texture = 0;
    gl::GenTextures(1, &texture);
    gl::BindTexture(GL_TEXTURE_2D, texture);
    gl::TexImage2D(GL_TEXTURE_2D, 0, format, width, height, 0, pixels, GL_FLOAT, nullptr);
    for (const GLenum filter : {GL_TEXTURE_MIN_FILTER, GL_TEXTURE_MAG_FILTER}) gl::TexParameteri(GL_TEXTURE_2D, filter, GL_NEAREST);
    return texture;
  }

  static GLuint upload(const gnomon::GnomonBlock& block) {
    GLuint buffer = 0;
    gl::GenBuffers(1, &buffer);
    gl::BindBuffer(GL_UNIFORM_BUFFER, buffer);
    gl::BufferData(GL_UNIFORM_BUFFER, sizeof block, &block, GL_STATIC_DRAW);
    return buffer;
  }

  void drawBoxes(GLuint program, const glm::mat4& clip, const gnomon::Partition* map) const {
    gl::UseProgram(program);
    gl::UniformMatrix4fv(gl::GetUniformLocation(program, "clipFromWorld"), 1, GL_FALSE, &clip[0][0]);
    for (std::size_t i = 0; i < boxes_.size(); ++i)
      if (!map || gnomon::mayCast(*map, boxes_[i])) gl::DrawArrays(GL_TRIANGLES, static_cast<GLint>(36 * i), 36);
  }

  // The shadow maps of a solution, as a texture that compares.
  GLuint drawMaps(const gnomon::Solution& solution) const {
    const GLuint texture = makeTexture(GL_DEPTH_COMPONENT32F, GL_DEPTH_COMPONENT, solution.atlas.x, solution.atlas.y);
    gl::TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_COMPARE_MODE, GL_COMPARE_REF_TO_TEXTURE);
    GLuint target = 0;
    gl::GenFramebuffers(1, &target);
    gl::BindFramebuffer(GL_FRAMEBUFFER, target);
    gl::FramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_TEXTURE_2D, texture, 0);
    gl::DrawBuffer(GL_NONE);
    gl::Clear(GL_DEPTH_BUFFER_BIT);
    if (solution.depthClamp) gl::Enable(GL_DEPTH_CLAMP);
    for (int i = 0; i < solution.partitionCount; ++i) {
      const gnomon::Partition& map = solution.partitions[i];
      gl::Viewport(map.viewport.x, map.viewport.y, map.viewport.z, map.viewport.w);
      drawBoxes(cast_, map.clipFromWorld, &map);
    }
    gl::Disable(GL_DEPTH_CLAMP);
    return texture;
  }

  struct Drawn {
    std::array<Image, 2> images;
    GLuint depth = 0, second = 0;
  };

  // The boxes through the camera, or a triangle over the screen.
  Drawn draw(GLuint program, bool isScreen) const {
    const std::array<GLuint, 2> colours{makeTexture(GL_RGBA32F, GL_RGBA, kWidth, kHeight),
                                        makeTexture(GL_RGBA32F, GL_RGBA, kWidth, kHeight)};
    Drawn out{{Image(kWidth * kHeight), Image(kWidth * kHeight)},
              makeTexture(GL_DEPTH_COMPONENT32F, GL_DEPTH_COMPONENT, kWidth, kHeight),
              colours[1]};
    GLuint target = 0;
    gl::GenFramebuffers(1, &target);
    gl::BindFramebuffer(GL_FRAMEBUFFER, target);
    const std::array<GLenum, 2> attachments{GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1};
    for (std::size_t i = 0; i < 2; ++i) gl::FramebufferTexture2D(GL_FRAMEBUFFER, attachments[i], GL_TEXTURE_2D, colours[i], 0);
    gl::FramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_TEXTURE_2D, out.depth, 0);
    gl::DrawBuffers(2, attachments.data());
    const std::array<float, 4> nothing{-9.0f, -9.0f, -9.0f, -9.0f};
    for (GLint i = 0; i < 2; ++i) gl::ClearBufferfv(GL_COLOR, i, nothing.data());
    gl::Clear(GL_DEPTH_BUFFER_BIT);
    gl::Viewport(0, 0, kWidth, kHeight);
    bindTextures();
    if (isScreen) {
      gl::UseProgram(program);
      gl::Disable(GL_DEPTH_TEST);
      gl::DrawArrays(GL_TRIANGLES, 0, 3);
      gl::Enable(GL_DEPTH_TEST);
    } else {
      drawBoxes(program, clipFromWorld_, nullptr);
    }
    for (std::size_t i = 0; i < 2; ++i) {
      gl::ReadBuffer(attachments[i]);
      gl::ReadPixels(0, 0, kWidth, kHeight, GL_RGBA, GL_FLOAT, out.images[i].data());
    }
    EXPECT_EQ(gl::GetError(), static_cast<GLenum>(GL_NO_ERROR));
    return out;
  }

  // A program of the snippets, its blocks and samplers at units in the order given.
  GLuint build(const char* vertex, const std::string& fragment, const std::vector<const char*>& blocks,
               const std::vector<const char*>& samplers) const {
    const GLuint program = gnomon::offscreen::buildProgram("330 core", {{GL_VERTEX_SHADER, vertex}, {GL_FRAGMENT_SHADER, fragment}});
    for (std::size_t i = 0; i < blocks.size(); ++i)
      gl::UniformBlockBinding(program, gl::GetUniformBlockIndex(program, blocks[i]), static_cast<GLuint>(i));
    gl::UseProgram(program);
    for (std::size_t i = 0; i < samplers.size(); ++i) gl::Uniform1i(gl::GetUniformLocation(program, samplers[i]), static_cast<GLint>(i));
    gl::UniformMatrix4fv(gl::GetUniformLocation(program, "worldFromClip"), 1, GL_FALSE, &worldFromClip_[0][0]);
    return program;
  }

  void bindTextures() const {
    for (std::size_t i = 0; i < units_.size(); ++i) {
      gl::ActiveTexture(GL_TEXTURE0 + static_cast<GLenum>(i));
      gl::BindTexture(GL_TEXTURE_2D, units_[i]);
    }
    gl::ActiveTexture(GL_TEXTURE0 + static_cast<GLenum>(units_.size()));
  }

  [[nodiscard]] std::unique_ptr<gnomon::Solution> solveFor(const glm::dvec3& light) {
    frame_.light.directionWs = light;
    return gnomon::test::solve(frame_);
  }

  // Whether a box stands between a point and the light.
  [[nodiscard]] bool isShadowed(const glm::dvec3& ws, const glm::dvec3& light) const {
    for (const gnomon::Box& box : boxes_) {
      const glm::dvec3 a = (box.minWs - ws) / -light, b = (box.maxWs - ws) / -light, enter = glm::min(a, b), leave = glm::max(a, b);
      if (std::max({enter.x, enter.y, enter.z, 0.0}) < std::min({leave.x, leave.y, leave.z})) return true;
    }
    return false;
  }

  std::unique_ptr<gnomon::offscreen::Context> context_;
  gnomon::Frame frame_;
  std::vector<gnomon::Box> boxes_;
  glm::mat4 clipFromWorld_{1.0f}, worldFromClip_{1.0f};
  GLuint cast_ = 0;
  std::vector<GLuint> units_;  // textures to draw with
  const glm::dvec3 sun_{0.5, -0.7, 0.3}, moon_{-0.6, -0.5, -0.4};
};

const char* const kForward = R"(
in vec3 world, normal;
void main() {
  int index = gnomonSelect(gnomon, gl_FragCoord.z, world);
  first = vec4(gnomonShadow(gnomon, 0, index, world, normal), litSmoothly(index, world, normal), litAt(0.9 * world), float(index));
  second = vec4(normal, gnomonViewDepth(gnomon, world));
}
)";

TEST_F(ReadmeDrawing, ForwardDeferredFogFadeAndBlendAgree) {
  const auto solution = solveFor(sun_);
  ASSERT_EQ(solution->partitionCount, 4);
  units_ = {drawMaps(*solution)};
  gl::BindBufferBase(GL_UNIFORM_BUFFER, 0, upload(solution->block));
  const std::string hook = snippetWith("float gnomonCompare");
  const GLuint forward =
      build(kVertex, hook + snippetWith("litSmoothly") + snippetWith("litAt") + kOutputs + kForward, {"gnomonUniforms"}, {"shadowMaps"});
  const Drawn drawn = draw(forward, false);
  const GLuint deferred = build(kScreen, hook + snippetWith("litDeferred") + kOutputs + R"(
uniform sampler2D normals, depths;
uniform mat4 worldFromClip;
void main() {
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  float depth = texelFetch(depths, pixel, 0).r;
  vec2 uv = gl_FragCoord.xy / vec2(textureSize(depths, 0));
  first = vec4(litDeferred(worldFromClip, uv, depth, texelFetch(normals, pixel, 0).xyz), float(gnomonSelectWindow(gnomon, depth)), 0.0, 0.0);
}
)",
                                {"gnomonUniforms"}, {"shadowMaps", "normals", "depths"});
  units_.insert(units_.end(), {drawn.second, drawn.depth});
  const Drawn second = draw(deferred, true);

  int seen = 0, differs = 0, otherMap = 0, inBand = 0, faded = 0, fogWrong = 0, fogSeen = 0, dark = 0;
  const double far = 60.0, near = solution->partitions[0].near;
  for (std::size_t i = 0; i < drawn.images[0].size(); ++i) {
    const glm::vec4 &first = drawn.images[0][i], &geometry = drawn.images[1][i];
    if (first.w < 0.0f) continue;
    ++seen;
    dark += first.x == 0.0f;
    differs += first.x != second.images[0][i].x;
    otherMap += first.w != second.images[0][i].y;
    const double z = geometry.w, fade = std::clamp((far - z) / (0.3 * (far - near)), 0.0, 1.0);
    const gnomon::Partition& map = solution->partitions[static_cast<int>(first.w)];
    const bool isBlended = first.w < 3.0f && z > map.far - 0.2 * (map.far - map.near) - 1e-3;
    inBand += isBlended;
    faded += fade < 1.0;
    if (!isBlended) {
      ASSERT_NEAR(first.y, 1.0 - fade * (1.0 - static_cast<double>(first.x)), 1e-3) << z;
    }
    const double x = (static_cast<double>(i % kWidth) + 0.5) / kWidth, y = (static_cast<double>(i / kWidth) + 0.5) / kHeight;
    const glm::dvec3 fog =
        frame_.camera.positionWs + gnomon::test::viewPoint(frame_.camera, x, y, 0.9 * z);  // in the air before the surface
    if (0.9 * z < near) continue;
    ++fogSeen;
    fogWrong += (first.z == 0.0f) != isShadowed(fog, sun_);
  }
  EXPECT_GT(seen, kWidth * kHeight / 2);
  EXPECT_GT(dark, seen / 20);
  EXPECT_GT(inBand, seen / 20);
  EXPECT_GT(faded, seen / 50);
  EXPECT_LE(differs, seen / 200);  // float32 depth holds the position to a few units in the last place
  EXPECT_LE(otherMap, seen / 500);
  EXPECT_LE(fogWrong, fogSeen / 50);
}

TEST_F(ReadmeDrawing, OneShaderHoldsTwoLights) {
  const std::string hook = snippetWith("float gnomonCompare");
  std::array<Image, 2> alone;
  std::vector<GLuint> maps, blocks;
  const GLuint forward =
      build(kVertex, hook + snippetWith("litSmoothly") + snippetWith("litAt") + kOutputs + kForward, {"gnomonUniforms"}, {"shadowMaps"});
  for (const glm::dvec3& light : {sun_, moon_}) {
    const auto solution = solveFor(light);
    maps.push_back(drawMaps(*solution));
    blocks.push_back(upload(solution->block));
    units_ = {maps.back()};
    gl::BindBufferBase(GL_UNIFORM_BUFFER, 0, blocks.back());
    alone[maps.size() - 1] = draw(forward, false).images[0];
  }
  const GLuint both = build(kVertex, snippetWith("litBy") + kOutputs + R"(
in vec3 world, normal;
void main() {
  first = vec4(litBy(gl_FragCoord.z, world, normal), 0.0, 1.0);
  second = first;
}
)",
                            {"Sun", "Moon"}, {"sunMaps", "moonMaps"});
  units_ = maps;
  for (GLuint i = 0; i < 2; ++i) gl::BindBufferBase(GL_UNIFORM_BUFFER, i, blocks[i]);
  const Image together = draw(both, false).images[0];
  int seen = 0, unlike = 0;
  for (std::size_t i = 0; i < together.size(); ++i) {
    if (together[i].w < 0.0f) continue;
    ++seen;
    unlike += together[i].x != together[i].y;
    ASSERT_EQ(together[i].x, alone[0][i].x) << i;
    ASSERT_EQ(together[i].y, alone[1][i].x) << i;
  }
  EXPECT_GT(seen, kWidth * kHeight / 2);
  EXPECT_GT(unlike, seen / 50);
}

// The block's size that the README states.
TEST(Readme, StatesTheBlocksSize) {
  std::ifstream file(std::string(GNOMON_SOURCE_DIR) + "/README.md");
  std::ostringstream text;
  text << file.rdbuf();
  EXPECT_NE(text.str().find("4736 bytes"), std::string::npos);  // 640 + 16 * 256, asserted in solver/block.cpp
}

}  // namespace
