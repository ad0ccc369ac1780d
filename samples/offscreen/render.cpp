#include "render.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <functional>
#include <numeric>

#include <glm/glm.hpp>

#include "gl.h"
#include "gnomon/cast.h"
#include "gnomon/pssm.h"
#include "sampled_maps.h"
#include "shader.h"

namespace gnomon::offscreen {
namespace {

constexpr const char* kCastVertex = R"(
#include "gnomon_cast.glsl"
layout(location = 0) in vec3 world;
uniform int index;
void main() { gl_Position = gnomonCastPosition(gnomon, index, world); }
)";

constexpr const char* kCastFragment = R"(
void main() {}
)";

constexpr const char* kFlatVertex = R"(
#include "gnomon_cast.glsl"
layout(location = 0) in vec3 world;
uniform int index;
out float depth;
void main() {
  gl_Position = gnomonCastFlat(gnomonCastPosition(gnomon, index, world));
  depth = gnomonCastWindowDepth(gnomon, index, world);
}
)";

constexpr const char* kFlatFragment = R"(
#include "gnomon_cast.glsl"
in float depth;
void main() { gl_FragDepth = gnomonCastDepth(depth); }
)";

constexpr const char* kAtlasVertex = R"(
#include "gnomon_cast.glsl"
layout(location = 0) in vec3 world;
layout(location = 1) in int map;  // the instance: gl_InstanceID would leave out where an indirect draw begins to count
out float gl_ClipDistance[4];
void main() {
  gl_Position = gnomonCastAtlas(gnomon, map, world);
  vec4 inside = gnomonCastClip(gnomon, map, world);
  for (int i = 0; i < 4; ++i) gl_ClipDistance[i] = inside[i];
}
)";

constexpr const char* kLayerVertex = R"(
layout(location = 0) in vec3 position;
out vec3 world;
void main() { world = position; }
)";

constexpr const char* kLayerGeometry = R"(
#include "gnomon_cast.glsl"
layout(triangles) in;
layout(triangle_strip, max_vertices = 48) out;  // three for each of GNOMON_MAX_PARTITIONS maps
in vec3 world[];
void main() {
  for (int index = 0; index < int(gnomon.info.x); ++index) {
    for (int i = 0; i < 3; ++i) {
      gl_Layer = gnomonCastLayer(gnomon, index);
      gl_Position = gnomonCastPosition(gnomon, index, world[i]);
      EmitVertex();
    }
    EndPrimitive();
  }
}
)";

constexpr const char* kViewVertex = R"(
layout(location = 0) in vec3 position;
uniform mat4 clipFromWorld;
out vec3 world;
void main() {
  world = position;
  gl_Position = clipFromWorld * vec4(position, 1.0);
}
)";

constexpr const char* kViewFragment = R"(
#include "gnomon.glsl"
uniform sampler2DArray maps;
uniform sampler2D normals;  // one texel for each triangle
uniform int isReversed, selection;  // by window depth, view depth or mask
uniform vec3 eye, towardsEye;  // eye - origin; or, for an orthographic view, the direction back to it
uniform float eyeShare;        // 1 perspective, 0 orthographic
in vec3 world;
layout(location = 0) out vec4 outPosition;  // w: lit share
layout(location = 1) out vec4 outNormal;    // w: partition
layout(location = 2) out vec4 outTint;      // w: texel border

float gnomonCompare(int map, vec2 uv, float layer, float depth) {
  float texel = texelFetch(maps, ivec3(ivec2(uv * vec2(textureSize(maps, 0).xy)), int(layer)), 0).r;
  return (isReversed != 0 ? depth >= texel : depth <= texel) ? 1.0 : 0.0;
}

void main() {
  int width = textureSize(normals, 0).x;
  vec3 normal = texelFetch(normals, ivec2(gl_PrimitiveID % width, gl_PrimitiveID / width), 0).xyz;
  vec3 back = mix(towardsEye, eye - world, eyeShare);
  if (dot(normal, back) < 0.0) normal = -normal;
  float viewDepth = gnomonViewDepth(gnomon, world);
  int index = -1;
  if (selection == 0) index = gnomonSelect(gnomon, gl_FragCoord.z, world);
  if (selection == 1) index = gnomonSelectView(gnomon, viewDepth);
  if (selection == 2) index = gnomonSelectMask(gnomon, world);
  float lit = SHADOW(gnomon, 0, index, world, normal);
  outPosition = vec4(world, mix(1.0, lit, gnomonFade(gnomon, viewDepth)));
  outNormal = vec4(normal, float(index));
  outTint = vec4(gnomonTint(index), gnomonGrid(gnomon, index, world));
}
)";

constexpr const char* kDepthVertex = R"(
layout(location = 0) in vec3 position;
uniform mat4 clipFromWorld;
void main() { gl_Position = clipFromWorld * vec4(position, 1.0); }
)";

