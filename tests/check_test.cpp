// Broken shaders, each diagnosed with its file, line and cause; fine ones pass in every dialect; the tool's answers and the CMake function.
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "check.h"
#include "gnomon/block.h"

namespace gnomon::test {
namespace {

namespace fs = std::filesystem;
using namespace check;
using Json = nlohmann::json;

const fs::path kBroken = fs::path(GNOMON_SOURCE_DIR) / "tests/broken";

std::string slurp(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

Report checkText(const std::string& text, const std::string& target = "", GlslStage stage = GlslStage::fragment,
                 const std::vector<std::string>& folders = {}) {
  Shader shader;
  shader.file = "shader";
  shader.text = text;
  shader.stage = stage;
  shader.folders = folders;
  shader.targets.emplace_back();
  if (!target.empty()) {
    EXPECT_TRUE(parseTarget(target, shader.targets[0])) << target;
  }
  return checkShader(shader, false);
}

int lineOf(const std::string& text, const std::string& part) {
  return 1 + static_cast<int>(std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(text.find(part)), '\n'));
}

std::string described(const Report& report) {
  std::string out;
  for (const Finding& finding : report.findings)
    out += finding.place.file + ":" + std::to_string(finding.place.line) + ": " + finding.cause + "; " + finding.fix + " (" +
           finding.compiler + ")\n";
  return out;
}

struct Broken {
  const char* file;
  const char* target;
  const char* at;  // where the fault is, relative to tests/broken: as an editor would be told
  const char* cause;  // part of it
  const char* fix;
};

// Lines are counted by eye.
const std::vector<Broken> kCases{
    {"missing_hook.frag", "", "missing_hook.frag:2", "gnomonCompare is yours to define",
     "float gnomonCompare(int map, vec2 uv, float layer, float depth) {"},
    {"wrong_hook.frag", "", "wrong_hook.frag:7",
     "another signature than the one that is called: float gnomonCompare(int map, vec3 uv, float depth)",
     "float gnomonCompare(int map, vec2 uv, float layer, float depth)"},
    {"wrong_hook_result.frag", "", "wrong_hook_result.frag:7", "another signature",
     "float gnomonCompare(int map, vec2 uv, float layer, float depth)"},
    {"missing_include.frag", "", "missing_include.frag:3", "\"lighting.glsl\" is not found", "-I"},
    {"misspelt_include.frag", "", "misspelt_include.frag:2", "\"gnomon_lokup.glsl\" is not found", "\"gnomon_lookup.glsl\""},
    {"syntax_in_include.frag", "", "common/curve.glsl:2", "expecting `,` or `;`", ""},
    {"old_layout.frag", "", "old_layout/gnomon_block.glsl:5", "layout version 0", "copy the library's"},
    {"reserved_word.frag", "", "reserved_word.frag:9", "'partition' is a reserved word", "rename"},
    {"clash.frag", "", "clash.frag:8", "gnomonFade is the library's own (gnomon_lookup.glsl:", "rename"},
    {"clash_macro.frag", "", "clash_macro.frag:2", "GNOMON_FLAG_VIEW_DEPTH: the name is the library's own", "GNOMON_MAX_PARTITIONS"},
    {"version_too_low.frag", "", "version_too_low.frag:8", "'textureGather' needs GLSL 400 core, this is 330 core", "raise #version"},
    {"includes_too_new.frag", "", "includes_too_new.frag:1", "the includes need GLSL 330 or ES 300, this is 130", "330 core"},
    {"binding_too_early.frag", "", "binding_too_early.frag:2", "GNOMON_BINDING needs GLSL 420 or ES 310", "raise #version"},
    {"no_version.frag", "", "no_version.frag:1", "no #version line", "#version 330 core"},
    {"misspelt_function.frag", "", "misspelt_function.frag:9", "'gnomonSelct' is not known", "write gnomonSelect"},
    {"misspelt_macro.frag", "", "misspelt_macro.frag:2", "GNOMON_MAX_PARTITION: there is no such option", "write GNOMON_MAX_PARTITIONS"},
    {"wrong_arguments.frag", "", "wrong_arguments.frag:8", "'gnomonShadow' does not take these arguments",
     "it is float gnomonShadow(GnomonBlock block, int map, int index, vec3 world, vec3 normal)"},
    {"other_include.vert", "", "other_include.vert:5", "'gnomonCastPosition' is in gnomon_cast.glsl", "#include \"gnomon_cast.glsl\""},
    {"too_many_partitions.frag", "", "too_many_partitions.frag:2", "GNOMON_MAX_PARTITIONS is 32", "[1, 16]"},
    {"not_std140.frag", "", "not_std140.frag:4", "block Sun is not std140", "layout(std140) uniform Sun"},
    {"es_without_precision.frag", "", "es_without_precision.frag:2", "no default precision for float", "precision highp float;"},
    {"es_without_sampler_precision.frag", "", "es_without_sampler_precision.frag:6", "no default precision for sampler2DArray",
     "precision highp sampler2DArray;"},
    {"vulkan_without_locations.frag", "vulkan", "vulkan_without_locations.frag:5", "needs a location", "layout(location = n)"},
    {"vulkan_without_binding.frag", "vulkan", "vulkan_without_binding.frag:2", "needs a binding for the block gnomonUniforms",
     "#define GNOMON_BINDING n"},
    {"wrong_stage.vert", "", "wrong_stage.vert:9", "'discard' belongs to a fragment shader", "--stage fragment"},
};

TEST(Check, BrokenShadersAreDiagnosed) {
  std::set<std::string> files;
  for (const Broken& broken : kCases) {
    SCOPED_TRACE(broken.file);
    files.insert(broken.file);
    Shader shader;
    shader.file = (kBroken / broken.file).string();
    shader.text = slurp(shader.file);
    ASSERT_TRUE(guessStage(broken.file, shader.stage));
    shader.targets.emplace_back();
    if (*broken.target != '\0') {
      ASSERT_TRUE(parseTarget(broken.target, shader.targets[0]));
    }
    const Report report = checkShader(shader, false);
    ASSERT_EQ(report.findings.size(), 1u) << described(report);  // the cause, and no echo of it
    const Finding& finding = report.findings[0];
    EXPECT_TRUE(finding.isError);
    EXPECT_FALSE(report.outcomes[0].isFine);
    EXPECT_EQ(finding.place.file + ":" + std::to_string(finding.place.line), (kBroken / broken.at).string()) << described(report);
    EXPECT_NE(finding.cause.find(broken.cause), std::string::npos) << described(report);
    EXPECT_NE(finding.fix.find(broken.fix), std::string::npos) << described(report);
  }
  for (const auto& entry : fs::directory_iterator(kBroken))
    if (entry.is_regular_file()) {
      EXPECT_EQ(files.count(entry.path().filename().string()), 1u) << entry.path() << " is in no case";
    }
}

// Each call of the includes that is a macro: known by the signature in its comment, as a function is.
TEST(Check, EveryMacroIsCheckedAsAFunction) {
  const std::regex define("#define (gnomon[A-Za-z0-9]+)\\(([^)]*)\\)"), comment("//   (\\w+) (gnomon[A-Za-z0-9]+)\\((.*)\\)");
  const auto matches = [](const std::string& text, const std::regex& pattern) {
    return std::vector<std::smatch>(std::sregex_iterator(text.begin(), text.end(), pattern), std::sregex_iterator());
  };
  std::set<std::string> checked;
  for (const auto& entry : fs::directory_iterator(GNOMON_GLSL_DIR)) {
    if (entry.path().extension() != ".glsl") continue;
    const std::string text = slurp(entry.path()), file = entry.path().filename().string();
    std::map<std::string, std::smatch> signatures;
    for (const std::smatch& match : matches(text, comment)) signatures[match[2]] = match;
    for (const std::smatch& match : matches(text, define)) {
      const std::string name = match[1];
      SCOPED_TRACE(name);
      ASSERT_EQ(signatures.count(name), 1u) << "no signature in a comment";
      const std::string result = signatures[name][1], parameters = signatures[name][3],
                        signature = result + " " + name + "(" + parameters + ")";
      const std::string names = std::regex_replace(parameters, std::regex("(\\w+ )+"), "");  // without types and `out`
      EXPECT_EQ(names, match[2]) << "the comment's parameters are not the macro's";
      checked.insert(name);

      const std::string body = result == "void" ? "{}" : "{ return " + result + "(0); }";
      const auto shader = [&](const std::string& include, const std::string& global, const std::string& call) {
        return "#version 330 core\n#include \"" + include + "\"\n" +
               "float gnomonCompare(int map, vec2 uv, float layer, float depth) { return 1.0; }\n" + global + "\nvoid main() {\n" + call +
               "}\n";
      };
      const auto one = [&](const std::string& source, const std::string& said) {
        const Report report = checkText(source);
        EXPECT_EQ(report.findings.size(), 1u) << described(report);
        EXPECT_NE(described(report).find(said), std::string::npos) << said << "\n" << described(report);
      };
      const std::string other = "gnomon_block.glsl";  // declares one call
      const std::string wrong = "shader:6: '" + name + "' does not take these arguments; it is " + signature + " (";
      const auto arguments = [&](const std::string& each) {  // as many as it takes
        std::string out = each;
        for (const char c : names) out += c == ',' ? ", " + each : "";
        return out;
      };
      one(shader(file, "", name + "();"), wrong);  // too few for the preprocessor
      one(shader(file, "", name + "(gnomon);"), wrong);
      one(shader(file, "", name + "(" + arguments("gnomon") + ", 1);"), wrong);  // too many
      one(shader(file, "", name + "(" + arguments("mat2(1.0)") + ");"), wrong);  // of other types
      if (file != other)
        one(shader(other, "", name + "(gnomon);"),
            "shader:6: '" + name + "' is in " + file + ", which is not included; write #include \"" + file);
      const std::string clash = "shader:4: " + name + " is the library's own (" + file + ":" + std::to_string(lineOf(text, match[0])) + ")";
      one(shader(file, signature + " " + body, ""), clash);
      one(shader(file, result + " " + name + "(vec4 much, float too, int many, bool unlike, vec2 the, vec2 librarys) " + body, ""), clash);
      one(shader(other, signature + " " + body, ""), clash);  // a later include would break it
      one(shader(file, "#define " + name + "(x) x", ""), "shader:4: #define " + name + ": the name is the library's own");
    }
  }
  for (const char* name :
       {"gnomonSelect", "gnomonSelectMask", "gnomonShadow", "gnomonBlendWeight", "gnomonCastPosition", "gnomonTexelEdges"})
    EXPECT_EQ(checked.count(name), 1u) << name;
}

TEST(Check, AnIncludesErrorShowsTheWayToIt) {
  Shader shader;
  shader.file = (kBroken / "syntax_in_include.frag").string();
  shader.text = slurp(shader.file);
  shader.targets.emplace_back();
  const Report report = checkShader(shader, false);
  ASSERT_EQ(report.findings.size(), 1u);
  const auto& chain = report.findings[0].includedFrom;
  ASSERT_EQ(chain.size(), 2u);
  EXPECT_EQ(chain[0].file, (kBroken / "common/tone.glsl").string());
  EXPECT_EQ(chain[0].line, 2);
  EXPECT_EQ(chain[1].file, shader.file);
  EXPECT_EQ(chain[1].line, 3);
}

// ---- The block ----

const char* const kReadsBlock =
    "#version 330 core\n#include \"gnomon_block.glsl\"\nout vec4 colour;\nvoid main() { colour = gnomon.atlas; }\n";

class CheckFiles : public testing::Test {
 protected:
  void SetUp() override {
    const testing::TestInfo* info = testing::UnitTest::GetInstance()->current_test_info();
    m_folder = fs::path(testing::TempDir()) / ("gnomon-check-" + std::string(info->name()) + "-" + std::to_string(getpid()));
    fs::create_directories(m_folder);
  }
  void TearDown() override { fs::remove_all(m_folder); }
  fs::path write(const std::string& name, const std::string& text) const {
    std::ofstream(m_folder / name, std::ios::binary) << text;
    return m_folder / name;
  }

