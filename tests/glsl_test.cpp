// Every include, alone, together and twice, in the versions of this release, through glslang; SPIR-V through spirv-val.
#include "glsl_compile.h"

#include <fstream>
#include <regex>
#include <set>
#include <sstream>

#include <gtest/gtest.h>

namespace gnomon::test {
namespace {

const std::vector<std::string> kIncludes{"gnomon.glsl",      "gnomon_blend.glsl",  "gnomon_block.glsl",
                                         "gnomon_cast.glsl", "gnomon_lookup.glsl", "gnomon_pssm.glsl"};
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
std::string everything(const std::string& head, bool hasLocations = false) {
  const std::string interface =
      hasLocations ? "layout(location = 0) in vec3 world;\nlayout(location = 1) in vec3 normal;\nlayout(location = 0) out vec4 colour;\n"
                   : "in vec3 world;\nin vec3 normal;\nout vec4 colour;\n";
  return withIncludes(head, {"gnomon.glsl", "gnomon_cast.glsl"}, std::string(kHook) + interface + R"(
void main() {
  int index = gnomonSelect(gnomon, gl_FragCoord.z, world);
  float viewDepth = gnomonViewDepth(gnomon, world);
  index = max(index, gnomonSelectView(gnomon, viewDepth) + gnomonSelectWindow(gnomon, gl_FragCoord.z));
  index = gnomonBlendDither(index, gnomonBlendWeight(gnomon, index, viewDepth), gl_FragCoord.xy);
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
    for (const std::string count : {"1", "4", "5", "8", "16"}) {
      const std::string head = "#version 450\n#define GNOMON_MAX_PARTITIONS " + count + "\n";
      const GlslResult mapped = compileGlsl(GlslStage::fragment, everything(head), target);
      ASSERT_TRUE(mapped.isFine) << mapped.log;
      EXPECT_EQ(validateSpirv(mapped.spirv, target), "") << count;
      const GlslResult named = compileGlsl(GlslStage::fragment, everything(head + "#define GNOMON_BINDING 3\n", true), target, false);
      ASSERT_TRUE(named.isFine) << named.log;
      EXPECT_EQ(validateSpirv(named.spirv, target), "") << count;
      EXPECT_EQ(named.bindings.at("gnomonUniforms"), 3);
    }
}

TEST(Glsl, EveryIncludeAloneMakesValidSpirv) {
  const std::string rest = "layout(location = 0) out vec4 colour;\nvoid main() { colour = vec4(float(gnomon.info.x)); }\n";
  for (const GlslTarget target : {GlslTarget::openGl, GlslTarget::vulkan})
    for (const std::string& name : kIncludes) {
      const GlslResult result =
          compileGlsl(GlslStage::fragment, withIncludes("#version 450\n#define GNOMON_BINDING 0\n", {name}, kHook + rest), target, false);
      ASSERT_TRUE(result.isFine) << name << result.log;
      EXPECT_EQ(validateSpirv(result.spirv, target), "") << name;
    }
}

// Without GNOMON_BINDING the block has none: OpenGL hosts bind it by name, and SPIR-V for Vulkan is refused unless the host maps it.
TEST(Glsl, TheBindingIsTheHosts) {
  EXPECT_FALSE(compileGlsl(GlslStage::fragment, everything("#version 450\n", true), GlslTarget::vulkan, false).isFine);
  EXPECT_EQ(compileGlsl(GlslStage::fragment, everything("#version 450\n")).bindings.at("gnomonUniforms"), -1);
  EXPECT_EQ(compileGlsl(GlslStage::fragment, everything("#version 450\n#define GNOMON_BINDING 7\n")).bindings.at("gnomonUniforms"), 7);
}

// The validator itself can fail: a module with a word cut off is refused.
TEST(Glsl, ATruncatedModuleIsRefused) {
  GlslResult result = compileGlsl(GlslStage::fragment, everything("#version 450\n"), GlslTarget::vulkan);
  ASSERT_TRUE(result.isFine);
  result.spirv.pop_back();
  EXPECT_NE(validateSpirv(result.spirv, GlslTarget::vulkan), "");
}

TEST(Glsl, FewerPartitionsCompile) {
  for (const std::string version : {"#version 330 core\n", "#version 450\n"})
    for (const int count : {1, 2, 4, 5, 8, 9, 12, 13, 16}) {
      const GlslResult result =
          compileGlsl(GlslStage::fragment, everything(version + "#define GNOMON_MAX_PARTITIONS " + std::to_string(count) + "\n"));
      EXPECT_TRUE(result.isFine) << count << result.log;
    }
}

const char* const kTwoLights = R"(
float gnomonCompare(int map, vec2 uv, float layer, float depth) {
  return depth <= (map == 0 ? texture(sunMaps, vec3(uv, layer)).r : texture(moonMaps, vec3(uv, layer)).r) ? 1.0 : 0.0;
}
void main() {
  colour = vec4(gnomonShadow(sun, 0, gnomonSelect(sun, gl_FragCoord.z, world), world, normal),
                gnomonShadow(moon, 1, gnomonSelect(moon, gl_FragCoord.z, world), world, normal), 0.0, 1.0);
}
)";

TEST(Glsl, OneShaderHoldsTwoLights) {
  for (const std::string version : {"#version 330 core\n", "#version 450\n"}) {
    const GlslResult result = compileGlsl(
        GlslStage::fragment, withIncludes(version + "#define GNOMON_NO_UNIFORM\n", {"gnomon.glsl", "gnomon_cast.glsl"}, std::string(R"(
layout(std140) uniform Sun { GnomonBlock sun; };
layout(std140) uniform Moon { GnomonBlock moon; };
uniform sampler2DArray sunMaps, moonMaps;
in vec3 world; in vec3 normal;
out vec4 colour;
)") + kTwoLights));
    EXPECT_TRUE(result.isFine) << result.log;
    EXPECT_EQ(result.uniformBlocks, 2);
    EXPECT_EQ(result.otherUniforms, 2);  // the host's two samplers
  }
  for (const GlslTarget target : {GlslTarget::openGl, GlslTarget::vulkan}) {
    const GlslResult result =
        compileGlsl(GlslStage::fragment, withIncludes("#version 450\n#define GNOMON_NO_UNIFORM\n", {"gnomon.glsl"}, std::string(R"(
layout(std140, binding = 0) uniform Sun { GnomonBlock sun; };
layout(std140, binding = 1) uniform Moon { GnomonBlock moon; };
layout(binding = 2) uniform sampler2DArray sunMaps;
layout(binding = 3) uniform sampler2DArray moonMaps;
layout(location = 0) in vec3 world;
layout(location = 1) in vec3 normal;
layout(location = 0) out vec4 colour;
)") + kTwoLights),
                    target, false);
    ASSERT_TRUE(result.isFine) << result.log;
    EXPECT_EQ(validateSpirv(result.spirv, target), "");
  }
}

// The includes declare the hook and the host defines it: without it a shader compiles and does not link, and the log names it.
TEST(Glsl, AMissingHookIsALinkErrorThatNamesIt) {
  for (const std::string version : {"#version 330 core\n", "#version 450\n"}) {
    const std::string rest = "in vec3 world; out vec4 colour;\nvoid main() { colour = vec4(gnomonShadow(gnomon, 0, 0, world, world)); }\n";
    const GlslResult result = compileGlsl(GlslStage::fragment, withIncludes(version, {"gnomon.glsl"}, rest));
    EXPECT_TRUE(result.isCompiled) << result.log;
    EXPECT_FALSE(result.isFine);
    EXPECT_NE(result.log.find("gnomonCompare"), std::string::npos) << result.log;
    // A shader that asks for no shadow needs no hook.
    const GlslResult selects = compileGlsl(
        GlslStage::fragment,
        withIncludes(version, {"gnomon.glsl"},
                     "out vec4 colour;\nvoid main() { colour = vec4(gnomonTint(gnomonSelectWindow(gnomon, gl_FragCoord.z)), 1.0); }\n"));
    EXPECT_TRUE(selects.isFine) << selects.log;
  }
}

// Every global name that a text defines: macros, structs, functions.
struct Names {
  std::vector<std::string> macros, structs, functions;
};

std::string withoutComments(const std::string& text) { return std::regex_replace(text, std::regex("//[^\n]*"), ""); }

Names namesOf(const std::string& text) {
  Names names;
  const auto gather = [&](const char* pattern, std::vector<std::string>& out) {
    const std::regex regex(pattern);
    for (std::sregex_iterator i(text.begin(), text.end(), regex), end; i != end; ++i) out.push_back((*i)[1].str());
  };
  gather("#define +([A-Za-z_0-9]+)", names.macros);
  gather("struct +([A-Za-z_0-9]+)", names.structs);
  gather("\n(?:float|u?int|[iub]?vec[234]|mat[234]|void|bool|Gnomon[A-Za-z]+) +([A-Za-z_0-9]+) *\\(", names.functions);
  return names;
}

// Words that some GLSL up to 4.60, or ES up to 3.20, keeps for itself and that no text of ours needs.
const std::set<std::string> kReserved{
    "active",  "asm",       "atomic_uint", "attribute", "buffer",    "cast",     "centroid",   "class",    "coherent",
    "common",  "double",    "enum",        "extern",    "external",  "filter",   "fixed",      "flat",     "goto",
    "half",    "inline",    "input",       "interface", "invariant", "long",     "namespace",  "noinline", "noperspective",
    "output",  "partition", "patch",       "precise",   "public",    "readonly", "resource",   "restrict", "sample",
    "sampler", "shared",    "short",       "sizeof",    "smooth",    "static",   "subroutine", "superp",   "template",
    "texture", "this",      "typedef",     "union",     "unsigned",  "using",    "varying",    "volatile", "writeonly"};

// What is wrong with a text's names; empty: nothing.
std::string badNames(const std::string& source) {
  const std::string text = withoutComments(source);
  const Names names = namesOf(text);
  std::string bad;
  const auto prefixed = [&](const std::vector<std::string>& list, const std::regex& pattern) {
    for (const std::string& name : list)
      if (!std::regex_match(name, pattern)) bad += name + " ";
  };
  prefixed(names.macros, std::regex("GNOMON_[A-Z0-9_]+"));
  prefixed(names.structs, std::regex("Gnomon[A-Z][A-Za-z0-9]*"));
  prefixed(names.functions, std::regex("gnomon[A-Z][A-Za-z0-9]*"));
  const std::regex word("[A-Za-z_][A-Za-z_0-9]*");
  for (std::sregex_iterator i(text.begin(), text.end(), word), end; i != end; ++i) {
    const std::string name = i->str();
    if (kReserved.count(name) != 0 || (name != "__cplusplus" && name.find("__") != std::string::npos) || name.rfind("gl_", 0) == 0)
      bad += name + " ";
  }
  return bad;
}

TEST(Glsl, IdentifiersArePrefixed) {
  std::size_t functions = 0;
  for (const std::string& name : kIncludes) {
    EXPECT_EQ(badNames(read(name)), "") << name;
    functions += namesOf(withoutComments(read(name))).functions.size();
  }
  EXPECT_GE(functions, 20u);  // the pattern still finds them
  // The check itself can fail.
  for (const char* bad : {"#define MAX 1\n", "struct Partition { int x; };", "\nfloat lookup(int x) {", "int gnomonA__b;",
                          "float partition;", "vec4 sample;", "\nvec2 gnomon(int x)", "float x = gl_FragCoord.z;"})
    EXPECT_NE(badNames(bad), "") << bad;
}

// No texture, sampler or binding but the block's own, which the host sets; no derivative, so that a lookup works in any flow.
TEST(Glsl, NoFileDeclaresResources) {
  const std::regex resource(
      "\\b(sampler[A-Za-z0-9]*|image[A-Za-z0-9]*|texture[A-Za-z0-9]*|texelFetch|binding|location|buffer|dFd[xy]|fwidth)\\b");
  for (const std::string& name : kIncludes) {
    std::string text = withoutComments(read(name));
    const std::string own = "layout(std140, binding = GNOMON_BINDING) uniform gnomonUniforms";
    if (const auto at = text.find(own); at != std::string::npos) text.erase(at, own.size());
    std::smatch found;
    EXPECT_FALSE(std::regex_search(text, found, resource)) << name << ": " << found.str();
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
