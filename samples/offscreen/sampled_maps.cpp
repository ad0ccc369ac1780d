#include "sampled_maps.h"

#include <algorithm>
#include <cstdint>
#include <stdexcept>
#include <string>

#include <glm/geometric.hpp>
#include <glm/matrix.hpp>

#include "gnomon/camera.h"
#include "gnomon/error.h"
#include "gnomon/samples.h"
#include "gnomon/sdsm.h"
#include "shader.h"

namespace gnomon::offscreen {
namespace {

// Bindings. The textures' are units.
enum { kViewBinding = 1, kPlaceBinding };  // 0 is gnomonUniforms'
enum { kDepthsUnit, kLevelUnit, kExtremesUnit };

const std::string kCommon = R"(
#define GNOMON_NO_UNIFORM
#include "gnomon_sdsm.glsl"
layout(std140) uniform Viewed { GnomonSampleView view; GnomonSdsmSetup setup; };
uniform highp sampler2D depths;
uniform int count;  // of maps

vec4 extremesAt(ivec2 pixel) { return gnomonExtremes(view.law, texelFetch(depths, pixel, 0).r); }

vec4 boundsAt(ivec2 pixel, vec2 interval) {
  float depth = texelFetch(depths, pixel, 0).r;
  vec2 position = gnomonSamplePosition(view.law, view.corner, view.pixels, view.forward, pixel, depth);
  return gnomonBoundsOf(view.law, position, depth, interval);
}

// The depth values of a slice.
vec2 intervalOf(vec4 extremes, int slice) {
  vec2 range = gnomonShadowedRange(setup, view.law, extremes);
  return gnomonSliceDepths(view.law, gnomonSlice(view.law, range, slice, count));
}
)";

// ---- by tiles: each level a sixteenth as wide and high, until a texel is left ----

constexpr const char* kTileVertex = R"(
void main() { gl_Position = vec4(vec2((gl_VertexID << 1) & 2, gl_VertexID & 2) * 2.0 - 1.0, 0.0, 1.0); }
)";

// Slices side by side in one target: a pass for all of them.
const std::string kTile = kCommon + R"(
uniform highp sampler2D level, extremes;
layout(location = 0) out vec4 result;
void main() {
  ivec2 size = SIZE;
  int tiles = (size.x + 15) / 16, part = int(gl_FragCoord.x) / tiles;
  vec2 interval = INTERVAL;
  GNOMON_REDUCE_TILE(result, ivec2(gl_FragCoord.xy) - ivec2(part * tiles, 0), size, VALUE)
}
)";

const std::string kFirstExtremesTile = R"(
#define SIZE textureSize(depths, 0)
#define INTERVAL vec2(0.0)
#define VALUE(pixel) extremesAt(pixel)
)" + kTile;

const std::string kFirstBoundsTile = R"(
#define SIZE textureSize(depths, 0)
#define INTERVAL intervalOf(texelFetch(extremes, ivec2(0), 0), part)
#define VALUE(pixel) boundsAt(pixel, interval)
)" + kTile;

const std::string kNextTile = R"(
uniform int parts;
#define SIZE (textureSize(level, 0) / ivec2(parts, 1))
#define INTERVAL vec2(0.0)
#define VALUE(pixel) texelFetch(level, pixel + ivec2(part * size.x, 0), 0)
)" + kTile;

// ---- by workgroups: each reduces 128 x 128 pixels, an invocation 64 of them before any waits for another ----

constexpr int kGroupPixels = 128;

const std::string kGroup = kCommon + R"(
layout(local_size_x = 16, local_size_y = 16) in;
layout(std430, binding = 0) buffer Maxima { uvec4 extremes, bounds[GNOMON_MAX_PARTITIONS]; };
shared vec4 scratch[256];
#define REDUCE_GROUP(VALUE) \
  vec4 all = gnomonNothing; \
  ivec2 from = ivec2(gl_WorkGroupID.xy) * 128 + ivec2(gl_LocalInvocationID.xy), to = min(ivec2(gl_WorkGroupID.xy) * 128 + 128, textureSize(depths, 0)); \
  for (int y = from.y; y < to.y; y += 16) \
    for (int x = from.x; x < to.x; x += 16) all = max(all, VALUE(ivec2(x, y))); \
  uint at = gl_LocalInvocationIndex; \
  GNOMON_REDUCE_GROUP(scratch, at, all)
)";

