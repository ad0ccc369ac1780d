// cost: what each lookup costs a fragment: SPIR-V instructions after spirv-opt -O, and processor time under OSMesa over a shader with one
// plain shadow lookup, shader after shader in turn, as medians of ratios within a turn.
#include <algorithm>
#include <cstddef>
#include <array>
#include <cstdio>
#include <ctime>
#include <string>
#include <vector>

#include <glm/gtc/matrix_transform.hpp>
#include <spirv-tools/optimizer.hpp>

#include "glsl_compile.h"
#include "shader.h"
#include "support.h"

namespace {

using namespace gnomon;
using namespace gnomon::offscreen;
using namespace gnomon::test;
using namespace gnomon::check;

constexpr int kWidth = 1280, kHeight = 720, kMap = 2048, kMaps = 4, kTurns = 60;

const char* const kVertex = R"(
layout(location = 0) in vec3 position;
uniform mat4 clipFromWorld;
#include "gnomon_block.glsl"
#ifdef VERTEX_POSITIONS
out vec4 at0, at1, at2, at3;
#endif
out vec3 world;
void main() {
#ifdef VERTEX_POSITIONS
  at0 = gnomonVertexPosition(gnomon, 0, position);
  at1 = gnomonVertexPosition(gnomon, 1, position);
  at2 = gnomonVertexPosition(gnomon, 2, position);
  at3 = gnomonVertexPosition(gnomon, 3, position);
#endif
world = position; gl_Position = clipFromWorld * vec4(position, 1.0); }
)";

const char* const kHead = R"(
uniform sampler2DArrayShadow maps;
in vec3 world;
layout(location = 0) out vec4 colour;
float gnomonCompare(int map, vec2 uv, float layer, float depth) { return texture(maps, vec4(uv, layer, depth)); }
)";

struct Case {
  const char* name;
  int held;
  const char* body;  // of main
  bool hasVertexPositions = false;
};

// The plain lookup: one map, its matrix fixed, no bias. The if-chain chooses one of four maps and does no more.
const Case kCases[] = {
    {"plain lookup", 4, "vec4 p = gnomon.partitions[1].atlasFromWorld * vec4(world, 1.0); lit = texture(maps, vec4(p.xy, 1.0, p.z));"},
    {"if-chain of 4 and plain lookup", 4,
     "int i = 0; if (gl_FragCoord.z >= gnomon.windowStart[0].y) i = 1; if (gl_FragCoord.z >= gnomon.windowStart[0].z) i = 2; "
     "if (gl_FragCoord.z >= gnomon.windowStart[0].w) i = 3; vec4 p = gnomon.partitions[i].atlasFromWorld * vec4(world, 1.0); "
     "lit = texture(maps, vec4(p.xy, float(i), p.z));"},
    {"gnomonSelectWindow and plain lookup", 4,
     "int i = max(gnomonSelectWindow(gnomon, gl_FragCoord.z), 0); vec4 p = gnomon.partitions[i].atlasFromWorld * vec4(world, 1.0); "
     "lit = texture(maps, vec4(p.xy, float(i), p.z));"},
    {"positions of the vertex stage, gnomonPick4", 4,
     "vec4 p = gnomonPick4(gnomon, gl_FragCoord.z, at0, at1, at2, at3); lit = texture(maps, vec4(p.xy, p.w, p.z));", true},
    {"gnomonSelect, gnomonShadow", 4,
     "int index = gnomonSelect(gnomon, gl_FragCoord.z, world); lit = gnomonShadow(gnomon, 0, index, world, up);"},
    {"gnomonSelect, gnomonShadow3x3", 4,
     "int index = gnomonSelect(gnomon, gl_FragCoord.z, world); lit = gnomonShadow3x3(gnomon, 0, index, world, up);"},
    {"gnomonSelect, gnomonShadowTent", 4,
     "int index = gnomonSelect(gnomon, gl_FragCoord.z, world); lit = gnomonShadowTent(gnomon, 0, index, world, up);"},
    {"gnomonSelectMask and plain lookup", 4,
     "int i = max(gnomonSelectMask(gnomon, world), 0); vec4 p = gnomon.partitions[i].atlasFromWorld * vec4(world, 1.0); "
     "lit = texture(maps, vec4(p.xy, float(i), p.z));"},
    {"gnomonSelectCell and plain lookup", 4,
     "int i = max(gnomonSelectCell(gnomon, world), 0); vec4 p = gnomon.partitions[i].atlasFromWorld * vec4(world, 1.0); "
     "lit = texture(maps, vec4(p.xy, float(i), p.z));"},
    {"gnomonSearchCell and plain lookup", 4,
     "int i = max(gnomonSearchCell(gnomon, world), 0); vec4 p = gnomon.partitions[i].atlasFromWorld * vec4(world, 1.0); "
     "lit = texture(maps, vec4(p.xy, float(i), p.z));"},
    {"gnomonSelectMask and plain lookup, 16 held", 16,
     "int i = max(gnomonSelectMask(gnomon, world), 0); vec4 p = gnomon.partitions[i].atlasFromWorld * vec4(world, 1.0); "
     "lit = texture(maps, vec4(p.xy, float(i), p.z));"},
    {"gnomonSelectCell and plain lookup, 16 held", 16,
     "int i = max(gnomonSelectCell(gnomon, world), 0); vec4 p = gnomon.partitions[i].atlasFromWorld * vec4(world, 1.0); "
     "lit = texture(maps, vec4(p.xy, float(i), p.z));"},
    {"gnomonSelect, gnomonShadow, 16 held", 16,
     "int index = gnomonSelect(gnomon, gl_FragCoord.z, world); lit = gnomonShadow(gnomon, 0, index, world, up);"}};