// By Filter. A program for each: a branch would put the cost of all three into every frame.
constexpr std::array<const char*, 3> kShadowFunctions{"gnomonShadow", "gnomonShadow3x3", "gnomonShadowTent"};

using Clock = std::chrono::steady_clock;

double millisecondsSince(Clock::time_point start) { return std::chrono::duration<double, std::milli>(Clock::now() - start).count(); }

std::uint32_t spread(std::uint32_t x) {
  x = (x | (x << 16)) & 0x030000ffu;
  x = (x | (x << 8)) & 0x0300f00fu;
  x = (x | (x << 4)) & 0x030c30c3u;
  return (x | (x << 2)) & 0x09249249u;
}

// Orders triangles along a Morton curve and cuts them into chunks.
std::vector<Chunk> makeChunks(const Mesh& mesh, std::vector<std::uint32_t>& indices) {
  constexpr std::size_t kChunkTriangles = 1024;
  const std::size_t triangles = mesh.indices.size() / 3;
  const auto corner = [&](std::size_t triangle, std::size_t i) { return glm::dvec3(mesh.positionsWs[mesh.indices[3 * triangle + i]]); };
  const glm::dvec3 size = glm::max(mesh.max - mesh.min, glm::dvec3(1e-30));
  std::vector<std::pair<std::uint32_t, std::uint32_t>> order(triangles);
  for (std::size_t t = 0; t < triangles; ++t) {
    const glm::dvec3 centre = glm::clamp(((corner(t, 0) + corner(t, 1) + corner(t, 2)) / 3.0 - mesh.min) / size, 0.0, 1.0) * 1023.0;
    const glm::uvec3 cell(centre);
    order[t] = {spread(cell.x) | (spread(cell.y) << 1) | (spread(cell.z) << 2), static_cast<std::uint32_t>(t)};
  }
  std::sort(order.begin(), order.end());
  indices.clear();
  std::vector<Chunk> chunks;
  for (std::size_t from = 0; from < triangles; from += kChunkTriangles) {
    const std::size_t to = std::min(from + kChunkTriangles, triangles);
    Chunk chunk{{glm::dvec3(kInfinity), glm::dvec3(-kInfinity)}, 3 * from, 3 * (to - from)};
    for (std::size_t t = from; t < to; ++t)
      for (std::size_t i = 0; i < 3; ++i) {
        indices.push_back(mesh.indices[3 * order[t].second + i]);
        chunk.bounds.minWs = glm::min(chunk.bounds.minWs, corner(order[t].second, i));
        chunk.bounds.maxWs = glm::max(chunk.bounds.maxWs, corner(order[t].second, i));
      }
    chunks.push_back(chunk);
  }
  return chunks;
}

struct ViewAxes {
  glm::dvec3 right, up, forward;
};

ViewAxes axesOf(const Camera& camera) {
  const glm::dvec3 forward = glm::normalize(camera.forwardWs), right = glm::normalize(glm::cross(forward, camera.upWs));
  return {right, glm::cross(right, forward), forward};
}

// The engine's camera: clip space of the view in its own depth convention, from world - origin.
glm::mat4 clipFromRelative(const Camera& camera, const glm::dvec3& originWs) {
  const auto [right, up, forward] = axesOf(camera);
  const glm::dvec3 eye = camera.positionWs - originWs;
  const auto row = [&](const glm::dvec3& axis) { return glm::dvec4(axis, -glm::dot(axis, eye)); };
  const glm::dvec4 x = row(right), y = row(up), z = row(forward), one(0.0, 0.0, 0.0, 1.0);
  const bool isPerspective = camera.projection == Projection::perspective;
  const glm::dvec4 k = isPerspective ? z : one;
  const double n = camera.near, f = camera.far, width = camera.left + camera.right, height = camera.down + camera.up;
  glm::dvec4 depth;
  if (!std::isfinite(f)) {
    depth = camera.depth == DepthConvention::negativeOneToOne ? z - one * (2.0 * n)
            : camera.depth == DepthConvention::zeroToOne      ? z - one * n
                                                              : one * n;
  } else {
    const glm::dvec4 fromNear = (isPerspective ? f : 1.0) * (z - one * n) / (f - n),
                     fromFar = (isPerspective ? n : 1.0) * (one * f - z) / (f - n);
    depth = camera.depth == DepthConvention::negativeOneToOne ? fromNear - fromFar
            : camera.depth == DepthConvention::zeroToOne      ? fromNear
                                                              : fromFar;
  }
  return glm::mat4(glm::transpose(
      glm::dmat4((2.0 * x - (camera.right - camera.left) * k) / width, (2.0 * y - (camera.up - camera.down) * k) / height, depth, k)));
}