  fs::path m_folder;
};

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  EXPECT_NE(text.find(from), std::string::npos) << from;
  return text.replace(text.find(from), from.size(), to);
}

// The user's copy of the block, one member changed: the member is named, at its line, with the bytes that C++ says.
TEST_F(CheckFiles, AnEditedBlockIsNamedByItsMember) {
  const std::string own = slurp(fs::path(GNOMON_GLSL_DIR) / "gnomon_block.glsl");
  const auto bytes = [](std::size_t offset) { return std::to_string(offset); };
  struct Edit {
    std::string from, to, marker, cause;
  };
  const std::size_t bias = offsetof(GnomonBlock, bias), more = sizeof(vec4);
  for (const Edit& edit : std::vector<Edit>{
           {"vec4 bias;", "vec4 tint; vec4 bias;", "vec4 tint;",
            "`bias` is read at byte " + bytes(bias + more) + ", the solver writes it at " + bytes(bias)},
           {"vec4 viewPlane;", "", "vec4 depthRule;",
            "`depthRule` is read at byte " + bytes(offsetof(GnomonBlock, viewPlane)) + ", the solver writes it at " +
                bytes(offsetof(GnomonBlock, depthRule))},
           {"vec4 lightDirection;", "vec4 sunDirection;", "vec4 sunDirection;",
            "`vec4 sunDirection` where the library has `vec4 lightDirection`"},
           {"uvec4 info;", "vec4 info;", "vec4 info;", "`vec4 info` where the library has `uvec4 info`"},
           {"vec4 viewStart[4];", "vec4 viewStart[2];", "vec4 viewStart[2];",
            "`rowAlong` is read at byte " + bytes(offsetof(GnomonBlock, rowAlong) - 2 * more)},
           {"vec4 uvBounds;", "mat4 uvBounds;", "mat4 uvBounds;",
            "`interval` is read at byte " + bytes(offsetof(GnomonBlock, partitions) + offsetof(GnomonPartition, interval) + 3 * more)},
           {"GnomonPartition partitions[GNOMON_MAX_PARTITIONS];", "GnomonPartition partitions[GNOMON_MAX_PARTITIONS]; vec4 fog;",
            "vec4 fog;", "`vec4 fog` after the library's last member"}}) {
    SCOPED_TRACE(edit.to);
    const std::string text = replaced(own, edit.from, edit.to);
    const fs::path file = write("gnomon_block.glsl", text);
    const Report report = checkText(kReadsBlock, "", GlslStage::fragment, {m_folder.string()});
    ASSERT_EQ(report.findings.size(), 1u) << described(report);
    const Finding& finding = report.findings[0];
    EXPECT_EQ(finding.place.file, file.string());
    EXPECT_EQ(finding.place.line, lineOf(text, edit.marker)) << described(report);
    EXPECT_NE(finding.cause.find(edit.cause), std::string::npos) << described(report);
    ASSERT_EQ(finding.includedFrom.size(), 1u);
    EXPECT_EQ(finding.includedFrom[0].line, 2);
  }
}

TEST_F(CheckFiles, AFaithfulCopyIsFine) {
  write("gnomon_block.glsl", slurp(fs::path(GNOMON_GLSL_DIR) / "gnomon_block.glsl"));
  for (const std::string count : {"1", "4", "16"}) {
    const std::string text = replaced(kReadsBlock, "#include", "#define GNOMON_MAX_PARTITIONS " + count + "\n#include");
    const Report report = checkText(text, "", GlslStage::fragment, {m_folder.string()});
    EXPECT_EQ(described(report), "") << count;
    EXPECT_EQ(report.layoutVersion, GNOMON_LAYOUT_VERSION);
  }
  for (const std::string count : {"0", "17", "-1"})
    EXPECT_NE(described(checkText(replaced(kReadsBlock, "#include", "#define GNOMON_MAX_PARTITIONS " + count + "\n#include")))
                  .find("shader:2: GNOMON_MAX_PARTITIONS is " + count + ", the block holds 1 to 16"),
              std::string::npos)
        << count;
}

// The version alone: the members are the same, the meaning may not be.
TEST_F(CheckFiles, AnotherLayoutVersionIsRefused) {
  const std::string own = slurp(fs::path(GNOMON_GLSL_DIR) / "gnomon_block.glsl");
  const std::string current = "#define GNOMON_LAYOUT_VERSION " + std::to_string(GNOMON_LAYOUT_VERSION);
  write("gnomon_block.glsl", replaced(own, current, "#define GNOMON_LAYOUT_VERSION 99"));
  const Report report = checkText(kReadsBlock, "", GlslStage::fragment, {m_folder.string()});
  ASSERT_EQ(report.findings.size(), 1u) << described(report);
  EXPECT_EQ(report.findings[0].place.line, lineOf(own, current));
  EXPECT_NE(report.findings[0].cause.find("layout version 99, the solver writes version " + std::to_string(GNOMON_LAYOUT_VERSION)),
            std::string::npos);
}

// ---- Fine shaders ----

std::string lookup(const std::string& head, bool hasLocations) {
  const auto at = [&](const std::string& layout) { return hasLocations ? "layout(" + layout + ") " : ""; };
  return head + "#include \"gnomon.glsl\"\n" + at("location = 0") + "in vec3 world;\n" + at("location = 1") + "in vec3 normal;\n" +
         at("location = 0") + "out vec4 colour;\n" + at("binding = 1") + R"(uniform highp sampler2DArray maps;
float gnomonCompare(int map, vec2 uv, float layer, float depth) { return depth <= texture(maps, vec3(uv, layer)).r ? 1.0 : 0.0; }
void main() {
  int index = gnomonSelect(gnomon, gl_FragCoord.z, world);
  colour = vec4(gnomonTint(index) * gnomonShadow3x3(gnomon, 0, index, world, normal), 1.0);
}
)";
}