const std::string kExtremesGroup = kGroup + R"(
void main() {
  REDUCE_GROUP(extremesAt)
  if (at == 0u) GNOMON_JOIN(extremes, scratch[0])
}
)";

const std::string kBoundsGroup = kGroup + R"(
#define VALUE(pixel) boundsAt(pixel, interval)
void main() {  // z: a slice
  int slice = int(gl_WorkGroupID.z);
  vec2 interval = intervalOf(gnomonUnordered(extremes), slice);
  REDUCE_GROUP(VALUE)
  if (at == 0u && scratch[0].x > -3e38) GNOMON_JOIN(bounds[slice], scratch[0])
}
)";

// ---- the block, the planes of its maps, and the draw ----

const std::string kFinish = kCommon + R"(
layout(std140) uniform Place { GnomonBlock place; };
layout(std140, binding = 1) buffer Made { GnomonBlock made; };
layout(std430, binding = 2) buffer Cull { vec4 planes[4 * GNOMON_MAX_PARTITIONS]; uint maps; };
layout(local_size_x = 1) in;
)";

const std::string kFinishOfTiles = kFinish + R"(
uniform highp sampler2D level, extremes;
void main() {
  uvec4 bounds[GNOMON_MAX_PARTITIONS];
  for (int i = 0; i < count; ++i) {
    vec4 all = texelFetch(level, ivec2(i, 0), 0);
    bounds[i] = all.x > -3e38 ? gnomonOrdered(all) : uvec4(0u);
  }
  GNOMON_FINISH(made, place, setup, view.law, texelFetch(extremes, ivec2(0), 0), bounds, count)
  GNOMON_FINISH_CULL(planes, maps, made)
}
)";

const std::string kFinishOfGroups = kFinish + R"(
layout(std430, binding = 0) buffer Maxima { uvec4 extremes, bounds[GNOMON_MAX_PARTITIONS]; };
void main() {
  GNOMON_FINISH(made, place, setup, view.law, gnomonUnordered(extremes), bounds, count)
  GNOMON_FINISH_CULL(planes, maps, made)
}
)";

// A command for each chunk and map: its instance is drawn where the chunk may cast.
struct Command {
  std::uint32_t count, instances, first;
  std::int32_t baseVertex;
  std::uint32_t baseInstance;
};

constexpr int kCullInvocations = 64;

const std::string kCullKernel = R"(
#define GNOMON_NO_UNIFORM
#include "gnomon_sdsm.glsl"
struct Command { uint count, instances, first; int baseVertex; uint baseInstance; };
layout(std430, binding = 2) readonly buffer Cull { vec4 planes[4 * GNOMON_MAX_PARTITIONS]; uint maps; };
layout(std430, binding = 3) readonly buffer Boxes { vec4 boxes[]; };
layout(std430, binding = 4) buffer Commands { Command commands[]; };
layout(local_size_x = 64) in;
void main() {
  int box = int(gl_GlobalInvocationID.x), map = int(gl_GlobalInvocationID.y), all = boxes.length() / 2;
  if (box >= all) return;
  bool isIn;
  GNOMON_CULL_BOX(isIn, planes, map, boxes[2 * box].xyz, boxes[2 * box + 1].xyz)
  commands[all * map + box].instances = isIn ? 1u : 0u;
}
)";

// GnomonSampleView and GnomonSdsmSetup, as std140 has them.
struct Viewed {
  SampleView view;
  SdsmSetup setup;
};

void require(Status status) {
  if (status != Status::ok) throw std::runtime_error(std::string(statusField(status)) + ": " + statusRule(status));
}