void setConvention(DepthConvention depth, bool isFromTop) {
  gl::ClipControl(isFromTop ? GL_UPPER_LEFT : GL_LOWER_LEFT,
                  depth == DepthConvention::negativeOneToOne ? GL_NEGATIVE_ONE_TO_ONE : GL_ZERO_TO_ONE);
  const bool isReversed = depth == DepthConvention::reversedZeroToOne;
  gl::DepthFunc(isReversed ? GL_GEQUAL : GL_LEQUAL);  // depth far away may round to what clears the buffer
  gl::ClearDepth(isReversed ? 0.0 : 1.0);
}

std::uint8_t toByte(double linear) {
  const double c = std::clamp(linear, 0.0, 1.0), encoded = c <= 0.0031308 ? 12.92 * c : 1.055 * std::pow(c, 1.0 / 2.4) - 0.055;
  return static_cast<std::uint8_t>(std::lround(encoded * 255.0));
}

class Texture {
 public:
  explicit Texture(GLenum target) : target_(target) {
    gl::GenTextures(1, &name_);
    gl::BindTexture(target, name_);
    for (const auto side : {GLenum{GL_TEXTURE_MIN_FILTER}, GLenum{GL_TEXTURE_MAG_FILTER}}) gl::TexParameteri(target, side, GL_NEAREST);
    for (const auto wrap : {GLenum{GL_TEXTURE_WRAP_S}, GLenum{GL_TEXTURE_WRAP_T}}) gl::TexParameteri(target, wrap, GL_CLAMP_TO_EDGE);
  }
  ~Texture() { gl::DeleteTextures(1, &name_); }
  Texture(const Texture&) = delete;
  Texture& operator=(const Texture&) = delete;
  void bind(GLenum unit) const {
    gl::ActiveTexture(unit);
    gl::BindTexture(target_, name_);
  }
  [[nodiscard]] GLuint name() const { return name_; }

 private:
  GLenum target_;
  GLuint name_ = 0;
};

class Framebuffer {
 public:
  Framebuffer() {
    gl::GenFramebuffers(1, &name_);
    bind();
  }
  ~Framebuffer() { gl::DeleteFramebuffers(1, &name_); }
  Framebuffer(const Framebuffer&) = delete;
  Framebuffer& operator=(const Framebuffer&) = delete;
  void bind() const { gl::BindFramebuffer(GL_FRAMEBUFFER, name_); }
  static void require() {
    if (gl::CheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
      throw std::runtime_error("OpenGL: the framebuffer is not complete");
  }

 private:
  GLuint name_ = 0;
};

// The depth texture as a grey picture, at most kLongest texels long, layers side by side.
void pictureOfMaps(const Solution& solution, bool isReversed, const Texture& maps, RenderOutput& out) {
  constexpr int kLongest = 2048;
  const int width = solution.atlas.x, height = solution.atlas.y, layers = solution.layers;
  std::vector<float> depth(static_cast<std::size_t>(width) * static_cast<std::size_t>(height) * static_cast<std::size_t>(layers));
  maps.bind(GL_TEXTURE0);
  gl::GetTexImage(GL_TEXTURE_2D_ARRAY, 0, GL_DEPTH_COMPONENT, GL_FLOAT, depth.data());
  const int step = (std::max(width * layers, height) + kLongest - 1) / kLongest;
  out.mapsWidth = width * layers / step;
  out.mapsHeight = height / step;
  out.maps.resize(static_cast<std::size_t>(out.mapsWidth) * static_cast<std::size_t>(out.mapsHeight));
  for (int y = 0; y < out.mapsHeight; ++y)
    for (int x = 0; x < out.mapsWidth; ++x) {
      const int column = x * step, row = (out.mapsHeight - 1 - y) * step, layer = column / width;
      const std::size_t at = (static_cast<std::size_t>(layer) * static_cast<std::size_t>(height) + static_cast<std::size_t>(row)) *
                             static_cast<std::size_t>(width);
      const float d = depth[at + static_cast<std::size_t>(column % width)];
      out.maps[static_cast<std::size_t>(y) * static_cast<std::size_t>(out.mapsWidth) + static_cast<std::size_t>(x)] =
          static_cast<std::uint8_t>(std::lround(255.0f * std::clamp(isReversed ? 1.0f - d : d, 0.0f, 1.0f)));
    }
}

// Numbers, and where there is room for them pictures: Lambert under a warm sun and a sky that is brighter above; a sky where nothing is.
void shade(const Frame& frame, const glm::dvec3& originWs, const std::vector<float>& position, const std::vector<float>& normal,
           const std::vector<float>& tint, RenderOutput& out) {
  const double brightness = glm::length(frame.light.directionWs);  // a refused light has none, and lights nothing
  const glm::dvec3 towardsLight = brightness > 0.0 ? -frame.light.directionWs / brightness : glm::dvec3(0.0),
                   eye = frame.camera.positionWs - originWs;
  const auto [right, up, forward] = axesOf(frame.camera);
  const double far = std::min(frame.camera.far, frame.camera.shadowDistance);
  const glm::dvec3 sun(1.0, 0.93, 0.8), zenith(0.24, 0.33, 0.5), ground(0.2, 0.19, 0.18), haze(0.62, 0.7, 0.8);
  for (int y = 0; y < out.height; ++y)
    for (int x = 0; x < out.width; ++x) {
      const std::size_t source =
          static_cast<std::size_t>(out.height - 1 - y) * static_cast<std::size_t>(out.width) + static_cast<std::size_t>(x);
      const std::size_t target = static_cast<std::size_t>(y) * static_cast<std::size_t>(out.width) + static_cast<std::size_t>(x);
      const float* p = &position[4 * source];
      const float* n = &normal[4 * source];
      glm::dvec3 colour, tinted;
      if (p[3] < 0.0f) {
        out.lit[target] = 2;
        out.index[target] = 255;
        colour = tinted = glm::mix(zenith * 1.4, haze, static_cast<double>(y) / out.height);
      } else {
        out.lit[target] = p[3] >= 0.5f ? 1 : 0;
        out.index[target] = n[3] < 0.0f ? 255 : static_cast<std::uint8_t>(std::lround(n[3]));
        for (std::size_t c = 0; c < 3; ++c) {
          out.position[3 * target + c] = p[c];
          out.normal[3 * target + c] = n[c];
        }
        if (out.shaded.empty()) continue;
        const glm::dvec3 at(p[0], p[1], p[2]), facing(n[0], n[1], n[2]);
        const glm::dvec3 ambient = glm::mix(ground, zenith, 0.5 + 0.5 * facing.y);
        colour = 0.78 * (0.75 * ambient + 0.85 * sun * (std::max(glm::dot(facing, towardsLight), 0.0) * static_cast<double>(p[3])));
        tinted = colour * glm::dvec3(tint[4 * source], tint[4 * source + 1], tint[4 * source + 2]) *
                 (1.0 - 0.15 * static_cast<double>(tint[4 * source + 3]));
        const double distance = std::isfinite(far) ? glm::dot(at - eye, forward) / far : 0.0;
        colour = glm::mix(colour, haze, 0.35 * std::clamp(distance * distance, 0.0, 1.0));
      }
      for (int c = 0; c < 3 && !out.shaded.empty(); ++c) {
        out.shaded[3 * target + static_cast<std::size_t>(c)] = toByte(colour[c]);
        out.tinted[3 * target + static_cast<std::size_t>(c)] = toByte(tinted[c]);
      }
    }
}

}  // namespace

