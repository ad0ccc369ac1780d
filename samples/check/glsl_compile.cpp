#include "glsl_compile.h"

#include <algorithm>
#include <array>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string_view>

#include <glslang/Public/ResourceLimits.h>
#include <glslang/Public/ShaderLang.h>
#include <glslang/SPIRV/GlslangToSpv.h>
#include <glslang/SPIRV/spirv.hpp>
#include <spirv-tools/libspirv.hpp>
#include <spirv-tools/optimizer.hpp>

#include "library.h"
#include "scan.h"

namespace gnomon::check {
namespace {

namespace fs = std::filesystem;

constexpr int kDefaultVersion = 110;  // what GLSL says of a text without #version

struct Process {
  Process() { glslang::InitializeProcess(); }
  ~Process() { glslang::FinalizeProcess(); }
};

// The line that asks for `name`; 0: none does, as where a macro spells it.
int includeLine(const std::string& text, const std::string& name) {
  for (const Directive& directive : directivesOf(text))
    if (directive.name == "include" && directive.rest.find_first_of("\">", 1) == name.size() + 1 &&
        directive.rest.compare(1, name.size(), name) == 0)
      return directive.line;
  return 0;
}

class Includer final : public glslang::TShader::Includer {
 public:
  Includer(const GlslSource& source, GlslResult& result) : m_source(source), m_result(result) { m_result.texts[source.name] = source.text; }

  IncludeResult* includeLocal(const char* name, const char* from, std::size_t depth) override {
    const bool isLibrarys = std::string_view(from).rfind(kLibraryFolder, 0) == 0;  // its files stand beside each other
    return isLibrarys ? openLibrarys(name, from, depth) : open(fs::path(from).parent_path() / name, name, from, depth);
  }
  IncludeResult* includeSystem(const char* name, const char* from, std::size_t depth) override {
    for (const std::string& folder : m_source.folders)
      if (IncludeResult* const found = open(fs::path(folder) / name, name, from, depth)) return found;
    return openLibrarys(name, from, depth);
  }
  void releaseInclude(IncludeResult* result) override { delete result; }

 private:
  IncludeResult* open(const fs::path& path, const char* name, const char* from, std::size_t depth) {
    std::error_code error;
    if (!fs::is_regular_file(path, error)) return nullptr;
    const std::string file = path.lexically_normal().string();
    if (m_result.texts.count(file) > 0) return keep(file, "", name, from, depth);
    std::ifstream stream(path, std::ios::binary);
    std::ostringstream text;
    text << stream.rdbuf();
    return stream ? keep(file, text.str(), name, from, depth) : nullptr;
  }
  IncludeResult* openLibrarys(const char* name, const char* from, std::size_t depth) {
    const auto at = libraryTexts().find(fs::path(name).lexically_normal().string());
    return at == libraryTexts().end() ? nullptr : keep(kLibraryFolder + at->first, at->second, name, from, depth);
  }
  IncludeResult* keep(const std::string& file, const std::string& text, const char* name, const char* from, std::size_t depth) {
    constexpr std::size_t kDeepest = 64;  // a file that includes itself
    if (depth > kDeepest) return nullptr;
    const auto [at, isNew] = m_result.texts.emplace(file, m_source.hasFunctions ? withFunctions(text) : text);
    if (isNew) m_result.includedFrom[file] = {from, includeLine(m_result.texts[from], name)};
    return new IncludeResult(file, at->second.data(), at->second.size(), nullptr);  // a map's elements stay where they are
  }