TEST(Check, AFineShaderPassesInEveryDialect) {
  for (const char* version : {"330 core", "400 core", "410", "420 core", "430", "450 core", "460"}) {
    const Report report = checkText(lookup("#version 110\n", false), version);
    EXPECT_EQ(described(report), "") << version;
    EXPECT_TRUE(report.outcomes[0].isFine);
    EXPECT_FALSE(report.outcomes[0].isSpirvValid.has_value());
    EXPECT_EQ(report.layoutVersion, GNOMON_LAYOUT_VERSION);
    EXPECT_EQ(described(checkText(lookup(std::string("#version ") + version + "\n", false))), "") << version;
    EXPECT_EQ(described(checkText(lookup("", false), version)), "") << version;  // the renderer adds the line
  }
  for (const char* version : {"300 es", "310 es", "320 es"})
    EXPECT_EQ(described(checkText(lookup("#version 300 es\nprecision highp float;\n", false), version)), "") << version;
  for (const char* target : {"vulkan", "opengl", "460 vulkan", "310 es vulkan"}) {
    const Report report = checkText(lookup("#version 450\nprecision highp float;\n#define GNOMON_BINDING 0\n", true), target);
    EXPECT_EQ(described(report), "") << target;
    EXPECT_TRUE(report.outcomes[0].isSpirvValid == true) << target;
  }
}