template <typename T>
void upload(GLuint buffer, const T* data, std::size_t count) {
  gl::BindBuffer(GL_SHADER_STORAGE_BUFFER, buffer);
  gl::BufferData(GL_SHADER_STORAGE_BUFFER, static_cast<GLsizeiptr>(count * sizeof(T)), data, GL_DYNAMIC_DRAW);
}

template <typename T>
void download(GLuint buffer, T* data, std::size_t count) {
  gl::BindBuffer(GL_SHADER_STORAGE_BUFFER, buffer);
  const auto bytes = static_cast<GLsizeiptr>(count * sizeof(T));
  const void* mapped = gl::MapBufferRange(GL_SHADER_STORAGE_BUFFER, 0, bytes, GL_MAP_READ_BIT);
  if (!mapped) throw std::runtime_error("OpenGL: a buffer cannot be read");
  std::copy_n(static_cast<const T*>(mapped), count, data);
  gl::UnmapBuffer(GL_SHADER_STORAGE_BUFFER);
}

void bindTexture(int unit, GLuint texture) {
  gl::ActiveTexture(GL_TEXTURE0 + static_cast<GLenum>(unit));
  gl::BindTexture(GL_TEXTURE_2D, texture);
}

GLuint groups(std::size_t count, int size) {
  return static_cast<GLuint>((count + static_cast<std::size_t>(size) - 1) / static_cast<std::size_t>(size));
}

}  // namespace

SampledMaps::SampledMaps() {
  const auto tile = [](const std::string& text) {
    return buildProgram("330 core", {{GL_VERTEX_SHADER, kTileVertex}, {GL_FRAGMENT_SHADER, text}});
  };
  const auto kernel = [](const std::string& text) { return buildProgram("430 core", {{GL_COMPUTE_SHADER, text}}); };
  m_programs[kFirstExtremes] = tile(kFirstExtremesTile);
  m_programs[kFirstBounds] = tile(kFirstBoundsTile);
  m_programs[kNextLevel] = tile(kNextTile);
  m_programs[kGroupExtremes] = kernel(kExtremesGroup);
  m_programs[kGroupBounds] = kernel(kBoundsGroup);
  m_programs[kFinishTiles] = kernel(kFinishOfTiles);
  m_programs[kFinishGroups] = kernel(kFinishOfGroups);
  m_programs[kCull] = kernel(kCullKernel);
  for (const GLuint program : m_programs) {
    gl::UseProgram(program);
    for (const auto& [name, unit] : {std::pair("depths", kDepthsUnit), {"level", kLevelUnit}, {"extremes", kExtremesUnit}})
      gl::Uniform1i(gl::GetUniformLocation(program, name), unit);
    for (const auto& [name, binding] : {std::pair("Viewed", kViewBinding), {"Place", kPlaceBinding}})
      if (const GLuint block = gl::GetUniformBlockIndex(program, name); block != GL_INVALID_INDEX)
        gl::UniformBlockBinding(program, block, static_cast<GLuint>(binding));
  }
  gl::GenBuffers(kBufferCount, m_buffers);
  gl::GenFramebuffers(1, &m_frame);
  gl::GenVertexArrays(1, &m_vertexArray);
}

SampledMaps::~SampledMaps() {
  for (const GLuint program : m_programs) gl::DeleteProgram(program);
  gl::DeleteBuffers(kBufferCount, m_buffers);
  gl::DeleteFramebuffers(1, &m_frame);
  gl::DeleteVertexArrays(1, &m_vertexArray);
  for (const Levels* levels : {&m_extremes, &m_bounds})
    gl::DeleteTextures(static_cast<GLsizei>(levels->textures.size()), levels->textures.data());
}

void SampledMaps::makeLevels(int parts, Levels& levels) {
  gl::DeleteTextures(static_cast<GLsizei>(levels.textures.size()), levels.textures.data());
  levels = {.parts = parts, .textures = {}, .sizes = {}};
  glm::ivec2 size(m_width, m_height);
  do {
    size = (size + 15) / 16;
    GLuint texture = 0;
    gl::GenTextures(1, &texture);
    bindTexture(kLevelUnit, texture);
    for (const int filter : {GL_TEXTURE_MIN_FILTER, GL_TEXTURE_MAG_FILTER})
      gl::TexParameteri(GL_TEXTURE_2D, static_cast<GLenum>(filter), GL_NEAREST);
    gl::TexImage2D(GL_TEXTURE_2D, 0, GL_RGBA32F, parts * size.x, size.y, 0, GL_RGBA, GL_FLOAT, nullptr);
    levels.textures.push_back(texture);
    levels.sizes.emplace_back(parts * size.x, size.y);
  } while (size != glm::ivec2(1));
}