struct Renderer::State {
  std::unique_ptr<Context> context;
  GLuint castProgram = 0, flatProgram = 0, atlasProgram = 0, layerProgram = 0, depthProgram = 0, vertexArray = 0, vertices = 0,
         elements = 0, instances = 0, block = 0;
  std::array<GLuint, kShadowFunctions.size()> views{};
  std::unique_ptr<Texture> normals;
  std::unique_ptr<SampledMaps> sampled;  // from the first view on that asks
  Mesh mesh;
  bool isPlaced = false;  // positions are on the device, relative to origin
  glm::dvec3 origin{0.0};
  std::vector<Chunk> chunks;
  std::vector<std::uint32_t> indices;

  void drawDepths(const Frame& frame, int width, int height, const Texture& depth);
  void prepareSampled(const Frame& frame, int width, int height, Solution& place);
  // make: leaves the block, bound, and the commands of the maps' draw; empty: they are the solution's.
  RenderOutput draw(const Frame& frame, const Solution& solution, const RenderOptions& options, const std::function<void()>& make);

  ~State() {
    if (!context) return;
    normals.reset();
    sampled.reset();
    for (const GLuint program : {castProgram, flatProgram, atlasProgram, layerProgram, depthProgram}) gl::DeleteProgram(program);
    for (const GLuint program : views) gl::DeleteProgram(program);
    for (GLuint* buffer : {&vertices, &elements, &instances, &block}) gl::DeleteBuffers(1, buffer);
    gl::DeleteVertexArrays(1, &vertexArray);
  }

  void load(const Mesh& newMesh) {
    mesh = newMesh;
    isPlaced = false;
    chunks = makeChunks(mesh, indices);
    gl::BindVertexArray(vertexArray);
    gl::BindBuffer(GL_ELEMENT_ARRAY_BUFFER, elements);
    gl::BufferData(GL_ELEMENT_ARRAY_BUFFER, static_cast<GLsizeiptr>(indices.size() * sizeof indices[0]), indices.data(), GL_STATIC_DRAW);
    uploadNormals();
  }