TEST(Check, TargetsAreWords) {
  Target target;
  for (const char* fine : {"330", "330 core", "300 es", "450 compatibility", "vulkan", "opengl", "450 vulkan", "310 es opengl"})
    EXPECT_TRUE(parseTarget(fine, target)) << fine;
  EXPECT_EQ(target.version, "310 es");
  EXPECT_EQ(target.kind, GlslTarget::openGl);
  for (const char* wrong : {"", "33", "3300", "core", "330 gles", "vulkan 450", "330 core core", "vulkan vulkan", "metal"})
    EXPECT_FALSE(parseTarget(wrong, target)) << wrong;
}

TEST(Check, EveryStageIsChecked) {
  const std::string cast = "#include \"gnomon_cast.glsl\"\n";
  struct Staged {
    const char* name;
    std::string text;
  };
  for (const Staged& staged : std::vector<Staged>{
           {"vert", "#version 330 core\n" + cast + "in vec3 world;\nvoid main() { gl_Position = gnomonCastPosition(gnomon, 0, world); }\n"},
           {"geom", "#version 330 core\n" + cast +
                        "layout(triangles) in;\nlayout(triangle_strip, max_vertices = 3) out;\nin vec3 world[];\nvoid main() {\n"
                        "  for (int i = 0; i < 3; ++i) {\n    gl_Layer = gnomonCastLayer(gnomon, 1);\n"
                        "    gl_Position = gnomonCastPosition(gnomon, 1, world[i]);\n    EmitVertex();\n  }\n}\n"},
           {"tesc",
            "#version 410\nlayout(vertices = 3) out;\nvoid main() { gl_out[gl_InvocationID].gl_Position = "
            "gl_in[gl_InvocationID].gl_Position; }\n"},
           {"tese", "#version 410\n" + cast +
                        "layout(triangles) in;\nvoid main() { gl_Position = gnomonCastPosition(gnomon, 0, gl_TessCoord); }\n"},
           {"comp", "#version 450\n" + cast +
                        "layout(local_size_x = 8) in;\nlayout(std430, binding = 0) buffer Out { vec4 depths[]; };\n"
                        "void main() { depths[gl_GlobalInvocationID.x] = vec4(gnomonCastWindowDepth(gnomon, 0, vec3(0.0))); }\n"}}) {
    GlslStage stage{};
    ASSERT_TRUE(guessStage(std::string("a.") + staged.name, stage));
    ASSERT_TRUE(guessStage(std::string("a.") + staged.name + ".glsl", stage));
    EXPECT_EQ(described(checkText(staged.text, "", stage)), "") << staged.name;
    EXPECT_NE(described(checkText(staged.text, "", GlslStage::fragment)), "") << staged.name;
  }
  GlslStage stage{};
  for (const char* unknown : {"a.glsl", "frag", "a.txt", ""}) EXPECT_FALSE(guessStage(unknown, stage)) << unknown;
}

