#include "gpu.h"

#include <array>
#include <cstddef>

#include <gtest/gtest.h>

#include "translate.h"

namespace gnomon::test {

using namespace offscreen;

namespace {

const char* const kVertex =
    "void main() { vec2 p = vec2((gl_VertexID << 1) & 2, gl_VertexID & 2); gl_Position = vec4(p * 2.0 - 1.0, 0.0, 1.0); }\n";

// A host's shader says no precision but its sampler's: the includes have said the rest.
std::string fragment(int held, const std::string& hook, const std::string& body) {
  return "#define GNOMON_MAX_PARTITIONS " + std::to_string(held) + R"(
#include "gnomon.glsl"
#include "gnomon_cast.glsl"
#include "gnomon_sdsm.glsl"
uniform highp sampler2D points;
layout(location = 0) out vec4 result;
)" + hook +
         "void main() {\n  vec4 point = texelFetch(points, ivec2(gl_FragCoord.xy), 0);\n  vec3 world = point.xyz;\n  int index = "
         "int(point.w);\n" +
         body + "}\n";
}

// OpenGL 3.3 where the dialect asks no more, so that a driver with no more can run it.
std::unique_ptr<Context> contextFor(const Dialect& dialect) {
  if (dialect.profile == Profile::es) return createContext(Backend::egl, 3, std::string(dialect.version) == "300 es" ? 0 : 1, Profile::es);
  const bool isLeast = std::string(dialect.version) == "330 core";
  return createContext(defaultBackend(), isLeast ? 3 : 4, isLeast ? 3 : 5);
}

}  // namespace

const char* const kPattern = R"(
float gnomonCompare(int map, vec2 uv, float layer, float depth) {
  ivec2 texel = ivec2(floor(uv * gnomon.atlas.xy));
  return float((texel.x * 7 + texel.y * 3 + int(layer) * 11 + map * 5) % 8) / 8.0;
}
)";

double pattern(int x, int y, int layer, int map) { return ((x * 7 + y * 3 + layer * 11 + map * 5) % 8) / 8.0; }

Gpu::Gpu(const Dialect& dialect, int held) : dialect_(dialect), held_(held), context_(contextFor(dialect)) {
  gl::load(*context_);
  gl::GenVertexArrays(1, &vertexArray_);
  gl::GenBuffers(1, &buffer_);
}

Gpu::~Gpu() {
  for (const auto& [source, program] : programs_) gl::DeleteProgram(program);
  gl::DeleteBuffers(1, &buffer_);
  gl::DeleteVertexArrays(1, &vertexArray_);
}

std::string Gpu::ask(GLenum what) const { return reinterpret_cast<const char*>(gl::GetString(what)); }

std::vector<glm::vec4> Gpu::run(const std::string& body, const GnomonBlock& block, std::vector<glm::vec4> points, const std::string& hook) {
  const std::size_t count = points.size();
  const int height = static_cast<int>((count + kWidth - 1) / kWidth);
  points.resize(static_cast<std::size_t>(height) * kWidth, glm::vec4(0.0f));
  const std::string source = fragment(held_, hook, body);
  GLuint& program = programs_[source];
  if (program == 0) {
    const std::string text = dialect_.route == Route::plain    ? source
                             : dialect_.route == Route::vulkan ? throughVulkan(source)
                                                               : throughHlsl(source);
    program = buildProgram(dialect_.version, {{GL_VERTEX_SHADER, kVertex}, {GL_FRAGMENT_SHADER, text}});
  }
  const GLuint blockIndex = gl::GetUniformBlockIndex(program, "gnomonUniforms");
  if (blockIndex != GL_INVALID_INDEX) gl::UniformBlockBinding(program, blockIndex, 0);
  gl::BindBuffer(GL_UNIFORM_BUFFER, buffer_);
  const std::size_t bytes = offsetof(GnomonBlock, partitions) + static_cast<std::size_t>(held_) * sizeof(GnomonPartition);
  gl::BufferData(GL_UNIFORM_BUFFER, static_cast<GLsizeiptr>(bytes), &block, GL_STATIC_DRAW);
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
  gl::UseProgram(program);  // the one sampler reads unit 0, where uniforms begin
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

}  // namespace gnomon::test
