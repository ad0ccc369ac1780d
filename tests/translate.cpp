#include "translate.h"

#include <stdexcept>

#include <glslang/Public/ResourceLimits.h>
#include <glslang/Public/ShaderLang.h>
#include <glslang/SPIRV/GlslangToSpv.h>
#include <spirv-tools/optimizer.hpp>
#include <spirv_cross/spirv_hlsl.hpp>

#include "glsl_compile.h"

namespace gnomon::test {
namespace {

using namespace check;
using Spirv = std::vector<std::uint32_t>;

Spirv asVulkan(const std::string& fragment) {
  GlslResult result =
      compileGlsl(GlslStage::fragment, "#version 450\n#extension GL_GOOGLE_include_directive : enable\n" + fragment, GlslTarget::vulkan);
  if (!result.isFine) throw std::runtime_error("Vulkan GLSL: " + result.log);
  return std::move(result.spirv);
}

Spirv asHlsl(const std::string& source, std::map<std::string, int>* offsets = nullptr) {
  static const bool isReady = glslang::InitializeProcess();
  if (!isReady) throw std::runtime_error("glslang: cannot start");
  constexpr int kDialect = 100, kShaderModel = 500;
  const auto rules = static_cast<EShMessages>(EShMsgSpvRules | EShMsgVulkanRules | EShMsgReadHlsl);
  const char* text = source.c_str();
  glslang::TShader shader(EShLangFragment);
  shader.setStrings(&text, 1);
  shader.setEntryPoint("main");
  shader.setEnvInput(glslang::EShSourceHlsl, EShLangFragment, glslang::EShClientVulkan, kDialect);
  shader.setEnvClient(glslang::EShClientVulkan, glslang::EShTargetVulkan_1_1);
  shader.setEnvTarget(glslang::EShTargetSpv, glslang::EShTargetSpv_1_3);
  shader.setAutoMapBindings(true);
  shader.setAutoMapLocations(true);
  glslang::TProgram program;
  if (!shader.parse(GetDefaultResources(), kShaderModel, false, rules))
    throw std::runtime_error("HLSL: " + std::string(shader.getInfoLog()));
  program.addShader(&shader);
  if (!program.link(rules) || !program.mapIO()) throw std::runtime_error("HLSL: " + std::string(program.getInfoLog()));
  if (offsets) {
    program.buildReflection(EShReflectionAllBlockVariables);
    for (int i = 0; i < program.getNumUniformVariables(); ++i)
      if (const auto& uniform = program.getUniform(i); uniform.offset >= 0) (*offsets)[uniform.name] = uniform.offset;
  }
  Spirv spirv;
  glslang::GlslangToSpv(*program.getIntermediate(EShLangFragment), spirv);
  return spirv;
}

std::string writtenAsGlsl(const Spirv& spirv) {
  spirv_cross::CompilerGLSL compiler(spirv);
  spirv_cross::CompilerGLSL::Options options;
  options.version = 330;
  options.enable_420pack_extension = false;
  compiler.set_common_options(options);
  compiler.build_dummy_sampler_for_combined_images();
  compiler.build_combined_image_samplers();
  const std::string text = compiler.compile();
  return text.substr(text.find('\n') + 1);
}

}  // namespace

std::string throughVulkan(const std::string& fragment) {
  spvtools::Optimizer optimizer(SPV_ENV_VULKAN_1_1);
  optimizer.RegisterPerformancePasses();
  const Spirv spirv = asVulkan(fragment);
  Spirv optimised;
  if (!optimizer.Run(spirv.data(), spirv.size(), &optimised)) throw std::runtime_error("spirv-opt: refused");
  return writtenAsGlsl(optimised);
}

std::string throughHlsl(const std::string& fragment) {
  spirv_cross::CompilerHLSL compiler(asVulkan(fragment));
  spirv_cross::CompilerHLSL::Options options;
  options.shader_model = 50;
  compiler.set_hlsl_options(options);
  return writtenAsGlsl(asHlsl(compiler.compile()));
}

std::map<std::string, int> hlslOffsets(const std::string& text) {
  std::map<std::string, int> offsets;
  (void)asHlsl(text, &offsets);
  return offsets;
}

}  // namespace gnomon::test