// Two lights with blocks of their own, and the includes pasted into the shader, are no clash.
TEST(Check, TheUsersOwnBlocksAndCopiesAreFine) {
  EXPECT_EQ(described(checkText(replaced(replaced(lookup("#version 330 core\n#define GNOMON_NO_UNIFORM\n", false), "in vec3 world;",
                                                  "layout(std140) uniform Sun { GnomonBlock sun; };\nlayout(std140) uniform Moon { "
                                                  "GnomonBlock gnomon; };\nin vec3 world;"),
                                         "colour =", "colour = sun.atlas +"))),
            "");
  std::string pasted = "#version 330 core\n";
  for (const char* name : {"gnomon_block.glsl", "gnomon_pssm.glsl", "gnomon_lookup.glsl"}) {
    std::istringstream lines(slurp(fs::path(GNOMON_GLSL_DIR) / name));
    for (std::string line; std::getline(lines, line);)
      if (line.rfind("#include", 0) != 0) pasted += line + "\n";
  }
  const std::string body = replaced(lookup("", false), "#include \"gnomon.glsl\"", "");
  EXPECT_EQ(described(checkText(pasted + body)), "");
  const std::string wrapped =
      replaced(pasted, "#define gnomonSelect(block, windowDepth, world) ", "#define gnomonSelect(block, windowDepth, world) \\\n  ");
  EXPECT_EQ(described(checkText(wrapped + body, "450")), "");
  for (const std::string& copy : {pasted, wrapped}) {
    const Report wrong = checkText(copy + replaced(body, "gl_FragCoord.z, world", "world"), "450");
    ASSERT_EQ(wrong.findings.size(), 1u) << described(wrong);
    EXPECT_EQ(wrong.findings[0].place.line, lineOf(copy + body, "gl_FragCoord.z, world);\n  colour")) << described(wrong);
    EXPECT_EQ(wrong.findings[0].kind, "arguments") << described(wrong);
  }
}

// What compiles and yet deserves a word: a warning, no error.
TEST(Check, WarningsAreNoErrors) {
  struct Warned {
    std::string from, to, cause;
    int line;
  };
  for (const Warned& warned : std::vector<Warned>{
           {"void main", "float gnomonMine(float x) { return x; }\nvoid main", "shader:8: gnomonMine: names that begin with gnomon", 8},
           {"void main", "#define GNOMON_MINE 1\nvoid main", "shader:8: #define GNOMON_MINE: names that begin with gnomon", 8},
           {"int index", "int half = 1; int index", "", 9},
           {"vec3 world;", "vec3 world;\nin vec3 sample;", "shader:4: 'sample' is a reserved word of other GLSL versions", 4}}) {
    const Report report = checkText(replaced(lookup("#version 330 core\n", false), warned.from, warned.to));
    ASSERT_EQ(report.findings.size(), 1u) << warned.to << described(report);
    EXPECT_EQ(report.findings[0].isError, warned.cause.empty()) << warned.to;  // `half` is reserved in 330 too
    EXPECT_EQ(report.findings[0].place.line, warned.line) << described(report);
    EXPECT_NE(described(report).find(warned.cause), std::string::npos) << described(report);
  }
}