  const GlslSource& m_source;
  GlslResult& m_result;
};

constexpr std::array kLanguages{EShLangVertex, EShLangTessControl, EShLangTessEvaluation, EShLangGeometry, EShLangFragment, EShLangCompute};

EShMessages rules(GlslTarget target) {
  switch (target) {
    case GlslTarget::openGl: return EShMsgSpvRules;
    case GlslTarget::vulkan: return static_cast<EShMessages>(EShMsgSpvRules | EShMsgVulkanRules);
    default: return EShMsgDefault;
  }
}

// Empties the text's #version line; the other lines keep their numbers.
void blankVersion(std::string& text) {
  for (const Directive& directive : directivesOf(text)) {
    if (directive.name != "version") continue;
    std::size_t start = 0;
    for (int line = 1; line < directive.line; ++line) start = text.find('\n', start) + 1;
    text.erase(start, std::min(text.find('\n', start), text.size()) - start);
    return;
  }
}

// A shader with its texts and its environment, ready to be parsed.
class Shader {
 public:
  Shader(GlslStage stage, const GlslSource& source, GlslTarget target)
      : m_body(source.hasFunctions ? withFunctions(source.text) : source.text),
        m_name(source.name),
        m_shader(kLanguages[static_cast<std::size_t>(stage)]) {
    static const Process process;
    if (!source.version.empty()) {
      m_version = "#version " + source.version + "\n";
      blankVersion(m_body);
    }
    m_texts = {m_version.c_str(), m_body.c_str()};
    m_names = {m_name.c_str(), m_name.c_str()};
    const std::size_t first = m_version.empty() ? 1 : 0;
    m_shader.setStringsWithLengthsAndNames(m_texts.data() + first, nullptr, m_names.data() + first, static_cast<int>(2 - first));
    m_preamble = "#extension GL_GOOGLE_include_directive : enable\n" + source.preamble;
    m_shader.setPreamble(m_preamble.c_str());
    setEnvironment(target);
  }
  glslang::TShader& operator*() { return m_shader; }
  glslang::TShader* operator->() { return &m_shader; }

 private:
  void setEnvironment(GlslTarget target) {
    constexpr int kDialect = 100;
    const EShLanguage language = m_shader.getStage();
    if (target == GlslTarget::openGl) {
      m_shader.setEnvInput(glslang::EShSourceGlsl, language, glslang::EShClientOpenGL, kDialect);
      m_shader.setEnvClient(glslang::EShClientOpenGL, glslang::EShTargetOpenGL_450);
      m_shader.setEnvTarget(glslang::EShTargetSpv, glslang::EShTargetSpv_1_0);
    } else if (target == GlslTarget::vulkan) {
      m_shader.setEnvInput(glslang::EShSourceGlsl, language, glslang::EShClientVulkan, kDialect);
      m_shader.setEnvClient(glslang::EShClientVulkan, glslang::EShTargetVulkan_1_1);
      m_shader.setEnvTarget(glslang::EShTargetSpv, glslang::EShTargetSpv_1_3);
    }
  }

  std::string m_version, m_body, m_name, m_preamble;  // the compiler keeps pointers to them
  std::array<const char*, 2> m_texts{}, m_names{};
  glslang::TShader m_shader;
};

// "file:12: what is wrong": a file's name may hold colons.
GlslMessage messageOf(bool isError, const std::string& text) {
  GlslMessage out;
  out.isError = isError;
  out.text = text;
  for (std::size_t colon = text.find(':'); colon != std::string::npos; colon = text.find(':', colon + 1)) {
    const std::size_t end = text.find_first_not_of("0123456789", colon + 1);
    if (end == colon + 1 || end == std::string::npos || text.compare(end, 2, ": ") != 0) continue;
    out.place.file = text.substr(0, colon);
    out.place.line = std::atoi(text.c_str() + colon + 1);
    out.text = text.substr(end + 2);
    break;
  }
  return out;
}

std::vector<GlslMessage> messagesOf(const std::string& log) {
  std::vector<GlslMessage> out;
  std::istringstream lines(log);
  for (std::string line; std::getline(lines, line);) {
    const bool isError = line.rfind("ERROR: ", 0) == 0, isWarning = line.rfind("WARNING: ", 0) == 0;
    if (!isError && !isWarning) {
      if (!out.empty() && line.rfind("    ", 0) == 0) out.back().text += " " + line.substr(line.find_first_not_of(' '));
      continue;
    }
    GlslMessage message = messageOf(isError, line.substr(line.find(' ') + 1));
    if (message.text.find("compilation errors.") == std::string::npos) out.push_back(std::move(message));
  }
  return out;
}

spv_target_env environmentOf(GlslTarget target) { return target == GlslTarget::vulkan ? SPV_ENV_VULKAN_1_1 : SPV_ENV_OPENGL_4_5; }

spvtools::MessageConsumer listenTo(std::string& said) {
  return [&said](spv_message_level_t, const char*, const spv_position_t&, const char* message) { said += std::string(message) + "\n"; };
}

}  // namespace

GlslResult compileGlsl(GlslStage stage, const GlslSource& source, GlslTarget target, bool isMapped) {
  Shader shader(stage, source, target);
  isMapped = isMapped && target != GlslTarget::validate;
  if (isMapped) {
    shader->setAutoMapBindings(true);
    shader->setAutoMapLocations(true);
  }
  const EShMessages messages = rules(target);
  GlslResult result;
  Includer includer(source, result);
  result.isCompiled = shader->parse(GetDefaultResources(), kDefaultVersion, false, messages, includer);
  glslang::TProgram program;
  program.addShader(&*shader);
  result.isFine = result.isCompiled && program.link(messages) && (!isMapped || program.mapIO());
  result.log = std::string(shader->getInfoLog()) + program.getInfoLog();
  result.messages = messagesOf(result.log);
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
    glslang::GlslangToSpv(*program.getIntermediate(shader->getStage()), result.spirv, &options);
  }
  return result;
}