void SampledMaps::prepare(const Frame& frame, const Solution& place, int width, int height, std::span<const Chunk> chunks) {
  m_width = width;
  m_height = height;
  m_maps = place.partitionCount;
  m_chunks = chunks.size();
  Viewed viewed;
  glm::dmat3 lsFromView;
  require(lightForSamples(frame, lsFromView));
  require(sdsmSetup(frame, viewed.setup));
  viewed.view = sampleView(frame.camera, width, height, lsFromView);
  upload(m_buffers[kView], &viewed, 1);
  upload(m_buffers[kPlace], &place.block, 1);
  upload(m_buffers[kBlock], &place.block, 1);
  upload<glm::vec4>(m_buffers[kPlanes], nullptr, 4 * kMaxPartitions + 1);
  std::vector<glm::vec4> boxes;
  for (const Chunk& chunk : chunks) {  // relative to the origin; what float32 rounds goes outwards
    constexpr double kRounding = 1.0 / 4194304.0;
    const glm::dvec3 least = chunk.bounds.minWs - place.originWs, most = chunk.bounds.maxWs - place.originWs;
    const double room = kRounding * std::max(glm::length(least), glm::length(most));
    boxes.insert(boxes.end(), {glm::vec4(glm::dvec4(least - room, 0.0)), glm::vec4(glm::dvec4(most + room, 0.0))});
  }
  upload(m_buffers[kBoxes], boxes.data(), boxes.size());
  std::vector<Command> commands;
  for (int map = 0; map < m_maps; ++map)
    for (const Chunk& chunk : chunks)
      commands.push_back(
          {static_cast<std::uint32_t>(chunk.count), 0u, static_cast<std::uint32_t>(chunk.first), 0, static_cast<std::uint32_t>(map)});
  upload(m_buffers[kCommands], commands.data(), commands.size());
  makeLevels(1, m_extremes);
  makeLevels(m_maps, m_bounds);
}

void SampledMaps::use(Program program) const {
  gl::UseProgram(m_programs[program]);
  gl::Uniform1i(gl::GetUniformLocation(m_programs[program], "count"), m_maps);
  gl::BindBufferBase(GL_UNIFORM_BUFFER, kViewBinding, m_buffers[kView]);
  gl::BindBufferBase(GL_UNIFORM_BUFFER, kPlaceBinding, m_buffers[kPlace]);
  const Buffer storage[] = {kMaxima, kBlock, kPlanes, kBoxes, kCommands};
  for (GLuint i = 0; i < std::size(storage); ++i) gl::BindBufferBase(GL_SHADER_STORAGE_BUFFER, i, m_buffers[storage[i]]);
}

void SampledMaps::drawLevels(Program first, const Levels& levels) {
  for (std::size_t i = 0; i < levels.textures.size(); ++i) {
    const Program program = i == 0 ? first : kNextLevel;
    use(program);
    gl::Uniform1i(gl::GetUniformLocation(m_programs[program], "parts"), levels.parts);
    if (i > 0) bindTexture(kLevelUnit, levels.textures[i - 1]);
    gl::FramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, levels.textures[i], 0);
    gl::Viewport(0, 0, levels.sizes[i].x, levels.sizes[i].y);
    gl::DrawArrays(GL_TRIANGLES, 0, 3);
  }
}