std::string headOf(const Case& each) { return "#define GNOMON_MAX_PARTITIONS " + std::to_string(each.held) + "\n"; }

std::string sourceOf(const Case& each) {
  return headOf(each) + "#include \"gnomon.glsl\"\n" + kHead + (each.hasVertexPositions ? "in vec4 at0, at1, at2, at3;\n" : "") +
         "void main() {\n  vec3 up = vec3(0.0, 1.0, 0.0);\n  float lit;\n  " + each.body + "\n  colour = vec4(lit);\n}\n";
}

// Instructions inside functions, but for labels and variables.
int instructionsOf(const std::string& source) {
  constexpr std::size_t kHeader = 5;
  constexpr std::uint32_t kOpFunction = 54, kOpFunctionParameter = 55, kOpFunctionEnd = 56, kOpVariable = 59, kOpLabel = 248;
  const GlslResult result =
      compileGlsl(GlslStage::fragment, "#version 450\n#extension GL_GOOGLE_include_directive : enable\n" + source, GlslTarget::vulkan);
  if (!result.isFine) throw std::runtime_error(result.log);
  spvtools::Optimizer optimizer(SPV_ENV_VULKAN_1_1);
  optimizer.RegisterPerformancePasses();
  std::vector<std::uint32_t> spirv;
  if (!optimizer.Run(result.spirv.data(), result.spirv.size(), &spirv)) throw std::runtime_error("spirv-opt: refused");
  int count = 0;
  bool isInside = false;
  for (std::size_t at = kHeader; at < spirv.size(); at += spirv[at] >> 16) {
    const std::uint32_t operation = spirv[at] & 0xffff;
    isInside = (isInside || operation == kOpFunction) && operation != kOpFunctionEnd;
    count += isInside && operation != kOpFunction && operation != kOpFunctionParameter && operation != kOpVariable && operation != kOpLabel;
  }
  return count;
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

GLuint makeTexture(GLenum target) {
  GLuint name = 0;
  gl::GenTextures(1, &name);
  gl::BindTexture(target, name);
  for (const GLenum side : {GL_TEXTURE_MIN_FILTER, GL_TEXTURE_MAG_FILTER}) gl::TexParameteri(target, side, GL_LINEAR);
  return name;
}

void measure() {
  const auto context = createContext(Backend::osmesa, 4, 5);
  gl::load(*context);
  Frame frame = usualFrame();
  frame.shadowMap.layout = MapLayout::layers;
  frame.budget.partitions = kMaps;
  const auto solution = solve(frame);
  // The rows that cells are found by, beside the slices that the other lookups need.
  Solution inRows;
  if (solveLspsm(frame, {.rows = {.maxColumns = 1}}, inRows) != Status::ok) throw std::runtime_error("lspsm: refused");
  const auto* const from = reinterpret_cast<const unsigned char*>(&inRows.block);
  std::copy(from + offsetof(GnomonBlock, rowAlong), from + offsetof(GnomonBlock, partitions),
            reinterpret_cast<unsigned char*>(&solution->block) + offsetof(GnomonBlock, rowAlong));

  // A surface over the whole image whose depth runs through every partition.
  std::vector<glm::vec3> corners;
  for (const double y : {0.0, 1.0})
    for (const double x : {0.0, 1.0}) corners.emplace_back(viewPoint(frame.camera, x, y, y == 0.0 ? 0.3 : 60.0));
  GLuint vertexArray = 0, framebuffer = 0;
  std::array<GLuint, 2> buffers{};
  gl::GenVertexArrays(1, &vertexArray);
  gl::BindVertexArray(vertexArray);
  gl::GenBuffers(2, buffers.data());
  gl::BindBuffer(GL_ARRAY_BUFFER, buffers[0]);
  gl::BufferData(GL_ARRAY_BUFFER, static_cast<GLsizeiptr>(corners.size() * sizeof(glm::vec3)), corners.data(), GL_STATIC_DRAW);
  gl::EnableVertexAttribArray(0);
  gl::VertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, sizeof(glm::vec3), nullptr);
  gl::BindBuffer(GL_UNIFORM_BUFFER, buffers[1]);
  gl::BufferData(GL_UNIFORM_BUFFER, sizeof solution->block, &solution->block, GL_STATIC_DRAW);
  gl::BindBufferBase(GL_UNIFORM_BUFFER, 0, buffers[1]);

  const GLuint image = makeTexture(GL_TEXTURE_2D);
  gl::TexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, kWidth, kHeight, 0, GL_RGBA, GL_UNSIGNED_BYTE, nullptr);
  gl::GenFramebuffers(1, &framebuffer);
  gl::BindFramebuffer(GL_FRAMEBUFFER, framebuffer);
  gl::FramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, image, 0);
  gl::Viewport(0, 0, kWidth, kHeight);
  makeTexture(GL_TEXTURE_2D_ARRAY);
  gl::TexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_COMPARE_MODE, GL_COMPARE_REF_TO_TEXTURE);
  gl::TexImage3D(GL_TEXTURE_2D_ARRAY, 0, GL_DEPTH_COMPONENT32F, kMap, kMap, kMaps, 0, GL_DEPTH_COMPONENT, GL_FLOAT,
                 std::vector<float>(static_cast<std::size_t>(kMap) * kMap * kMaps, 0.5f).data());

  const Camera& camera = frame.camera;
  const Axes axes(camera);
  const glm::mat4 clip(glm::frustum(-camera.left * camera.near, camera.right * camera.near, -camera.down * camera.near,
                                    camera.up * camera.near, camera.near, camera.far) *
                       glm::lookAt(glm::dvec3(0.0), axes.forward, axes.up));
  std::vector<GLuint> programs;
  for (const Case& each : kCases) {
    programs.push_back(
        buildProgram("450", {{GL_VERTEX_SHADER, headOf(each) + (each.hasVertexPositions ? "#define VERTEX_POSITIONS\n" : "") + kVertex},
                             {GL_FRAGMENT_SHADER, sourceOf(each)}}));
    gl::UseProgram(programs.back());
    gl::UniformMatrix4fv(gl::GetUniformLocation(programs.back(), "clipFromWorld"), 1, GL_FALSE, &clip[0][0]);
  }
  std::vector<std::vector<double>> seconds(programs.size());
  for (int turn = 0; turn <= kTurns; ++turn)  // the first one compiles
    for (std::size_t i = 0; i < programs.size(); ++i) {
      gl::UseProgram(programs[i]);
      gl::Finish();
      const std::clock_t start = std::clock();  // of every thread: other work on the machine does not count
      gl::DrawArrays(GL_TRIANGLE_STRIP, 0, 4);
      gl::Finish();
      if (turn > 0) seconds[i].push_back(static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC);
    }

  std::printf("%-44s %12s %9s %10s %13s\n", "", "SPIR-V", "ns/pixel", "over plain", "over if-chain");
  for (std::size_t i = 0; i < programs.size(); ++i) {
    const auto over = [&](std::size_t base) {
      std::vector<double> ratios;
      for (std::size_t turn = 0; turn < seconds[i].size(); ++turn) ratios.push_back(seconds[i][turn] / seconds[base][turn]);
      return median(ratios);
    };
    std::printf("%-44s %12d %9.1f %10.2f %13.2f\n", kCases[i].name, instructionsOf(sourceOf(kCases[i])),
                median(seconds[i]) / (kWidth * kHeight) * 1e9, over(0), over(1));
  }
}

}  // namespace

int main() {
  try {
    measure();
  } catch (const std::exception& error) {
    std::fprintf(stderr, "gnomon_cost: %s\n", error.what());
    return 1;
  }
}
