#include "glsl_compile.h"

#include <filesystem>
#include <fstream>
#include <sstream>

#include <glslang/Public/ResourceLimits.h>
#include <glslang/Public/ShaderLang.h>
#include <glslang/SPIRV/GlslangToSpv.h>
#include <spirv-tools/libspirv.hpp>
#include <spirv-tools/optimizer.hpp>

namespace gnomon::test {
namespace {

struct Process {
  Process() { glslang::InitializeProcess(); }
  ~Process() { glslang::FinalizeProcess(); }
};

class Includer final : public glslang::TShader::Includer {
 public:
  IncludeResult* includeLocal(const char* name, const char*, std::size_t) override {
    std::ifstream file(std::filesystem::path(GNOMON_GLSL_DIR) / name);
    if (!file) return nullptr;
    std::ostringstream text;
    text << file.rdbuf();
    auto* const kept = new std::string(text.str());
    return new IncludeResult(name, kept->data(), kept->size(), kept);
  }
  IncludeResult* includeSystem(const char* name, const char* from, std::size_t depth) override { return includeLocal(name, from, depth); }
  void releaseInclude(IncludeResult* result) override {
    if (!result) return;
    delete static_cast<std::string*>(result->userData);
    delete result;
  }
};

}  // namespace

GlslResult compileGlsl(GlslStage stage, const std::string& source, GlslTarget target, bool isMapped) {
  static const Process process;
  constexpr int kOpenGlInput = 100, kDefaultVersion = 110;
  const EShLanguage language = stage == GlslStage::vertex ? EShLangVertex : EShLangFragment;
  const char* text = source.c_str();
  glslang::TShader shader(language);
  shader.setStrings(&text, 1);
  EShMessages messages = EShMsgDefault;
  if (target == GlslTarget::openGl) {
    messages = EShMsgSpvRules;
    shader.setEnvInput(glslang::EShSourceGlsl, language, glslang::EShClientOpenGL, kOpenGlInput);
    shader.setEnvClient(glslang::EShClientOpenGL, glslang::EShTargetOpenGL_450);
    shader.setEnvTarget(glslang::EShTargetSpv, glslang::EShTargetSpv_1_0);
  } else if (target == GlslTarget::vulkan) {
    messages = static_cast<EShMessages>(EShMsgSpvRules | EShMsgVulkanRules);
    shader.setEnvInput(glslang::EShSourceGlsl, language, glslang::EShClientVulkan, kOpenGlInput);
    shader.setEnvClient(glslang::EShClientVulkan, glslang::EShTargetVulkan_1_1);
    shader.setEnvTarget(glslang::EShTargetSpv, glslang::EShTargetSpv_1_3);
  }
  isMapped = isMapped && target != GlslTarget::validate;
  if (isMapped) {
    shader.setAutoMapBindings(true);
    shader.setAutoMapLocations(true);
  }
  Includer includer;
  GlslResult result;
  result.isCompiled = shader.parse(GetDefaultResources(), kDefaultVersion, false, messages, includer);
  glslang::TProgram program;
  program.addShader(&shader);
  result.isFine = result.isCompiled && program.link(messages) && (!isMapped || program.mapIO());
  result.log = std::string(shader.getInfoLog()) + program.getInfoLog();
  if (!result.isFine) return result;
  program.buildReflection(EShReflectionAllBlockVariables);
  result.uniformBlocks = program.getNumUniformBlocks();
  for (int i = 0; i < result.uniformBlocks; ++i) result.bindings[program.getUniformBlock(i).name] = program.getUniformBlock(i).getBinding();
  for (int i = 0; i < program.getNumUniformVariables(); ++i) {
    const auto& uniform = program.getUniform(i);
    if (uniform.offset >= 0 && uniform.index >= 0)
      result.offsets[uniform.name] = uniform.offset;
    else
      ++result.otherUniforms;
  }
  if (target != GlslTarget::validate) {
    glslang::SpvOptions options;
    options.disableOptimizer = true;
    glslang::GlslangToSpv(*program.getIntermediate(language), result.spirv, &options);
  }
  return result;
}

std::string validateSpirv(const std::vector<std::uint32_t>& spirv, GlslTarget target) {
  const spv_target_env environment = target == GlslTarget::vulkan ? SPV_ENV_VULKAN_1_1 : SPV_ENV_OPENGL_4_5;
  std::string said;
  const auto listen = [&](spv_message_level_t, const char*, const spv_position_t&, const char* message) {
    said += std::string(message) + "\n";
  };
  spvtools::SpirvTools tools(environment);
  tools.SetMessageConsumer(listen);
  if (!tools.Validate(spirv)) return "before: " + said;
  spvtools::Optimizer optimizer(environment);
  optimizer.SetMessageConsumer(listen);
  optimizer.RegisterPerformancePasses();
  std::vector<std::uint32_t> optimised;
  if (!optimizer.Run(spirv.data(), spirv.size(), &optimised)) return "spirv-opt: " + said;
  return tools.Validate(optimised) ? "" : "after: " + said;
}

}  // namespace gnomon::test