void SampledMaps::reduce(ReduceBy way, GLuint depths) {
  bindTexture(kDepthsUnit, depths);
  if (way == ReduceBy::fragments) {
    gl::BindFramebuffer(GL_FRAMEBUFFER, m_frame);
    gl::BindVertexArray(m_vertexArray);
    for (const int test : {GL_DEPTH_TEST, GL_SCISSOR_TEST, GL_DEPTH_CLAMP}) gl::Disable(static_cast<GLenum>(test));
    drawLevels(kFirstExtremes, m_extremes);
    bindTexture(kExtremesUnit, m_extremes.textures.back());
    drawLevels(kFirstBounds, m_bounds);
    return;
  }
  const std::vector<glm::uvec4> zeros(1 + kMaxPartitions, glm::uvec4(0u));
  upload(m_buffers[kMaxima], zeros.data(), zeros.size());
  const GLuint x = groups(static_cast<std::size_t>(m_width), kGroupPixels), y = groups(static_cast<std::size_t>(m_height), kGroupPixels);
  use(kGroupExtremes);
  gl::DispatchCompute(x, y, 1);
  gl::MemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
  use(kGroupBounds);
  gl::DispatchCompute(x, y, static_cast<GLuint>(m_maps));
  gl::MemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT);
}

void SampledMaps::make(ReduceBy way) {
  if (way == ReduceBy::fragments) {
    bindTexture(kLevelUnit, m_bounds.textures.back());
    bindTexture(kExtremesUnit, m_extremes.textures.back());
  }
  use(way == ReduceBy::fragments ? kFinishTiles : kFinishGroups);
  gl::DispatchCompute(1, 1, 1);
  gl::MemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_UNIFORM_BARRIER_BIT);
  use(kCull);
  gl::DispatchCompute(groups(m_chunks, kCullInvocations), static_cast<GLuint>(m_maps), 1);
  gl::MemoryBarrier(GL_COMMAND_BARRIER_BIT);
}

void SampledMaps::draw() const {
  gl::BindBuffer(GL_DRAW_INDIRECT_BUFFER, m_buffers[kCommands]);
  gl::MultiDrawElementsIndirect(GL_TRIANGLES, GL_UNSIGNED_INT, nullptr, static_cast<GLsizei>(m_chunks) * m_maps, 0);
}

std::size_t SampledMaps::read(const Frame& frame, Solution& solution) const {
  gl::MemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
  download(m_buffers[kBlock], &solution.block, 1);
  std::vector<Command> commands(m_chunks * static_cast<std::size_t>(m_maps));
  download(m_buffers[kCommands], commands.data(), commands.size());
  solution.partitionCount = static_cast<int>(solution.block.info.x);
  solution.maxError = solution.neededTexels = 0.0;
  const glm::dvec3 direction = glm::normalize(frame.light.directionWs);
  for (int i = 0; i < solution.partitionCount; ++i) {
    const GnomonPartition& made = solution.block.partitions[i];
    Partition& map = solution.partitions[i] = {};
    map.near = static_cast<double>(made.interval.x);
    map.far = static_cast<double>(made.interval.y);
    map.clipFromWorld = made.clipFromWorld;
    map.viewport = glm::ivec4(made.viewport);
    map.error = certify(texelSize(map.clipFromWorld, map.viewport, direction), pixelWidth(frame.camera, frame.image, map.near));
    const glm::dmat4 rows = glm::transpose(glm::dmat4(map.clipFromWorld));
    for (const glm::dvec4& plane : {rows[3] + rows[0], rows[3] - rows[0], rows[3] + rows[1], rows[3] - rows[1]}) {
      const glm::dvec4 unit = plane / glm::length(glm::dvec3(plane));
      map.cullPlanes[map.cullPlaneCount++] = unit - glm::dvec4(0.0, 0.0, 0.0, glm::dot(glm::dvec3(unit), solution.originWs));
    }
    solution.maxError = std::max({solution.maxError, map.error.s, map.error.t});
    solution.neededTexels += map.error.s * map.error.t * map.viewport.z * map.viewport.w;
  }
  solution.storageFactor = solution.neededTexels / (frame.image.width * frame.image.height);
  solution.limitTexels = 0.0;
  std::size_t triangles = 0;
  for (const Command& command : commands) triangles += command.count / 3 * command.instances;
  return triangles;
}

}  // namespace gnomon::offscreen
