// The block's layout, three ways: C++ (offsetof), glslang's reflection and the driver.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "glsl_compile.h"
#include "shader.h"
#include "support.h"

namespace gnomon::test {
namespace {

using namespace check;

const char* const kReader = R"(
#include "gnomon_block.glsl"
uniform int which;
out vec4 colour;
void main() {
  GnomonPartition p = gnomon.partitions[which];
  colour = p.clipFromWorld[0] + p.atlasFromWorld[1] + p.viewport + p.uvBounds + p.interval + p.layer + p.axis + p.left + p.right + p.range + vec4(gnomon.info) + gnomon.atlas + gnomon.origin +
           gnomon.originRest + gnomon.lightDirection + gnomon.viewPlane + gnomon.depthRule + gnomon.bias + gnomon.windowStart[which] + gnomon.viewStart[which] +
           gnomon.rowAlong + gnomon.rowAcross + gnomon.rowRule + vec4(gnomon.rowCells) + gnomon.rowStart[which] + gnomon.rows[which];
}
)";

std::map<std::string, std::size_t> expected() {
  std::map<std::string, std::size_t> out;
#define GNOMON_TEST_MEMBER(name) out["gnomon." #name] = offsetof(GnomonBlock, name);
  GNOMON_TEST_MEMBER(info)
  GNOMON_TEST_MEMBER(atlas)
  GNOMON_TEST_MEMBER(origin)
  GNOMON_TEST_MEMBER(originRest)
  GNOMON_TEST_MEMBER(lightDirection)
  GNOMON_TEST_MEMBER(viewPlane)
  GNOMON_TEST_MEMBER(depthRule)
  GNOMON_TEST_MEMBER(bias)
  GNOMON_TEST_MEMBER(rowAlong)
  GNOMON_TEST_MEMBER(rowAcross)
  GNOMON_TEST_MEMBER(rowRule)
  GNOMON_TEST_MEMBER(rowCells)
#undef GNOMON_TEST_MEMBER
  out["gnomon.windowStart[0]"] = offsetof(GnomonBlock, windowStart);
  out["gnomon.viewStart[0]"] = offsetof(GnomonBlock, viewStart);
  out["gnomon.rowStart[0]"] = offsetof(GnomonBlock, rowStart);
  out["gnomon.rows[0]"] = offsetof(GnomonBlock, rows);
  for (std::size_t i = 0; i < GNOMON_MAX_PARTITIONS; ++i) {
    const std::string p = "gnomon.partitions[" + std::to_string(i) + "].";
    const std::size_t start = offsetof(GnomonBlock, partitions) + i * sizeof(GnomonPartition);
#define GNOMON_TEST_MEMBER(name) out[p + #name] = start + offsetof(GnomonPartition, name);
    GNOMON_TEST_MEMBER(clipFromWorld)
    GNOMON_TEST_MEMBER(atlasFromWorld)
    GNOMON_TEST_MEMBER(viewport)
    GNOMON_TEST_MEMBER(uvBounds)
    GNOMON_TEST_MEMBER(interval)
    GNOMON_TEST_MEMBER(layer)
    GNOMON_TEST_MEMBER(axis)
    GNOMON_TEST_MEMBER(left)
    GNOMON_TEST_MEMBER(right)
    GNOMON_TEST_MEMBER(range)
#undef GNOMON_TEST_MEMBER
  }
  return out;
}

// glslang also names an array of structs without an index: its first element.
std::string plain(std::string name) {
  const std::string array = "gnomon.partitions.";
  if (name.rfind(array, 0) == 0) name = "gnomon.partitions[0]." + name.substr(array.size());
  return name;
}

TEST(Block, GlslangAgreesWithCpp) {
  const GlslResult result =
      compileGlsl(GlslStage::fragment, std::string("#version 330 core\n#extension GL_GOOGLE_include_directive : enable\n") + kReader);
  ASSERT_TRUE(result.isFine) << result.log;
  const auto offsets = expected();
  std::set<std::string> found;
  for (const auto& [reflected, offset] : result.offsets) {
    const std::string name = plain(reflected);
    auto at = offsets.find(name);
    if (at == offsets.end()) at = offsets.find(name + "[0]");  // arrays of plain vectors
    ASSERT_NE(at, offsets.end()) << name;
    EXPECT_EQ(static_cast<std::size_t>(offset), at->second) << name;
    found.insert(at->first);
  }
  EXPECT_EQ(found.size(), offsets.size());
}

TEST(Block, TheDriverAgreesWithCpp) {
  using namespace gnomon::offscreen;
  const auto context = createContext(defaultBackend(), 4, 5);
  gl::load(*context);
  for (const char* version : {"330 core", "450"}) {
    const GLuint program =
        buildProgram(version, {{GL_VERTEX_SHADER, "void main() { gl_Position = vec4(0.0); }\n"}, {GL_FRAGMENT_SHADER, kReader}});
    for (const auto& [name, offset] : expected()) {
      const char* text = name.c_str();
      GLuint index = GL_INVALID_INDEX;
      gl::GetUniformIndices(program, 1, &text, &index);
      ASSERT_NE(index, GL_INVALID_INDEX) << name;
      GLint actual = -1;
      gl::GetActiveUniformsiv(program, 1, &index, GL_UNIFORM_OFFSET, &actual);
      EXPECT_EQ(static_cast<std::size_t>(actual), offset) << name;
      const auto ask = [&](GLenum what) {
        GLint value = -1;
        gl::GetActiveUniformsiv(program, 1, &index, what, &value);
        return value;
      };
      const bool isMatrix = name.find("FromWorld") != std::string::npos, isRow = name == "gnomon.rows[0]";
      const bool isArray = isRow || name.find("Start[0]") != std::string::npos;
      const bool isWhole = name == "gnomon.info" || name == "gnomon.rowCells";
      EXPECT_EQ(ask(GL_UNIFORM_TYPE), isMatrix ? GL_FLOAT_MAT4 : (isWhole ? GL_UNSIGNED_INT_VEC4 : GL_FLOAT_VEC4)) << name;
      EXPECT_EQ(ask(GL_UNIFORM_MATRIX_STRIDE), isMatrix ? static_cast<GLint>(sizeof(glm::mat4::col_type)) : 0) << name;
      EXPECT_EQ(ask(GL_UNIFORM_IS_ROW_MAJOR), 0) << name;
      EXPECT_EQ(ask(GL_UNIFORM_ARRAY_STRIDE), isArray ? static_cast<GLint>(sizeof(vec4)) : 0) << name;
      EXPECT_EQ(ask(GL_UNIFORM_SIZE), isRow ? 16 : isArray ? 4 : 1) << name;
    }
    gl::DeleteProgram(program);
  }
}

// A shader that holds fewer maps reads a prefix of the block: nothing before the array moves.
TEST(Block, FewerPartitionsAreAPrefix) {
  const auto offsets = expected();
  for (const std::string count : {"1", "4", "5", "8"}) {
    const GlslResult result = compileGlsl(
        GlslStage::fragment,
        "#version 330 core\n#extension GL_GOOGLE_include_directive : enable\n#define GNOMON_MAX_PARTITIONS " + count + "\n" + kReader);
    ASSERT_TRUE(result.isFine) << result.log;
    constexpr std::size_t kHead = 16, kPartition = 10;  // members
    std::set<std::string> found;
    for (const auto& [reflected, offset] : result.offsets) {
      auto at = offsets.find(plain(reflected));
      if (at == offsets.end()) at = offsets.find(plain(reflected) + "[0]");
      ASSERT_NE(at, offsets.end()) << reflected;
      EXPECT_EQ(static_cast<std::size_t>(offset), at->second) << reflected;
      found.insert(at->first);
    }
    EXPECT_EQ(found.size(), kHead + kPartition * std::stoul(count));
  }
}

TEST(Block, ClearedItHoldsNothingAndIsFinite) {
  GnomonBlock block;
  std::fill_n(reinterpret_cast<unsigned char*>(&block), sizeof block, static_cast<unsigned char>(0xff));  // every float not a number
  clearBlock(block);
  const auto* const head = reinterpret_cast<const float*>(&block);
  constexpr std::size_t kCells = offsetof(GnomonBlock, rowCells) / sizeof(float), kWhole = sizeof(uvec4) / sizeof(float);
  for (std::size_t i = kWhole; i < offsetof(GnomonBlock, partitions) / sizeof(float); ++i) {
    if (i >= kCells && i < kCells + kWhole) continue;
    EXPECT_TRUE(std::isfinite(head[i])) << i;
  }
  EXPECT_NEAR(glm::length(glm::vec3(block.lightDirection)), 1.0f, 1e-6f);
  for (int i = 0; i < 4; ++i) {
    EXPECT_EQ(block.windowStart[i], vec4(3e38f));  // the value that glsl/gnomon_block.glsl promises
    EXPECT_EQ(block.viewStart[i], vec4(3e38f));
    EXPECT_EQ(block.rowStart[i], vec4(3e38f));
    EXPECT_EQ(block.rowCells[i], 0xffffffffu);
  }
  EXPECT_EQ(block.info, uvec4(0u, 0u, static_cast<unsigned>(GNOMON_LAYOUT_VERSION), 0u));
  for (const float depth : {-1.0f, 0.0f, 0.5f, 1.0f, 1e30f}) {
    EXPECT_EQ(selectByWindowDepth(block, depth), -1);
    EXPECT_EQ(selectByViewDepth(block, depth), -1);
  }
}

TEST(Block, OriginIsKeptInTwoFloats) {
  Frame frame = usualFrame();
  frame.camera.positionWs = {1234567.891, -98765.4321, 1e7 + 0.123};
  const auto solution = solve(frame);
  const glm::dvec3 sum = glm::dvec3(glm::vec3(solution->block.origin)) + glm::dvec3(glm::vec3(solution->block.originRest));
  for (int i = 0; i < 3; ++i) EXPECT_NEAR(sum[i], frame.camera.positionWs[i], 1e-7);
}

TEST(Block, FlagsAndCounts) {
  const auto solution = solve(usualFrame());
  EXPECT_EQ(solution->block.info.x, 4u);
  EXPECT_EQ(solution->block.info.y, GNOMON_FLAG_DEPTH_CLAMP);
  EXPECT_EQ(solution->block.info.w, 1u);
  Frame frame = usualFrame();
  const std::vector<Box> casters{{{0, 0, 0}, {1, 1, 1}}};
  frame.scene.casters = casters;
  EXPECT_EQ(solve(frame)->block.info.y, 0u);
}

}  // namespace
}  // namespace gnomon::test
