// check: what is wrong with a shader that uses the library's includes, said of the user's own file and line, with what to do.
//
// Shader part: none.
// Test: tests/check_test.cpp
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "glsl_compile.h"

namespace gnomon::check {

// A dialect to be judged by. "" (as the file's #version says), "330 core", "300 es", "vulkan", "opengl" (both: SPIR-V), "450 vulkan".
struct Target {
  std::string version;  // empty: as written
  GlslTarget kind = GlslTarget::validate;
};
// False: not a target.
[[nodiscard]] bool parseTarget(const std::string& text, Target& out);

// By name ("fragment", "frag"), or from a file's name ("a.frag", "a.frag.glsl", "a.fs"). False: not known.
[[nodiscard]] bool parseStage(const std::string& name, GlslStage& out);
[[nodiscard]] bool guessStage(const std::string& file, GlslStage& out);
[[nodiscard]] const char* stageName(GlslStage stage);

struct Shader {
  std::string file, text;
  GlslStage stage = GlslStage::fragment;
  std::vector<std::string> folders;  // include paths
  std::vector<std::pair<std::string, std::string>> defines;  // name and value
  std::vector<Target> targets;
};

struct Finding {
  bool isError = true;  // else a warning: compiles, but look at it
  std::string kind;  // one word: missing-hook
  GlslPlace place;  // in the user's file; line 0: the file as a whole
  std::string cause, fix;
  std::string compiler;  // what the compiler said, where it is not the cause itself
  std::vector<GlslPlace> includedFrom;  // from the place's file out to the shader
  std::vector<std::string> targets;  // that it was found for
};

struct Outcome {
  std::string target;
  bool isFine = false;
  std::optional<bool> isSpirvValid;  // what spirv-val says; nothing where no module was made
  int instructions = 0, optimised = 0;  // before and after spirv-opt -O; 0: not counted
};

struct Report {
  std::string file;
  GlslStage stage = GlslStage::fragment;
  int layoutVersion = 0;  // of the block in the shader; 0: it holds none
  std::vector<Outcome> outcomes;  // one for each target
  std::vector<Finding> findings;
};

// hasStatistics: count instructions too, as OpenGL SPIR-V where the target is not SPIR-V itself.
[[nodiscard]] Report checkShader(const Shader& shader, bool hasStatistics);

}  // namespace gnomon::check
