// Every include, alone, together and twice, in the versions of this release, through glslang; SPIR-V through spirv-val.
#include "glsl_compile.h"

#include <fstream>
#include <regex>
#include <set>
#include <sstream>

#include <gtest/gtest.h>

namespace gnomon::test {
namespace {

const std::vector<std::string> kIncludes{"gnomon.glsl", "gnomon_block.glsl", "gnomon_cast.glsl", "gnomon_lookup.glsl", "gnomon_pssm.glsl"};
const char* const kHook = "float gnomonCompare(int map, vec2 uv, float layer, float depth) { return depth <= uv.x ? 1.0 : 0.0; }\n";

std::string read(const std::string& name) {
  std::ifstream file(std::string(GNOMON_GLSL_DIR) + "/" + name);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

std::string withIncludes(const std::string& head, const std::vector<std::string>& names, const std::string& rest) {
  std::string out = head + "#extension GL_GOOGLE_include_directive : enable\n";
  for (const std::string& name : names) out += "#include \"" + name + "\"\n";
  return out + rest;
}

// A fragment shader that uses every function of the product.
std::string everything(const std::string& head) {
  return withIncludes(head, {"gnomon.glsl", "gnomon_cast.glsl"}, std::string(kHook) + R"(
in vec3 world; in vec3 normal;
out vec4 colour;
void main() {
  int index = gnomonSelect(gnomon, gl_FragCoord.z, world);
  float viewDepth = gnomonViewDepth(gnomon, world);
  index = max(index, gnomonSelectView(gnomon, viewDepth) + gnomonSelectWindow(gnomon, gl_FragCoord.z));
  float lit = gnomonShadow(gnomon, 0, index, world, normal) + gnomonShadow3x3(gnomon, 0, index, world, normal) + gnomonShadowTent(gnomon, 1, index, world, normal);
  vec4 position = gnomonCastAtlas(gnomon, 0, world) + gnomonCastFlat(gnomonCastPosition(gnomon, 0, world)) + gnomonCastClip(gnomon, 0, world);
  float depth = gnomonCastDepth(gnomonCastWindowDepth(gnomon, 0, world)) + float(gnomonCastLayer(gnomon, 0));
  colour = vec4(gnomonTint(index) * mix(1.0, lit, gnomonFade(gnomon, viewDepth)), gnomonGrid(gnomon, index, world) + depth) + position;
}
)");
}

TEST(Glsl, EveryIncludeCompilesAloneAndTwice) {
  for (const std::string version : {"#version 330 core\n", "#version 450\n"})
    for (const std::string& name : kIncludes) {
      const std::string rest = "out vec4 colour;\nvoid main() { colour = vec4(float(gnomon.info.x)); }\n";
      const GlslResult once = compileGlsl(GlslStage::fragment, withIncludes(version, {name}, kHook + rest));
      EXPECT_TRUE(once.isFine) << name << once.log;
      const GlslResult twice = compileGlsl(GlslStage::fragment, withIncludes(version, {name, name}, kHook + rest));
      EXPECT_TRUE(twice.isFine) << name << twice.log;
      EXPECT_EQ(once.uniformBlocks, 1) << name;
    }
}

TEST(Glsl, EverythingCompilesTogether) {
  for (const std::string version : {"#version 330 core\n", "#version 450\n"}) {
    const GlslResult result = compileGlsl(GlslStage::fragment, everything(version));
    EXPECT_TRUE(result.isFine) << result.log;
    EXPECT_EQ(result.uniformBlocks, 1);  // no texture, no sampler, no other block
    EXPECT_EQ(result.otherUniforms, 0);
  }
}

TEST(Glsl, ACastingVertexShaderCompiles) {
  for (const std::string version : {"#version 330 core\n", "#version 450\n"}) {
    const GlslResult result = compileGlsl(GlslStage::vertex, withIncludes(version, {"gnomon_cast.glsl"}, R"(
in vec3 world;
out float gl_ClipDistance[4];
void main() {
  gl_Position = gnomonCastAtlas(gnomon, 1, world);
  vec4 d = gnomonCastClip(gnomon, 1, world);
  gl_ClipDistance[0] = d.x; gl_ClipDistance[1] = d.y; gl_ClipDistance[2] = d.z; gl_ClipDistance[3] = d.w;
}
)"));
    EXPECT_TRUE(result.isFine) << result.log;
  }
}

TEST(Glsl, SpirvIsValidBeforeAndAfterOptimisation) {
  for (const GlslTarget target : {GlslTarget::openGl, GlslTarget::vulkan})
    for (const std::string binding : {"", "#define GNOMON_BINDING 3\n"}) {
      const GlslResult result = compileGlsl(GlslStage::fragment, everything("#version 450\n" + binding), target);
      ASSERT_TRUE(result.isFine) << result.log;
      EXPECT_EQ(validateSpirv(result.spirv, target), "");
    }
}

TEST(Glsl, FewerPartitionsCompile) {
  for (const int count : {1, 2, 4, 5, 8, 9, 12, 13, 16}) {
    const GlslResult result =
        compileGlsl(GlslStage::fragment, everything("#version 330 core\n#define GNOMON_MAX_PARTITIONS " + std::to_string(count) + "\n"));
    EXPECT_TRUE(result.isFine) << count << result.log;
  }
}

TEST(Glsl, OneShaderHoldsTwoLights) {
  const GlslResult result =
      compileGlsl(GlslStage::fragment, withIncludes("#version 330 core\n#define GNOMON_NO_UNIFORM\n", {"gnomon.glsl"}, R"(
layout(std140) uniform Sun { GnomonBlock sun; };
layout(std140) uniform Moon { GnomonBlock moon; };
uniform sampler2DArray sunMaps, moonMaps;
float gnomonCompare(int map, vec2 uv, float layer, float depth) {
  return depth <= (map == 0 ? texture(sunMaps, vec3(uv, layer)).r : texture(moonMaps, vec3(uv, layer)).r) ? 1.0 : 0.0;
}
in vec3 world; in vec3 normal;
out vec4 colour;
void main() {
  colour = vec4(gnomonShadow(sun, 0, gnomonSelect(sun, gl_FragCoord.z, world), world, normal),
                gnomonShadow(moon, 1, gnomonSelect(moon, gl_FragCoord.z, world), world, normal), 0.0, 1.0);
}
)"));
  EXPECT_TRUE(result.isFine) << result.log;
  EXPECT_EQ(result.uniformBlocks, 2);
}

TEST(Glsl, AMissingHookIsAnErrorThatNamesIt) {
  const std::string rest = "in vec3 world; out vec4 colour;\nvoid main() { colour = vec4(gnomonShadow(gnomon, 0, 0, world, world)); }\n";
  const GlslResult result = compileGlsl(GlslStage::fragment, withIncludes("#version 330 core\n", {"gnomon.glsl"}, rest));
  EXPECT_FALSE(result.isFine);
  EXPECT_NE(result.log.find("gnomonCompare"), std::string::npos) << result.log;
}

// Every global identifier has the library's prefix; no reserved word of the targeted versions is a name; no double underscore.
TEST(Glsl, IdentifiersArePrefixed) {
  const std::set<std::string> reserved{
      "active", "asm",    "cast",   "class",     "common", "enum",      "extern",   "external", "filter",    "fixed",    "goto",
      "half",   "inline", "input",  "interface", "long",   "namespace", "noinline", "output",   "partition", "public",   "resource",
      "sample", "short",  "sizeof", "static",    "superp", "template",  "this",     "typedef",  "union",     "unsigned", "using"};
  const std::regex comment("//[^\n]*"), define("#define +([A-Za-z_0-9]+)"), structure("struct +([A-Za-z_0-9]+)"),
      word("[A-Za-z_][A-Za-z_0-9]*"), function("\n(?:float|int|vec[234]|mat4|void|bool) +([A-Za-z_0-9]+) *\\(");
  for (const std::string& name : kIncludes) {
    const std::string text = std::regex_replace(read(name), comment, "");
    const auto each = [&](const std::regex& pattern, std::size_t group, auto check) {
      for (std::sregex_iterator i(text.begin(), text.end(), pattern), end; i != end; ++i) check((*i)[group].str());
    };
    each(define, 1, [&](const std::string& id) { EXPECT_EQ(id.rfind("GNOMON_", 0), 0u) << name << ": " << id; });
    each(structure, 1, [&](const std::string& id) { EXPECT_EQ(id.rfind("Gnomon", 0), 0u) << name << ": " << id; });
    each(function, 1, [&](const std::string& id) { EXPECT_EQ(id.rfind("gnomon", 0), 0u) << name << ": " << id; });
    each(word, 0, [&](const std::string& id) {
      EXPECT_EQ(reserved.count(id), 0u) << name << ": " << id;
      if (id != "__cplusplus") {
        EXPECT_EQ(id.find("__"), std::string::npos) << name << ": " << id;
      }
    });
  }
}

TEST(Glsl, EveryFileCarriesItsNotice) {
  for (const std::string& name : kIncludes) {
    const std::string text = read(name);
    EXPECT_EQ(text.rfind("// gnomon ", 0), 0u) << name;
    EXPECT_NE(text.find("MIT licence"), std::string::npos) << name;
    EXPECT_NE(text.find("// needs:"), std::string::npos) << name;
  }
}

}  // namespace
}  // namespace gnomon::test