std::string versionOf(const std::string& text) {
  for (const Directive& directive : directivesOf(text))
    if (directive.name == "version") return directive.rest;
  return "";
}

std::string preprocessGlsl(GlslStage stage, const GlslSource& source, GlslTarget target) {
  GlslSource versioned = source;  // the version in a text of its own: the line after it is the first of the shader's
  if (versioned.version.empty()) versioned.version = versionOf(source.text);
  if (versioned.version.empty()) return "";
  Shader shader(stage, versioned, target);
  GlslResult read;
  Includer includer(versioned, read);
  std::string out;
  if (!shader->preprocess(GetDefaultResources(), kDefaultVersion, ENoProfile, false, false, rules(target), &out, includer)) return "";
  const std::size_t version = out.find("#version");
  return version == std::string::npos ? "" : out.substr(std::min(out.find('\n', version), out.size() - 1) + 1);
}

std::vector<std::uint32_t> optimiseSpirv(const std::vector<std::uint32_t>& spirv, GlslTarget target, std::string& said) {
  spvtools::Optimizer optimizer(environmentOf(target));
  optimizer.SetMessageConsumer(listenTo(said));
  optimizer.RegisterPerformancePasses();
  std::vector<std::uint32_t> optimised;
  if (!optimizer.Run(spirv.data(), spirv.size(), &optimised)) optimised.clear();
  return optimised;
}

std::string validateSpirv(const std::vector<std::uint32_t>& spirv, GlslTarget target) {
  std::string said;
  spvtools::SpirvTools tools(environmentOf(target));
  tools.SetMessageConsumer(listenTo(said));
  if (!tools.Validate(spirv)) return "before: " + said;
  const std::vector<std::uint32_t> optimised = optimiseSpirv(spirv, target, said);
  if (optimised.empty()) return "spirv-opt: " + said;
  return tools.Validate(optimised) ? "" : "after: " + said;
}

int countInstructions(const std::vector<std::uint32_t>& spirv) {
  constexpr std::size_t kHeader = 5;
  int count = 0;
  bool isInside = false;
  for (std::size_t at = kHeader; at < spirv.size();) {
    const std::uint32_t words = spirv[at] >> spv::WordCountShift, operation = spirv[at] & spv::OpCodeMask;
    if (operation == spv::OpFunction) isInside = true;
    const bool isFrame = operation == spv::OpFunction || operation == spv::OpFunctionParameter || operation == spv::OpFunctionEnd ||
                         operation == spv::OpLabel || operation == spv::OpVariable || operation == spv::OpLine ||
                         operation == spv::OpNoLine;
    count += isInside && !isFrame;
    if (operation == spv::OpFunctionEnd) isInside = false;
    if (words == 0) break;  // not a module
    at += words;
  }
  return count;
}

}  // namespace gnomon::check