// What the library's own knowledge does not decide: found by trying, or told in the compiler's words.
TEST(Check, OtherFaults) {
  const std::string head = "#version 330 core\n#include \"gnomon.glsl\"\nout vec4 colour;\n";
  struct Fault {
    std::string text, said;
  };
  for (const Fault& fault : std::vector<Fault>{
           {head + "void main() { colour = gnomon.bas; }\n", "shader:4: 'bas' is not known; write bias"},
           {head + "void main() { colour = texture2D(1.0); }\n", "shader:4: 'texture2D' is not known"},
           {head + "void main() { float x[] = {1.0}; colour = vec4(x[0]); }\n", "needs GLSL 420 core, this is 330 core"},
           {head + "void main() { gl_Position = vec4(1.0); }\n", "shader:4: 'gl_Position' belongs to a vertex shader"},
           {head + "float lit(vec3 p);\nvoid main() { colour = vec4(lit(vec3(1.0))); }\n",
            "shader:4: lit is declared and called, and has no body"},
           {head + "#if GNOMON_MAX_PARTITON > 4\n#endif\nvoid main() {}\n",
            "shader:4: GNOMON_MAX_PARTITON is asked for and nothing defines it"},
           {"#version 330 core\nint gnomon;\n#include \"gnomon.glsl\"\nvoid main() {}\n", "shader:2: gnomon is the library's own"},
           {head + "void main() {\n  int index = gnomonSelect(gnomon, 0.5, 1.0);\n}\n",
            "shader:5: 'gnomonSelect' does not take these arguments; it is int gnomonSelect(GnomonBlock block, float windowDepth, vec3 "
            "world)"},
           {head + "uniform bool isDay;\nvoid main() { colour = vec4(gnomonFade(isDay ? gnomon : gnomon, 1.0)); }\n",
            "shader:5: 'gnomonFade' is a macro: its block is the name of a uniform"},
           {"\xef\xbb\xbf#version 330 core\nvoid main() {}\n", "shader:1: the file begins with a byte-order mark"},
           {head, "there is no main()"},
           {head + "#error stop here\n", "shader:4: '#error' : stop here"},
           {head + "void main() { colour = vec4(1.0) }\n", "shader:4: syntax error, unexpected `}`, expecting `,` or `;`"}}) {
    const Report report = checkText(fault.text);
    EXPECT_EQ(report.findings.size(), 1u) << described(report);
    EXPECT_NE(described(report).find(fault.said), std::string::npos) << fault.said << "\n" << described(report);
  }
}

// ---- The compiler's library ----

TEST(Check, InstructionsAreCounted) {
  const auto count = [](const std::string& body) {
    const GlslResult result =
        compileGlsl(GlslStage::fragment, "#version 450\nlayout(location = 0) out vec4 colour;\nvoid main() { " + body + " }\n",
                    GlslTarget::vulkan, false);
    EXPECT_TRUE(result.isFine) << result.log;
    return countInstructions(result.spirv);
  };
  EXPECT_EQ(count(""), 1);  // OpReturn
  EXPECT_EQ(count("colour = vec4(1.0);"), 2);  // OpStore of a constant
  EXPECT_EQ(count("colour = gl_FragCoord;"), 3);  // OpLoad, OpStore
}

TEST(Check, ARecursiveIncludeEnds) {
  const fs::path folder = fs::path(testing::TempDir()) / ("gnomon-recursive-" + std::to_string(getpid()));
  fs::create_directories(folder);
  std::ofstream(folder / "self.glsl") << "#include \"self.glsl\"\n";
  const Report report =
      checkText("#version 330 core\n#include \"self.glsl\"\nvoid main() {}\n", "", GlslStage::fragment, {folder.string()});
  fs::remove_all(folder);
  EXPECT_NE(described(report).find("self.glsl:1: \"self.glsl\" includes itself"), std::string::npos) << described(report);
}

// ---- The tool ----

struct Output {
  int code = -1;
  std::string out, err;
};

std::string quoted(const std::string& word) { return "'" + word + "'"; }

class CheckTool : public CheckFiles {
 protected:
  Output run(const std::string& words) const {
    const std::string command =
        quoted(GNOMON_TOOL) + " check " + words + " >" + quoted(m_folder / "out") + " 2>" + quoted(m_folder / "err");
    const int status = std::system(command.c_str());
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, slurp(m_folder / "out"), slurp(m_folder / "err")};
  }
  // Bad usage: exit 2, one line on standard error, nothing on standard output.
  void refused(const std::string& words, const std::string& line) const {
    const Output output = run(words);
    EXPECT_EQ(output.code, 2) << words;
    EXPECT_EQ(output.out, "") << words;
    EXPECT_EQ(output.err.rfind("gnomon: check: " + line, 0), 0u) << words << "\n" << output.err;
    EXPECT_EQ(std::count(output.err.begin(), output.err.end(), '\n'), 1) << output.err;
  }
};

