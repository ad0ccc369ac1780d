// glsl_compile: shaders that include the product's files, through glslang and SPIRV-Tools.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace gnomon::test {

enum class GlslTarget { validate, openGl, vulkan };  // openGl and vulkan also make SPIR-V
enum class GlslStage { vertex, fragment };

struct GlslResult {
  bool isFine = false;  // compiled and linked
  bool isCompiled = false;
  std::string log;
  std::vector<std::uint32_t> spirv;
  std::map<std::string, int> offsets;  // of every member of every uniform block, by full name
  std::map<std::string, int> bindings;  // of every uniform block; -1: none
  int uniformBlocks = 0, otherUniforms = 0;
};

// isMapped: for SPIR-V, give bindings and locations to what has none; else the source must name them all.
[[nodiscard]] GlslResult compileGlsl(GlslStage stage, const std::string& source, GlslTarget target = GlslTarget::validate,
                                     bool isMapped = true);

// spirv-val, before and after the passes of spirv-opt -O. Empty: accepted both times; else what was said.
[[nodiscard]] std::string validateSpirv(const std::vector<std::uint32_t>& spirv, GlslTarget target);

}  // namespace gnomon::test
