// glsl_compile: shaders that include the product's files, through glslang and SPIRV-Tools: compile, link, reflect, validate, optimise.
//
// Shader part: none.
// Test: tests/glsl_test.cpp, tests/block_test.cpp, tests/check_test.cpp
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace gnomon::check {

enum class GlslTarget { validate, openGl, vulkan };  // openGl and vulkan also make SPIR-V
enum class GlslStage { vertex, tessellationControl, tessellationEvaluation, geometry, fragment, compute };

// One shader. #include needs no #extension: a quoted name is looked for beside the file that asks, then in the folders, then among the
// library's own files.
struct GlslSource {
  GlslSource() = default;
  GlslSource(std::string shader) : text(std::move(shader)) {}  // NOLINT(google-explicit-constructor): a text is a source

  std::string text;
  std::string name;  // its path; messages carry it, and quoted includes are relative to it
  std::vector<std::string> folders;  // include paths
  std::string preamble;  // compiled before the text and after #version, in no file
  std::string version;  // "330 core", "300 es": replaces the text's #version line, or stands for a missing one; empty: as written
  bool hasFunctions = false;  // every text read by way of withFunctions(): for messages, not for code
};

struct GlslPlace {
  std::string file;
  int line = 0;  // 0: not known
};

struct GlslMessage {
  bool isError = true;
  GlslPlace place;
  std::string text;
};

struct GlslResult {
  bool isFine = false;  // compiled and linked
  bool isCompiled = false;
  std::string log;
  std::vector<GlslMessage> messages;  // the log, taken apart
  std::map<std::string, std::string> texts;  // of every file that was read, by path
  std::map<std::string, GlslPlace> includedFrom;  // where each included file was first asked for
  std::vector<std::uint32_t> spirv;
  std::map<std::string, int> offsets;  // of every member of every uniform block, by full name
  std::map<std::string, int> bindings;  // of every uniform block; -1: none
  int uniformBlocks = 0, otherUniforms = 0;
};

// isMapped: for SPIR-V, give bindings and locations to what has none; else the source must name them all.
[[nodiscard]] GlslResult compileGlsl(GlslStage stage, const GlslSource& source, GlslTarget target = GlslTarget::validate,
                                     bool isMapped = true);

// What a text's #version line says, "330 core"; empty: it has none.
[[nodiscard]] std::string versionOf(const std::string& text);

// The text that the compiler sees, from its first line on: includes and macros expanded, #line directives with file names kept. Empty where
// that fails, or where no version is known.
[[nodiscard]] std::string preprocessGlsl(GlslStage stage, const GlslSource& source, GlslTarget target = GlslTarget::validate);

// spirv-val, before and after the passes of spirv-opt -O. Empty: accepted both times; else what was said.
[[nodiscard]] std::string validateSpirv(const std::vector<std::uint32_t>& spirv, GlslTarget target);

// The passes of spirv-opt -O. Empty where they fail; said: why.
[[nodiscard]] std::vector<std::uint32_t> optimiseSpirv(const std::vector<std::uint32_t>& spirv, GlslTarget target, std::string& said);

// Instructions inside functions: what a shader executes, without declarations, labels and function frames.
[[nodiscard]] int countInstructions(const std::vector<std::uint32_t>& spirv);

}  // namespace gnomon::check