TEST_F(CheckTool, ExitCodesAndText) {
  const fs::path fine = write("fine.frag", lookup("#version 330 core\n", false));
  const Output good = run(quoted(fine));
  EXPECT_EQ(good.code, 0);
  EXPECT_EQ(good.out, fine.string() + ": fragment, 330 core: fine\n");
  EXPECT_EQ(good.err, "");
  const fs::path broken = kBroken / "misspelt_function.frag";
  const Output bad = run(quoted(broken) + " " + quoted(fine));
  EXPECT_EQ(bad.code, 1);
  EXPECT_EQ(bad.out.rfind(broken.string() + ":9: error: 'gnomonSelct' is not known; write gnomonSelect\n", 0), 0u) << bad.out;
  EXPECT_NE(bad.out.find(fine.string() + ": fragment, 330 core: fine\n"), std::string::npos) << bad.out;
  // A finding of some targets only says of which: ES alone wants a sampler's precision.
  const fs::path desktop = write("desktop.frag", replaced(slurp(fine), "highp sampler2DArray", "sampler2DArray"));
  const Output some = run(quoted(desktop) + " --target '330 core' --target '300 es'");
  EXPECT_EQ(some.code, 1);
  EXPECT_NE(some.out.find("GLSL ES has no default precision for sampler2DArray"), std::string::npos) << some.out;
  EXPECT_NE(some.out.find("[300 es]"), std::string::npos) << some.out;
}

TEST_F(CheckTool, BadUsageIsOneLine) {
  const fs::path fine = write("fine.frag", lookup("#version 330 core\n", false)), other = write("fine.glsl", "");
  refused("", "nothing to check");
  refused(quoted(m_folder / "none.frag"), (m_folder / "none.frag").string() + ": cannot be read");
  refused(quoted(m_folder), m_folder.string() + ": cannot be read");
  refused(quoted(other), other.string() + ": its name does not say which stage it is");
  refused(quoted(fine) + " --stage pixel", "stage: must be vertex,");
  refused(quoted(fine) + " --target 33", "--target: must be a GLSL version");
  refused(quoted(fine) + " -D 3=4", "-D: must be NAME or NAME=VALUE");
  refused(quoted(fine) + " -I /nowhere/at/all", "-I: must be a folder");
}

TEST_F(CheckTool, AListSaysWhatIsChecked) {
  fs::create_directories(m_folder / "common");
  write("common/hook.glsl",
        "uniform highp sampler2DArray maps;\nfloat gnomonCompare(int map, vec2 uv, float layer, float depth) { return float(SUN); }\n");
  write("a.frag",
        "#version 330 core\nprecision highp float;\n#include \"gnomon.glsl\"\n#include \"hook.glsl\"\nout vec4 colour;\n"
        "void main() { colour = vec4(gnomonShadow(gnomon, 0, 0, vec3(0.0), vec3(1.0))); }\n");
  write("b.glsl", slurp(m_folder / "a.frag"));
  const fs::path list = write("list.json", R"({ "include": ["common"], "define": { "SUN": 1, "GNOMON_MAX_PARTITIONS": "4" },
    "target": ["330 core", "300 es"],
    "shaders": ["a.frag", { "file": "b.glsl", "stage": "fragment", "define": { "SUN": "moon" }, "target": ["450"] }] })");
  const Output output = run("--json --statistics --list " + quoted(list));
  EXPECT_EQ(output.code, 1) << output.err;
  const Json answer = Json::parse(output.out, nullptr, false);
  ASSERT_FALSE(answer.is_discarded()) << output.out;
  EXPECT_EQ(answer["errors"], 1);
  EXPECT_EQ(answer["warnings"], 0);
  EXPECT_EQ(answer["library_layout_version"], GNOMON_LAYOUT_VERSION);
  ASSERT_EQ(answer["shaders"].size(), 2u);
  const Json &a = answer["shaders"][0], &b = answer["shaders"][1];
  EXPECT_EQ(a["file"], (m_folder / "a.frag").string());
  EXPECT_EQ(a["findings"], Json::array());
  EXPECT_EQ(a["layout_version"], GNOMON_LAYOUT_VERSION);
  ASSERT_EQ(a["targets"].size(), 2u);
  EXPECT_EQ(a["targets"][0]["target"], "330 core");
  EXPECT_EQ(a["targets"][0]["fine"], true);
  EXPECT_TRUE(a["targets"][0]["spirv_valid"].is_null());
  EXPECT_GT(a["targets"][0]["instructions"], a["targets"][0]["optimised"]);
  EXPECT_GT(a["targets"][0]["optimised"], 0);
  EXPECT_FALSE(a["targets"][1].contains("optimised"));  // ES 300 has no SPIR-V
  ASSERT_EQ(b["findings"].size(), 1u) << output.out;
  EXPECT_EQ(b["findings"][0]["severity"], "error");
  EXPECT_EQ(b["findings"][0]["file"], (m_folder / "common/hook.glsl").string());
  EXPECT_EQ(b["findings"][0]["line"], 2);
  EXPECT_EQ(b["findings"][0]["included_from"][0]["line"], 4);
  EXPECT_EQ(b["findings"][0]["targets"], Json::array({"450"}));
  EXPECT_NE(b["findings"][0]["cause"].get<std::string>().find("'moon' is not known"), std::string::npos);

  const auto refusedList = [&](const std::string& text, const std::string& line) {
    refused("--list " + quoted(write("bad.json", text)), line);
  };
  refusedList(R"({ "shader": ["a.frag"] })", "shader: is not a known key; a list takes shaders, include, define, target");
  refusedList(R"({ "shaders": [{ "file": "a.frag", "path": "x" }] })", "shaders[0].path: is not a known key");
  refusedList(R"({ "shaders": [{ "stage": "fragment" }] })", "shaders[0].file: must be a text, got nothing");
  refusedList(R"({ "shaders": [] })", "shaders: must be a list");
  refusedList(R"({ "shaders": ["a.frag"], "target": ["9"] })", "target: must be a GLSL version");
  refusedList(R"({ "shaders": ["a.frag"], "include": ["none"] })", "include: must be a folder");
  refusedList(R"({ "shaders": ["a.frag"], "define": ["X"] })", "define: must be an object");
  refusedList("not json", "");
}