  // Positions relative to the origin, rounded to float once, so that both passes see the same numbers.
  void place(const glm::dvec3& originWs) {
    if (isPlaced && origin == originWs) return;
    isPlaced = true;
    origin = originWs;
    std::vector<glm::vec3> relative(mesh.positionsWs.size());
    std::transform(mesh.positionsWs.begin(), mesh.positionsWs.end(), relative.begin(),
                   [&](const glm::vec3& p) { return glm::vec3(glm::dvec3(p) - originWs); });
    gl::BindVertexArray(vertexArray);
    gl::BindBuffer(GL_ARRAY_BUFFER, vertices);
    gl::BufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(relative.size() * sizeof relative[0]), relative.data(), GL_STATIC_DRAW);
    gl::EnableVertexAttribArray(0);
    gl::VertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, 0, nullptr);
  }

  void uploadNormals() {
    constexpr std::size_t kWidth = 4096;
    const std::size_t triangles = indices.size() / 3, rows = (triangles + kWidth - 1) / kWidth;
    std::vector<glm::vec3> faces(std::max<std::size_t>(rows, 1) * kWidth, glm::vec3(0.0f, 1.0f, 0.0f));
    for (std::size_t t = 0; t < triangles; ++t) {
      const glm::dvec3 a(mesh.positionsWs[indices[3 * t]]), b(mesh.positionsWs[indices[3 * t + 1]]),
          c(mesh.positionsWs[indices[3 * t + 2]]);
      const glm::dvec3 n = glm::cross(b - a, c - a);
      if (const double length = glm::length(n); length > 0.0) faces[t] = glm::vec3(n / length);
    }
    normals = std::make_unique<Texture>(GL_TEXTURE_2D);
    gl::TexImage2D(GL_TEXTURE_2D, 0, GL_RGB32F, kWidth, static_cast<GLsizei>(faces.size() / kWidth), 0, GL_RGB, GL_FLOAT, faces.data());
  }
};

Renderer::Renderer(Backend backend, const std::string& version) : state_(std::make_unique<State>()) {
  constexpr int kMajor = 4, kMinor = 5;  // for glClipControl; the shaders need 3.3
  auto context = createContext(backend, kMajor, kMinor);
  gl::load(*context);
  state_->context = std::move(context);
  const auto build = [&](const std::vector<std::pair<GLenum, std::string>>& stages) {
    const GLuint program = buildProgram(version, stages);
    if (const GLuint block = gl::GetUniformBlockIndex(program, "gnomonUniforms"); block != GL_INVALID_INDEX)
      gl::UniformBlockBinding(program, block, 0);
    return program;
  };
  state_->castProgram = build({{GL_VERTEX_SHADER, kCastVertex}, {GL_FRAGMENT_SHADER, kCastFragment}});
  state_->flatProgram = build({{GL_VERTEX_SHADER, kFlatVertex}, {GL_FRAGMENT_SHADER, kFlatFragment}});
  state_->atlasProgram = build({{GL_VERTEX_SHADER, kAtlasVertex}, {GL_FRAGMENT_SHADER, kCastFragment}});
  state_->layerProgram =
      build({{GL_VERTEX_SHADER, kLayerVertex}, {GL_GEOMETRY_SHADER, kLayerGeometry}, {GL_FRAGMENT_SHADER, kCastFragment}});
  state_->depthProgram = build({{GL_VERTEX_SHADER, kDepthVertex}, {GL_FRAGMENT_SHADER, kCastFragment}});
  for (std::size_t i = 0; i < kShadowFunctions.size(); ++i)
    state_->views[i] = build(
        {{GL_VERTEX_SHADER, kViewVertex}, {GL_FRAGMENT_SHADER, std::string("#define SHADOW ") + kShadowFunctions[i] + kViewFragment}});
  gl::GenVertexArrays(1, &state_->vertexArray);
  for (GLuint* buffer : {&state_->vertices, &state_->elements, &state_->instances, &state_->block}) gl::GenBuffers(1, buffer);
  std::array<std::int32_t, kMaxPartitions> maps{};
  std::iota(maps.begin(), maps.end(), 0);
  gl::BindVertexArray(state_->vertexArray);
  gl::BindBuffer(GL_ARRAY_BUFFER, state_->instances);
  gl::BufferData(GL_ARRAY_BUFFER, sizeof maps, maps.data(), GL_STATIC_DRAW);
  gl::EnableVertexAttribArray(1);
  gl::VertexAttribIPointer(1, 1, GL_INT, 0, nullptr);
  gl::VertexAttribDivisor(1, 1);
}

Renderer::~Renderer() {
  if (state_->context) state_->context->makeCurrent();
}

std::string Renderer::device() const {
  state_->context->makeCurrent();
  return std::string(reinterpret_cast<const char*>(gl::GetString(GL_RENDERER))) + " (" + state_->context->name() + ")";
}

void Renderer::load(const Mesh& mesh) {
  state_->context->makeCurrent();
  state_->load(mesh);
}

