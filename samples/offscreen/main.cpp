// offscreen: draws the README's picture. Matrices in, block out; shadow maps drawn into one atlas; one lookup for each pixel.
//
// Plain OpenGL 3.3, without a window. Scene, context and files come from the folder's library; everything that concerns shadows is here.
#include <cstdio>

#include <glm/ext/matrix_clip_space.hpp>
#include <glm/ext/matrix_transform.hpp>
#include <glm/glm.hpp>

#include "gnomon/gnomon.h"
#include "picture.h"
#include "scene.h"
#include "shader.h"

namespace {

using namespace gnomon::offscreen;
constexpr int kWidth = 1280, kHeight = 720;
constexpr const char* kCastVertex = R"(
#include "gnomon_cast.glsl"
layout(location = 0) in vec3 world;  // world - origin, as everywhere
uniform int index;
void main() { gl_Position = gnomonCastPosition(gnomon, index, world); }
)";
constexpr const char* kViewVertex = R"(
layout(location = 0) in vec3 position;
layout(location = 1) in vec3 faceNormal;
uniform mat4 clipFromWorld;
out vec3 world, normal;
void main() {
  world = position;
  normal = faceNormal;
  gl_Position = clipFromWorld * vec4(position, 1.0);
}
)";
constexpr const char* kViewFragment = R"(
#include "gnomon.glsl"
uniform sampler2DShadow atlas;
float gnomonCompare(int map, vec2 uv, float layer, float depth) { return texture(atlas, vec3(uv, depth)); }
in vec3 world, normal;
out vec4 colour;
void main() {
  vec3 face = normalize(normal);
  if (dot(face, world) > 0.0) face = -face;  // the eye is at 0
  float lit = gnomonShadow(gnomon, 0, gnomonSelect(gnomon, gl_FragCoord.z, world), world, face);
  vec3 sky = mix(vec3(0.2, 0.19, 0.18), vec3(0.24, 0.33, 0.5), 0.5 + 0.5 * face.y);
  float sun = 0.85 * lit * max(dot(face, -gnomon.lightDirection.xyz), 0.0);
  colour = vec4(pow(0.78 * (0.75 * sky + sun * vec3(1.0, 0.93, 0.8)), vec3(1.0 / 2.2)), 1.0);
}
)";

}  // namespace

