// Every include, alone, together, twice and flat, in each dialect, through glslang; SPIR-V through spirv-val; HLSL and MSL as far as the
// tools here can tell.
#include "glsl_compile.h"

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <regex>
#include <set>
#include <sstream>

#include <gtest/gtest.h>
#include <spirv-tools/optimizer.hpp>

#include "gnomon/block.h"
#include "translate.h"

namespace gnomon::test {
namespace {

using namespace check;

const std::vector<std::string> kVersions{"330 core", "410", "450", "460", "300 es", "310 es", "320 es"};
const char* const kHook = "float gnomonCompare(int map, vec2 uv, float layer, float depth) { return depth <= uv.x ? 1.0 : 0.0; }\n";

std::string head(const std::string& version) { return "#version " + version + "\n"; }

std::string readFile(const std::string& path) {
  std::ifstream file(path);
  EXPECT_TRUE(file.is_open()) << path;
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}
std::string read(const std::string& name) { return readFile(std::string(GNOMON_GLSL_DIR) + "/" + name); }
std::string readBuilt(const std::string& name) { return readFile(std::string(GNOMON_GLSL_BUILT_DIR) + "/" + name); }

std::vector<std::string> findIncludes() {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(GNOMON_GLSL_DIR))
    if (entry.path().extension() == ".glsl") names.push_back(entry.path().filename());
  std::sort(names.begin(), names.end());
  return names;
}
const std::vector<std::string> kIncludes = findIncludes();

std::string withIncludes(const std::string& head, const std::vector<std::string>& names, const std::string& rest) {
  std::string out = head + "#extension GL_GOOGLE_include_directive : enable\n";
  for (const std::string& name : names) out += "#include \"" + name + "\"\n";
  return out + rest;
}

// glsl/translate.frag, a fragment shader that uses every function of the product, under another head.
std::string everything(const std::string& head, bool hasLocations = false) {
  std::string text = std::regex_replace(read("translate.frag"), std::regex("#(version|define|extension)[^\n]*\n"), "");
  if (!hasLocations) text = std::regex_replace(text, std::regex("layout\\([^)]*\\) (in|out|uniform)"), "$1");
  return withIncludes(head, {}, text);
}

TEST(Glsl, EveryIncludeCompilesAloneAndTwice) {
  for (const std::string& version : kVersions)
    for (const std::string& name : kIncludes) {
      const std::string rest = "out vec4 colour;\nvoid main() { colour = vec4(float(gnomon.info.x)); }\n";
      const GlslResult once = compileGlsl(GlslStage::fragment, withIncludes(head(version), {name}, kHook + rest));
      EXPECT_TRUE(once.isFine) << version << " " << name << once.log;
      const GlslResult twice = compileGlsl(GlslStage::fragment, withIncludes(head(version), {name, name}, kHook + rest));
      EXPECT_TRUE(twice.isFine) << version << " " << name << twice.log;
      EXPECT_EQ(once.uniformBlocks, 1) << name;
      const std::string flat = readBuilt("flat/" + name);
      EXPECT_EQ(flat.find("\n#include"), std::string::npos) << name;
      EXPECT_EQ(flat.find("\n#line"), std::string::npos) << name;
      const GlslResult flatTwice = compileGlsl(GlslStage::fragment, head(version) + flat + flat + kHook + rest);
      EXPECT_TRUE(flatTwice.isFine) << version << " flat " << name << flatTwice.log;
      EXPECT_EQ(flatTwice.offsets, once.offsets) << name;
    }
}

TEST(Glsl, EverythingCompilesTogether) {
  for (const std::string& version : kVersions) {
    const GlslResult result = compileGlsl(GlslStage::fragment, everything(head(version)));
    EXPECT_TRUE(result.isFine) << version << result.log;
    EXPECT_EQ(result.uniformBlocks, 1);
    EXPECT_EQ(result.otherUniforms, 1);  // the host's sampler
  }
}

// ES has no clip distances, and one pass for each map needs none.
TEST(Glsl, ACastingVertexShaderCompiles) {
  for (const std::string& version : kVersions) {
    const std::string plain =
        "in vec3 world;\nuniform int index;\nvoid main() { gl_Position = gnomonCastPosition(gnomon, index, world); }\n";
    const GlslResult each = compileGlsl(GlslStage::vertex, withIncludes(head(version), {"gnomon_cast.glsl"}, plain));
    EXPECT_TRUE(each.isFine) << version << each.log;
    if (version.find("es") != std::string::npos) continue;
    const GlslResult result = compileGlsl(GlslStage::vertex, withIncludes(head(version), {"gnomon_cast.glsl"}, R"(
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

struct SpirvCase {
  std::string version;
  GlslTarget target;
  bool canName;  // the dialect has bindings and locations of its own
};
const std::vector<SpirvCase> kSpirvCases{{"330 core", GlslTarget::openGl, false}, {"410", GlslTarget::openGl, false},
                                         {"450", GlslTarget::openGl, true},       {"310 es", GlslTarget::openGl, true},
                                         {"450", GlslTarget::vulkan, true},       {"310 es", GlslTarget::vulkan, true}};

std::vector<std::uint32_t> optimised(const std::vector<std::uint32_t>& spirv) {
  spvtools::Optimizer optimizer(SPV_ENV_VULKAN_1_1);
  optimizer.RegisterPerformancePasses();
  std::vector<std::uint32_t> out;
  EXPECT_TRUE(optimizer.Run(spirv.data(), spirv.size(), &out));
  return out;
}

// A local copy of a uniform array that is read by index: private memory for each fragment, which no optimiser removes.
bool hasLocalArray(const std::vector<std::uint32_t>& spirv) {
  constexpr std::size_t kHeader = 5;
  constexpr std::uint32_t kOpTypeArray = 28, kOpTypePointer = 32, kOpVariable = 59, kFunction = 7;
  std::set<std::uint32_t> arrays, pointers;
  for (std::size_t at = kHeader; at < spirv.size(); at += spirv[at] >> 16) {
    const std::uint32_t operation = spirv[at] & 0xffff;
    if (operation == kOpTypeArray) arrays.insert(spirv[at + 1]);
    if (operation == kOpTypePointer && spirv[at + 2] == kFunction && arrays.count(spirv[at + 3]) > 0) pointers.insert(spirv[at + 1]);
    if (operation == kOpVariable && pointers.count(spirv[at + 1]) > 0) return true;
  }
  return false;
}

TEST(Glsl, SpirvIsValidBeforeAndAfterOptimisation) {
  for (const auto& [version, target, canName] : kSpirvCases)
    for (const std::string count : {"1", "3", "4", "8", "16"}) {
      const std::string start = head(version) + "#define GNOMON_MAX_PARTITIONS " + count + "\n";
      const GlslResult mapped = compileGlsl(GlslStage::fragment, everything(start), target);
      ASSERT_TRUE(mapped.isFine) << version << mapped.log;
      EXPECT_EQ(validateSpirv(mapped.spirv, target), "") << version << " " << count;
      if (!canName || count != "4") continue;
      const GlslResult named = compileGlsl(GlslStage::fragment, everything(start + "#define GNOMON_BINDING 3\n", true), target, false);
      ASSERT_TRUE(named.isFine) << version << named.log;
      EXPECT_EQ(validateSpirv(named.spirv, target), "") << version << " " << count;
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
  for (const std::string& version : kVersions)
    for (const int count : {1, 2, 3, 4, 5, 8, 9, 12, 13, 16}) {
      const GlslResult result =
          compileGlsl(GlslStage::fragment, everything(head(version) + "#define GNOMON_MAX_PARTITIONS " + std::to_string(count) + "\n"));
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
  for (const std::string& version : kVersions) {
    const GlslResult result = compileGlsl(GlslStage::fragment, withIncludes(head(version) + "#define GNOMON_NO_UNIFORM\n",
                                                                            {"gnomon.glsl", "gnomon_cast.glsl"}, std::string(R"(
layout(std140) uniform Sun { GnomonBlock sun; };
layout(std140) uniform Moon { GnomonBlock moon; };
uniform highp sampler2DArray sunMaps, moonMaps;
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
  for (const std::string& version : kVersions) {
    const std::string rest = "in vec3 world; out vec4 colour;\nvoid main() { colour = vec4(gnomonShadow(gnomon, 0, 0, world, world)); }\n";
    const GlslResult result = compileGlsl(GlslStage::fragment, withIncludes(head(version), {"gnomon.glsl"}, rest));
    EXPECT_TRUE(result.isCompiled) << result.log;
    EXPECT_FALSE(result.isFine);
    EXPECT_NE(result.log.find("gnomonCompare"), std::string::npos) << result.log;
    // Selection alone needs no hook.
    const GlslResult selects =
        compileGlsl(GlslStage::fragment,
                    withIncludes(head(version), {"gnomon_pssm.glsl"},
                                 "out vec4 colour;\nvoid main() { colour = vec4(gnomonSelectWindow(gnomon, gl_FragCoord.z)); }\n"));
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

// Words that a target keeps for itself: GLSL to 4.60 and ES to 3.20 (key words, and those kept for the future); HLSL and MSL, C++14's among
// them, where a translator would have to rename.
const char* const kKept = R"(
active asm atomic_uint attribute bool break buffer bvec2 bvec3 bvec4 case cast centroid class coherent common const continue default discard
dmat2 dmat3 dmat4 do double dvec2 dvec3 dvec4 else enum extern external false filter fixed flat float for fvec2 fvec3 fvec4 goto half highp
hvec2 hvec3 hvec4 if image1D image2D image3D imageBuffer imageCube in inline inout input int interface invariant isampler2D ivec2 ivec3 ivec4
layout long lowp mat2 mat3 mat4 mediump namespace noinline noperspective out output partition patch precise precision public readonly resource
restrict return sample sampler sampler1D sampler2D sampler2DArray sampler2DArrayShadow sampler2DShadow sampler3D samplerCube shared short sizeof
smooth static struct subpassInput subroutine superp switch template texture this true typedef uint uniform union unsigned using uvec2 uvec3
uvec4 varying vec2 vec3 vec4 void volatile while writeonly
AppendStructuredBuffer BlendState Buffer ByteAddressBuffer CompileShader ComputeShader ConsumeStructuredBuffer DepthStencilState DomainShader
GeometryShader Hullshader InputPatch LineStream OutputPatch PixelShader PointStream RasterizerState RenderTargetView RWBuffer RWTexture2D
SamplerComparisonState SamplerState StructuredBuffer Texture1D Texture2D Texture2DArray TriangleStream VertexShader cbuffer column_major compile
dword export float2 float3 float4 float4x4 fxgroup groupshared int2 int3 int4 line lineadj linear matrix min16float min16int min16uint
nointerpolation packoffset pass pixelfragment point register row_major snorm stateblock stateblock_state string tbuffer technique technique10
technique11 triangle triangleadj uint2 uint3 uint4 unorm vector vertexfragment
access array constant depth2d device fragment kernel metal patch_control_point ptrdiff_t simd size_t thread threadgroup threadgroup_imageblock
vertex visible
alignas alignof and and_eq auto bitand bitor catch char compl const_cast constexpr decltype delete dynamic_cast explicit friend mutable new
noexcept not not_eq nullptr operator or or_eq private protected reinterpret_cast signed static_assert static_cast thread_local throw try typeid
typename virtual wchar_t xor xor_eq
)";

// Those that the texts use for what they mean.
const char* const kLanguage =
    "bool const continue else float for highp if in int ivec2 layout mat4 out precision return struct true false uint uniform uvec4 vec2 "
    "vec3 vec4 void";

std::set<std::string> wordsOf(const std::string& text) {
  std::istringstream stream(text);
  return {std::istream_iterator<std::string>(stream), {}};
}

const std::set<std::string> kReserved = [] {
  std::set<std::string> kept = wordsOf(kKept);
  for (const std::string& word : wordsOf(kLanguage)) EXPECT_EQ(kept.erase(word), 1u) << word;
  return kept;
}();

// What is wrong with a text's names; empty: nothing.
std::string badNames(const std::string& source) {
  const std::string text = withoutComments(source);
  const Names names = namesOf(text);
  std::string bad;
  const auto prefixed = [&](const std::vector<std::string>& list, const std::regex& pattern) {
    for (const std::string& name : list)
      if (!std::regex_match(name, pattern)) bad += name + " ";
  };
  prefixed(names.macros, std::regex("GNOMON_[A-Z0-9_]+|gnomon[A-Z][A-Za-z0-9]*"));
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
  for (const char* bad :
       {"#define MAX 1\n", "struct Partition { int x; };", "\nfloat lookup(int x) {", "int gnomonA__b;", "float partition;", "vec4 sample;",
        "vec3 point;", "float constant;", "int operator;", "#define compare(x) x\n", "\nvec2 gnomon(int x)", "float x = gl_FragCoord.z;"})
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

// What is tested as a whole is the whole: everything() calls each function and macro that a host may call.
TEST(Glsl, EverythingIsEverything) {
  const std::string all = read("translate.frag");
  for (const std::string& name : kIncludes) {
    const Names names = namesOf(withoutComments(read(name)));
    for (const auto* list : {&names.functions, &names.macros})
      for (const std::string& each : *list)
        if (each.rfind("gnomon", 0) == 0 && each.rfind("gnomonImpl", 0) != 0) {
          EXPECT_NE(all.find(each + "("), std::string::npos) << each;
        }
  }
}

// No copy of the block, nor of its arrays of partitions, is left in what a driver gets.
TEST(Glsl, NoArrayIsCopied) {
  for (const char* body :
       {"int index = gnomonSelect(gnomon, gl_FragCoord.z, world);\n  colour = vec4(gnomonShadowTent(gnomon, 0, index, world, world));",
        "colour = gnomonAtlas(gnomon, int(world.x), world);"}) {
    const std::string rest = std::string("in vec3 world; out vec4 colour;\nvoid main() {\n  ") + body + "\n}\n";
    const GlslResult result =
        compileGlsl(GlslStage::fragment, withIncludes(head("450"), {"gnomon.glsl"}, kHook + rest), GlslTarget::vulkan);
    ASSERT_TRUE(result.isFine) << result.log;
    EXPECT_FALSE(hasLocalArray(optimised(result.spirv)));
  }
  const GlslResult copies = compileGlsl(GlslStage::fragment, withIncludes(head("450"), {"gnomon_block.glsl"}, R"(
in vec3 world; out vec4 colour;
vec4 layerOf(GnomonBlock block, int index) { return block.partitions[index].layer; }
void main() { colour = layerOf(gnomon, int(world.x)); }
)"),
                                        GlslTarget::vulkan);
  ASSERT_TRUE(copies.isFine) << copies.log;
  EXPECT_TRUE(hasLocalArray(optimised(copies.spirv)));  // what passing the block by value leaves; the check can fail
}

// Where each member of the block lies, by its name in the block.
std::map<std::string, std::size_t> blockOffsets() {
  const std::size_t each = offsetof(GnomonBlock, partitions);
#define GNOMON_TEST_MEMBER(name) \
  { #name, offsetof(GnomonBlock, name) }
#define GNOMON_TEST_PARTITION(name) \
  { "partitions[0]." #name, each + offsetof(GnomonPartition, name) }
  return {GNOMON_TEST_MEMBER(info),
          GNOMON_TEST_MEMBER(atlas),
          GNOMON_TEST_MEMBER(origin),
          GNOMON_TEST_MEMBER(originRest),
          GNOMON_TEST_MEMBER(lightDirection),
          GNOMON_TEST_MEMBER(viewPlane),
          GNOMON_TEST_MEMBER(depthRule),
          GNOMON_TEST_MEMBER(bias),
          GNOMON_TEST_MEMBER(windowStart),
          GNOMON_TEST_MEMBER(viewStart),
          GNOMON_TEST_MEMBER(rowAlong),
          GNOMON_TEST_MEMBER(rowAcross),
          GNOMON_TEST_MEMBER(rowRule),
          GNOMON_TEST_MEMBER(rowCells),
          GNOMON_TEST_MEMBER(rowStart),
          GNOMON_TEST_MEMBER(rows),
          GNOMON_TEST_PARTITION(clipFromWorld),
          GNOMON_TEST_PARTITION(atlasFromWorld),
          GNOMON_TEST_PARTITION(viewport),
          GNOMON_TEST_PARTITION(uvBounds),
          GNOMON_TEST_PARTITION(interval),
          GNOMON_TEST_PARTITION(layer)};
#undef GNOMON_TEST_PARTITION
#undef GNOMON_TEST_MEMBER
}

void expectMarked(const std::string& text) {
  EXPECT_EQ(text.rfind("// gnomon ", 0), 0u);
  const std::string second = text.substr(text.find('\n') + 1, 200);
  EXPECT_EQ(second.rfind("// GENERATED", 0), 0u);
  EXPECT_NE(second.find("NOT RUN"), std::string::npos);
}

// Parity runs what SPIRV-Cross makes of a shader; here the file itself is compiled, and its block compared.
TEST(Translations, TheHlslFileCompilesAndHoldsTheBlock) {
  const std::string text = readBuilt("hlsl/gnomon.hlsl");
  expectMarked(text);
  std::map<std::string, int> offsets;
  ASSERT_NO_THROW(offsets = hlslOffsets(text));
  for (const auto& [name, expected] : blockOffsets()) {
    const std::string ending = "." + name;
    int found = -1;
    for (const auto& [full, offset] : offsets) {
      const std::string plain = std::regex_replace(full, std::regex("partitions\\."), "partitions[0].");
      for (const std::string& form : {plain, plain.substr(0, plain.rfind('['))})
        if (form.size() > ending.size() && form.compare(form.size() - ending.size(), ending.size(), ending) == 0 && found < 0)
          found = offset;
    }
    EXPECT_EQ(found, static_cast<int>(expected)) << name;
  }
}

// No compiler for it here: its structs are measured by MSL's own rules (vectors of four and matrices are 16-byte aligned, arrays packed).
TEST(Translations, TheMslFileHoldsTheBlock) {
  const std::string text = readBuilt("msl/gnomon.metal");
  expectMarked(text);
  std::map<std::string, std::size_t> sizes{{"float4", 16}, {"uint4", 16}, {"float4x4", 64}}, offsets;
  const std::regex structure("struct (Gnomon\\w+)\\s*\\{([^}]*)\\}"), member("(\\w+) (\\w+)(?:\\[(\\d+)\\])?;");
  for (std::sregex_iterator i(text.begin(), text.end(), structure), end; i != end; ++i) {
    std::size_t at = 0;
    const std::string name = (*i)[1], body = (*i)[2];
    for (std::sregex_iterator m(body.begin(), body.end(), member); m != end; ++m) {
      const std::string type = (*m)[1], prefix = name.rfind("GnomonPartition", 0) == 0 ? "partitions[0]." : "";
      ASSERT_EQ(sizes.count(type), 1u) << type;
      offsets[prefix + (*m)[2].str()] = at + (prefix.empty() ? 0 : offsetof(GnomonBlock, partitions));
      at += sizes[type] * ((*m)[3].matched ? std::stoul((*m)[3]) : 1);
    }
    sizes[name] = at;
  }
  offsets["bias"] = offsets["bias0"];  // SPIRV-Cross's name for it: Metal has a function bias
  for (const auto& [name, expected] : blockOffsets()) EXPECT_EQ(offsets[name], expected) << name;
  EXPECT_EQ(sizes["GnomonBlock"], sizeof(GnomonBlock));
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