// The depth buffer of the camera's view, in a texture. The framebuffer stays bound.
void Renderer::State::drawDepths(const Frame& frame, int width, int height, const Texture& depth) {
  if (indices.empty()) throw std::runtime_error("Renderer: no mesh was loaded");
  const glm::dvec3 originWs = frame.worldSpace ? glm::dvec3(0.0) : frame.camera.positionWs;
  place(originWs);
  depth.bind(GL_TEXTURE0);
  gl::TexImage2D(GL_TEXTURE_2D, 0, GL_DEPTH_COMPONENT32F, width, height, 0, GL_DEPTH_COMPONENT, GL_FLOAT, nullptr);
  gl::FramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_TEXTURE_2D, depth.name(), 0);
  gl::DrawBuffer(GL_NONE);
  gl::ReadBuffer(GL_NONE);
  Framebuffer::require();
  setConvention(frame.camera.depth, false);
  gl::Enable(GL_DEPTH_TEST);
  gl::Viewport(0, 0, width, height);
  gl::Clear(GL_DEPTH_BUFFER_BIT);
  gl::UseProgram(depthProgram);
  const glm::mat4 clip = clipFromRelative(frame.camera, originWs);
  gl::UniformMatrix4fv(gl::GetUniformLocation(depthProgram, "clipFromWorld"), 1, GL_FALSE, &clip[0][0]);
  gl::BindVertexArray(vertexArray);
  gl::DrawElements(GL_TRIANGLES, static_cast<GLsizei>(indices.size()), GL_UNSIGNED_INT, nullptr);
}