TEST_F(CheckTool, OptionsReachTheShader) {
  write("hook.glsl", "float gnomonCompare(int map, vec2 uv, float layer, float depth) { return float(SUN); }\n");
  fs::create_directories(m_folder / "elsewhere");
  const fs::path shader = write("elsewhere/a.glsl",
                                "#include \"gnomon.glsl\"\n#include <hook.glsl>\nout vec4 colour;\n"
                                "void main() { colour = vec4(gnomonShadow(gnomon, 0, 0, vec3(0.0), vec3(SUN))); }\n");
  const std::string rest = quoted(shader) + " --stage frag --target '330 core' ";
  EXPECT_EQ(run(rest + "-I " + quoted(m_folder) + " -DSUN").code, 0);
  EXPECT_EQ(run(rest + "-I " + quoted(m_folder) + " -D SUN=0.5").code, 0);
  EXPECT_NE(run(rest + "-DSUN").out.find("a.glsl:2: error: \"hook.glsl\" is not found"), std::string::npos);
  EXPECT_NE(run(rest + "-I " + quoted(m_folder)).out.find("hook.glsl:1: error: 'SUN' is not known"), std::string::npos);
  EXPECT_NE(run(rest + "-DSUN -D GNOMON_MAX_PARTITIONS=17 -I " + quoted(m_folder)).out.find("GNOMON_MAX_PARTITIONS is 17"),
            std::string::npos);
}

// A project of a user's that calls gnomon_check_shaders(): its shaders are checked in its build and by its tests.
TEST_F(CheckTool, TheCMakeFunctionChecksAProject) {
  const fs::path project = m_folder / "project", build = m_folder / "build";
  fs::copy(fs::path(GNOMON_SOURCE_DIR) / "tests/check", project, fs::copy_options::recursive);
  const auto shell = [&](const std::string& command) {
    const int status = std::system((command + " >" + quoted(m_folder / "out") + " 2>&1").c_str());
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  };
  const std::string configure = "cmake -S " + quoted(project) + " -B " + quoted(build) +
                                " -DCMAKE_MODULE_PATH=" + quoted(std::string(GNOMON_SOURCE_DIR) + "/solver/package") +
                                " -DGNOMON_TOOL=" + quoted(GNOMON_TOOL);
  const std::string test = "ctest --output-on-failure --test-dir " + quoted(build), make = "cmake --build " + quoted(build);
  ASSERT_EQ(shell(configure), 0) << slurp(m_folder / "out");
  EXPECT_EQ(shell(make), 0) << slurp(m_folder / "out");
  EXPECT_EQ(shell(test), 0) << slurp(m_folder / "out");
  const fs::path shader = project / "forward.frag";
  const std::string text = replaced(slurp(shader), "gnomonSelect", "gnomonSelct");
  std::ofstream(shader) << text;
  const std::string said =
      "forward.frag:" + std::to_string(lineOf(text, "gnomonSelct")) + ": error: 'gnomonSelct' is not known; write gnomonSelect";
  EXPECT_NE(shell(make), 0);
  EXPECT_NE(slurp(m_folder / "out").find(said), std::string::npos) << slurp(m_folder / "out");
  EXPECT_NE(shell(test), 0);
  EXPECT_NE(slurp(m_folder / "out").find(said), std::string::npos) << slurp(m_folder / "out");
}

}  // namespace
}  // namespace gnomon::test