int main(int argc, char** argv) {
  const BuiltIn scene = makeBuiltIn("city");
  const View& view = scene.views[0];
  const glm::dvec3 eye = view.cam.positionWs, ahead = view.cam.forwardWs, up(0.0, 1.0, 0.0);
  const glm::dmat4 clipFromView = glm::perspective(glm::radians(60.0), 16.0 / 9.0, view.cam.near, view.cam.far);

  gnomon::Frame frame;
  gnomon::Solution solution;
  frame.image = {kWidth, kHeight};
  frame.light.directionWs = view.lightDirectionWs;
  frame.shadowMap.depth = gnomon::DepthConvention::negativeOneToOne;  // OpenGL's own
  const gnomon::Box everything{scene.mesh.min, scene.mesh.max};
  frame.scene.receivers = {&everything, 1};
  gnomon::Status status = gnomon::cameraFromMatrices(glm::lookAt(eye, eye + ahead, up), clipFromView,
                                                     gnomon::DepthConvention::negativeOneToOne, frame.image, {0.0, 0.0}, frame.camera);
  if (status == gnomon::Status::ok) status = gnomon::solvePssm(frame, {}, solution);
  if (status != gnomon::Status::ok) {
    std::fprintf(stderr, "%s %s\n", gnomon::statusField(status), gnomon::statusRule(status));
    return 1;
  }
  const std::unique_ptr<Context> context = createContext(defaultBackend(), 3, 3);
  gl::load(*context);

  // Triangles with their face normals, relative to the origin: subtracted in double.
  std::vector<glm::vec3> vertices;
  for (std::size_t i = 0; i < scene.mesh.indices.size(); i += 3) {
    glm::dvec3 corner[3];
    for (std::size_t k = 0; k < 3; ++k) corner[k] = glm::dvec3(scene.mesh.positionsWs[scene.mesh.indices[i + k]]) - solution.originWs;
    const glm::vec3 normal(glm::cross(corner[1] - corner[0], corner[2] - corner[0]));
    for (const glm::dvec3& position : corner) vertices.insert(vertices.end(), {glm::vec3(position), normal});
  }
  GLuint vertexArray = 0, buffers[2] = {}, textures[3] = {}, targets[2] = {};
  gl::GenVertexArrays(1, &vertexArray);
  gl::BindVertexArray(vertexArray);
  gl::GenBuffers(2, buffers);
  gl::BindBuffer(GL_ARRAY_BUFFER, buffers[0]);
  gl::BufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(vertices.size() * sizeof vertices[0]), vertices.data(), GL_STATIC_DRAW);
  for (GLuint i = 0; i < 2; ++i) {
    gl::EnableVertexAttribArray(i);
    gl::VertexAttribPointer(i, 3, GL_FLOAT, GL_FALSE, 2 * sizeof(glm::vec3), reinterpret_cast<const void*>(i * sizeof(glm::vec3)));
  }
  const auto draw = [&] { gl::DrawArrays(GL_TRIANGLES, 0, static_cast<GLsizei>(vertices.size() / 2)); };
  // The block, and the two programs that read it.
  gl::BindBuffer(GL_UNIFORM_BUFFER, buffers[1]);
  gl::BufferData(GL_UNIFORM_BUFFER, sizeof solution.block, &solution.block, GL_DYNAMIC_DRAW);
  gl::BindBufferBase(GL_UNIFORM_BUFFER, 0, buffers[1]);
  const GLuint cast = buildProgram("330 core", {{GL_VERTEX_SHADER, kCastVertex}, {GL_FRAGMENT_SHADER, "void main() {}\n"}});
  const GLuint shade = buildProgram("330 core", {{GL_VERTEX_SHADER, kViewVertex}, {GL_FRAGMENT_SHADER, kViewFragment}});
  for (const GLuint program : {cast, shade}) gl::UniformBlockBinding(program, gl::GetUniformBlockIndex(program, "gnomonUniforms"), 0);

  // Textures: the atlas (bound from here on), and what the camera draws into.
  gl::GenTextures(3, textures);
  gl::GenFramebuffers(2, targets);
  const auto attach = [&](int texture, int target, GLenum attachment, GLint format, GLenum pixels, glm::ivec2 size) {
    gl::BindTexture(GL_TEXTURE_2D, textures[texture]);
    gl::TexImage2D(GL_TEXTURE_2D, 0, format, size.x, size.y, 0, pixels, GL_FLOAT, nullptr);
    for (const GLenum filter : {GL_TEXTURE_MIN_FILTER, GL_TEXTURE_MAG_FILTER}) gl::TexParameteri(GL_TEXTURE_2D, filter, GL_NEAREST);
    gl::BindFramebuffer(GL_FRAMEBUFFER, targets[target]);
    gl::FramebufferTexture2D(GL_FRAMEBUFFER, attachment, GL_TEXTURE_2D, textures[texture], 0);
  };
  attach(1, 1, GL_COLOR_ATTACHMENT0, GL_RGBA8, GL_RGBA, {kWidth, kHeight});
  attach(2, 1, GL_DEPTH_ATTACHMENT, GL_DEPTH_COMPONENT32F, GL_DEPTH_COMPONENT, {kWidth, kHeight});
  attach(0, 0, GL_DEPTH_ATTACHMENT, GL_DEPTH_COMPONENT32F, GL_DEPTH_COMPONENT, solution.atlas);
  gl::TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_COMPARE_MODE, GL_COMPARE_REF_TO_TEXTURE);
  gl::DrawBuffer(GL_NONE);

  // The shadow maps.
  gl::Enable(GL_DEPTH_TEST);
  if (solution.depthClamp) gl::Enable(GL_DEPTH_CLAMP);
  gl::Clear(GL_DEPTH_BUFFER_BIT);
  gl::UseProgram(cast);
  for (int i = 0; i < solution.partitionCount; ++i) {  // one mesh: every map draws it whole
    const glm::ivec4& viewport = solution.partitions[i].viewport;
    gl::Viewport(viewport.x, viewport.y, viewport.z, viewport.w);
    gl::Uniform1i(gl::GetUniformLocation(cast, "index"), i);
    draw();
  }
  gl::Disable(GL_DEPTH_CLAMP);

  // The view.
  gl::BindFramebuffer(GL_FRAMEBUFFER, targets[1]);
  gl::Viewport(0, 0, kWidth, kHeight);
  gl::Clear(GL_DEPTH_BUFFER_BIT);
  gl::ClearBufferfv(GL_COLOR, 0, &glm::vec4(0.68f, 0.78f, 0.9f, 1.0f)[0]);
  gl::UseProgram(shade);
  const glm::mat4 clipFromWorld(clipFromView * glm::lookAt(eye - solution.originWs, eye - solution.originWs + ahead, up));
  gl::UniformMatrix4fv(gl::GetUniformLocation(shade, "clipFromWorld"), 1, GL_FALSE, &clipFromWorld[0][0]);
  draw();

  std::vector<std::uint8_t> pixels(3 * kWidth * kHeight), rows;
  gl::ReadPixels(0, 0, kWidth, kHeight, GL_RGB, GL_UNSIGNED_BYTE, pixels.data());
  for (int y = kHeight; y-- > 0;) rows.insert(rows.end(), pixels.begin() + 3 * kWidth * y, pixels.begin() + 3 * kWidth * (y + 1));
  writePng(argc > 1 ? argv[1] : "picture.png", kWidth, kHeight, 3, rows);
  return gl::GetError() == GL_NO_ERROR ? 0 : 1;
}