std::vector<float> Renderer::depths(const Frame& frame, int width, int height) {
  state_->context->makeCurrent();
  const Framebuffer target;
  const Texture depth(GL_TEXTURE_2D);
  state_->drawDepths(frame, width, height, depth);
  std::vector<float> out(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  gl::ReadPixels(0, 0, width, height, GL_DEPTH_COMPONENT, GL_FLOAT, out.data());
  if (const GLenum error = gl::GetError(); error != GL_NO_ERROR) throw std::runtime_error("OpenGL: error " + std::to_string(error));
  return out;
}

ReduceTimes Renderer::timeReductions(const Frame& frame, int width, int height) {
  constexpr std::size_t kRepetitions = 9;
  state_->context->makeCurrent();
  const Framebuffer target;
  const Texture depth(GL_TEXTURE_2D);
  state_->drawDepths(frame, width, height, depth);
  const auto place = std::make_unique<Solution>();
  state_->prepareSampled(frame, width, height, *place);
  std::array<std::array<double, kRepetitions>, 2> ms{};
  if (place->partitionCount == 0) return {};
  for (const ReduceBy way : {ReduceBy::fragments, ReduceBy::workgroups}) state_->sampled->reduce(way, depth.name());  // warm
  for (std::size_t i = 0; i < kRepetitions; ++i)
    for (const ReduceBy way : {ReduceBy::fragments, ReduceBy::workgroups}) {
      gl::Finish();
      const auto start = Clock::now();
      state_->sampled->reduce(way, depth.name());
      gl::Finish();
      ms[static_cast<std::size_t>(way)][i] = millisecondsSince(start);
    }
  for (auto& each : ms) std::nth_element(each.begin(), each.begin() + kRepetitions / 2, each.end());
  if (const GLenum error = gl::GetError(); error != GL_NO_ERROR) throw std::runtime_error("OpenGL: error " + std::to_string(error));
  return {ms[0][kRepetitions / 2], ms[1][kRepetitions / 2]};
}

// Where the maps of the view's samples are put.
void Renderer::State::prepareSampled(const Frame& frame, int width, int height, Solution& place) {
  if (frame.samples || frame.worldSpace || frame.shadowMap.layout != MapLayout::atlas)
    throw std::runtime_error("Renderer: sampled maps are those of a whole view, camera-relative, in an atlas");
  if (const Status status = solvePssm(frame, {.split = {}, .fit = FitMode::slice}, place); status != Status::ok)
    throw std::runtime_error(std::string(statusField(status)) + ": " + statusRule(status));
  if (!sampled) sampled = std::make_unique<SampledMaps>();
  if (place.partitionCount > 0) sampled->prepare(frame, place, width, height, chunks);
}

RenderOutput Renderer::renderSampled(const Frame& frame, ReduceBy way, Solution& solution, const RenderOptions& options) {
  State& s = *state_;
  s.context->makeCurrent();
  const Texture depth(GL_TEXTURE_2D);
  {
    const Framebuffer target;
    s.drawDepths(frame, options.width, options.height, depth);
  }
  s.prepareSampled(frame, options.width, options.height, solution);
  if (solution.partitionCount == 0) return s.draw(frame, solution, options, {});
  RenderOutput out = s.draw(frame, solution, options, [&] {
    s.sampled->reduce(way, depth.name());
    s.sampled->make(way);
    gl::BindBufferBase(GL_UNIFORM_BUFFER, 0, s.sampled->block());
  });
  out.shadowTriangles = s.sampled->read(frame, solution);
  return out;
}

RenderOutput Renderer::render(const Frame& frame, const Solution& solution, const RenderOptions& options) {
  state_->context->makeCurrent();
  return state_->draw(frame, solution, options, {});
}

RenderOutput Renderer::State::draw(const Frame& frame, const Solution& solution, const RenderOptions& options,
                                   const std::function<void()>& make) {
  if (indices.empty()) throw std::runtime_error("Renderer: no mesh was loaded");
  place(solution.originWs);
  gl::BindBuffer(GL_UNIFORM_BUFFER, block);
  gl::BufferData(GL_UNIFORM_BUFFER, sizeof solution.block, &solution.block, GL_DYNAMIC_DRAW);
  gl::BindBufferBase(GL_UNIFORM_BUFFER, 0, block);

  RenderOutput out;
  out.width = options.width;
  out.height = options.height;
  const bool isReversed = frame.shadowMap.depth == DepthConvention::reversedZeroToOne;
  const int layers = std::max(solution.layers, 1);
  const glm::ivec2 atlas = glm::max(solution.atlas, glm::ivec2(1));

  const Texture maps(GL_TEXTURE_2D_ARRAY);
  gl::TexImage3D(GL_TEXTURE_2D_ARRAY, 0, GL_DEPTH_COMPONENT32F, atlas.x, atlas.y, layers, 0, GL_DEPTH_COMPONENT, GL_FLOAT, nullptr);
  const Framebuffer mapTarget;
  gl::DrawBuffer(GL_NONE);
  gl::ReadBuffer(GL_NONE);

  const Framebuffer viewTarget;
  const std::array<GLint, 3> formats{GL_RGBA32F, GL_RGBA32F, GL_RGBA16F};
  std::vector<std::unique_ptr<Texture>> colours;
  std::array<GLenum, 3> buffers{};
  for (std::size_t i = 0; i < formats.size(); ++i) {
    colours.push_back(std::make_unique<Texture>(GL_TEXTURE_2D));
    gl::TexImage2D(GL_TEXTURE_2D, 0, formats[i], options.width, options.height, 0, GL_RGBA, GL_FLOAT, nullptr);
    buffers[i] = GL_COLOR_ATTACHMENT0 + static_cast<GLenum>(i);
    gl::FramebufferTexture2D(GL_FRAMEBUFFER, buffers[i], GL_TEXTURE_2D, colours[i]->name(), 0);
  }
  const Texture depth(GL_TEXTURE_2D);
  gl::TexImage2D(GL_TEXTURE_2D, 0, GL_DEPTH_COMPONENT32F, options.width, options.height, 0, GL_DEPTH_COMPONENT, GL_FLOAT, nullptr);
  gl::FramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_TEXTURE_2D, depth.name(), 0);
  gl::DrawBuffers(static_cast<GLsizei>(buffers.size()), buffers.data());
  Framebuffer::require();

  const auto drawMaps = [&] {
    out.shadowTriangles = 0;
    if (solution.partitionCount == 0) return;
    if (make) make();
    mapTarget.bind();
    setConvention(frame.shadowMap.depth, frame.shadowMap.style == ClipStyle::direct3d);
    gl::Enable(GL_DEPTH_TEST);
    const bool byFragment = options.castPath == CastPath::fragmentDepth;
    if (solution.depthClamp && !byFragment) gl::Enable(GL_DEPTH_CLAMP);
    gl::BindVertexArray(vertexArray);
    if (make || options.castPath == CastPath::wholeAtlas || options.castPath == CastPath::layers) {
      const bool isAtlas = make || options.castPath == CastPath::wholeAtlas;
      const auto count = static_cast<GLsizei>(indices.size());
      gl::FramebufferTexture(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, maps.name(), 0);
      Framebuffer::require();
      gl::Viewport(0, 0, atlas.x, atlas.y);
      gl::Clear(GL_DEPTH_BUFFER_BIT);
      gl::UseProgram(isAtlas ? atlasProgram : layerProgram);
      for (GLenum i = 0; isAtlas && i < 4; ++i) gl::Enable(GL_CLIP_DISTANCE0 + i);
      if (make)
        sampled->draw();
      else if (isAtlas)
        gl::DrawElementsInstanced(GL_TRIANGLES, count, GL_UNSIGNED_INT, nullptr, solution.partitionCount);
      else
        gl::DrawElements(GL_TRIANGLES, count, GL_UNSIGNED_INT, nullptr);
      for (GLenum i = 0; i < 4; ++i) gl::Disable(GL_CLIP_DISTANCE0 + i);
      out.shadowTriangles = indices.size() / 3 * static_cast<std::size_t>(solution.partitionCount);
      gl::Disable(GL_DEPTH_CLAMP);
      return;
    }
    const GLuint program = byFragment ? flatProgram : castProgram;
    gl::UseProgram(program);
    for (int layer = 0; layer < layers; ++layer) {
      gl::FramebufferTextureLayer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, maps.name(), 0, layer);
      Framebuffer::require();
      gl::Disable(GL_SCISSOR_TEST);
      gl::Clear(GL_DEPTH_BUFFER_BIT);
      gl::Enable(GL_SCISSOR_TEST);
      for (int i = 0; i < solution.partitionCount; ++i) {
        const Partition& map = solution.partitions[i];
        if (map.layer != layer) continue;
        gl::Viewport(map.viewport.x, map.viewport.y, map.viewport.z, map.viewport.w);
        gl::Scissor(map.viewport.x, map.viewport.y, map.viewport.z, map.viewport.w);
        gl::Uniform1i(gl::GetUniformLocation(program, "index"), i);
        for (const Chunk& chunk : chunks) {
          if (!mayCast(map, chunk.bounds)) continue;
          out.shadowTriangles += chunk.count / 3;
          gl::DrawElements(GL_TRIANGLES, static_cast<GLsizei>(chunk.count), GL_UNSIGNED_INT,
                           reinterpret_cast<const void*>(chunk.first * sizeof(std::uint32_t)));
        }
      }
    }
    gl::Disable(GL_SCISSOR_TEST);
    gl::Disable(GL_DEPTH_CLAMP);
  };

  const auto drawView = [&] {
    viewTarget.bind();
    setConvention(frame.camera.depth, false);
    gl::Enable(GL_DEPTH_TEST);
    gl::Viewport(0, 0, options.width, options.height);
    const std::array<float, 4> nothing{0.0f, 0.0f, 0.0f, -1.0f};
    for (GLint i = 0; i < 3; ++i) gl::ClearBufferfv(GL_COLOR, i, nothing.data());
    gl::Clear(GL_DEPTH_BUFFER_BIT);
    const GLuint view = views[static_cast<std::size_t>(options.filter)];
    gl::UseProgram(view);
    const auto location = [&](const char* name) { return gl::GetUniformLocation(view, name); };
    const glm::mat4 clip = clipFromRelative(frame.camera, solution.originWs);
    const glm::vec3 eye(frame.camera.positionWs - solution.originWs), back(-glm::normalize(frame.camera.forwardWs));
    gl::UniformMatrix4fv(location("clipFromWorld"), 1, GL_FALSE, &clip[0][0]);
    gl::Uniform3f(location("eye"), eye.x, eye.y, eye.z);
    gl::Uniform3f(location("towardsEye"), back.x, back.y, back.z);
    gl::Uniform1f(location("eyeShare"), frame.camera.projection == Projection::perspective ? 1.0f : 0.0f);
    gl::Uniform1i(location("isReversed"), isReversed);
    const bool hasFaces = solution.partitionCount > 0 && solution.partitions[0].planeCount > 0;
    gl::Uniform1i(location("selection"), hasFaces ? 2 : options.selectByViewDepth ? 1 : 0);
    gl::Uniform1i(location("maps"), 0);
    gl::Uniform1i(location("normals"), 1);
    maps.bind(GL_TEXTURE0);
    normals->bind(GL_TEXTURE1);
    gl::BindVertexArray(vertexArray);
    gl::DrawElements(GL_TRIANGLES, static_cast<GLsizei>(indices.size()), GL_UNSIGNED_INT, nullptr);
  };

  for (int pass = 0; pass < (options.time ? 2 : 1); ++pass) {
    gl::Finish();
    const auto start = Clock::now();
    drawMaps();
    gl::Finish();
    out.shadowMs = millisecondsSince(start);
    drawView();
    gl::Finish();
    out.frameMs = millisecondsSince(start);
  }
  if (const GLenum error = gl::GetError(); error != GL_NO_ERROR) throw std::runtime_error("OpenGL: error " + std::to_string(error));

  const std::size_t pixels = static_cast<std::size_t>(options.width) * static_cast<std::size_t>(options.height);
  out.position.assign(3 * pixels, 0.0f);
  out.normal.assign(3 * pixels, 0.0f);
  out.lit.resize(pixels);
  out.index.resize(pixels);
  if (options.pictures) {
    out.shaded.resize(3 * pixels);
    out.tinted.resize(3 * pixels);
  }
  std::array<std::vector<float>, 3> read;
  for (std::size_t i = 0; i < (options.pictures ? 3 : 2); ++i) {
    read[i].resize(4 * pixels);
    gl::ReadBuffer(buffers[i]);
    gl::ReadPixels(0, 0, options.width, options.height, GL_RGBA, GL_FLOAT, read[i].data());
  }
  shade(frame, solution.originWs, read[0], read[1], read[2], out);
  if (options.pictures && solution.partitionCount > 0) pictureOfMaps(solution, isReversed, maps, out);
  return out;
}

}  // namespace gnomon::offscreen
