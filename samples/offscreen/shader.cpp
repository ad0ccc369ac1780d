#include "shader.h"

#include <fstream>
#include <set>
#include <sstream>

namespace gnomon::offscreen {
namespace {

void expand(const std::string& source, std::set<std::string>& seen, std::string& out) {
  std::istringstream lines(source);
  for (std::string line; std::getline(lines, line);) {
    if (line.rfind("#include", 0) != 0) {
      out += line + '\n';
      continue;
    }
    const std::size_t from = line.find('"') + 1;
    const std::string name = line.substr(from, line.find('"', from) - from);
    if (!seen.insert(name).second) continue;
    std::ifstream file(std::string(GNOMON_GLSL_DIR) + "/" + name);
    if (!file) throw std::runtime_error(std::string(GNOMON_GLSL_DIR) + "/" + name + ": cannot be read");
    std::ostringstream text;
    text << file.rdbuf();
    expand(text.str(), seen, out);
  }
}

}  // namespace

std::string expandIncludes(const std::string& source) {
  std::set<std::string> seen;
  std::string out;
  expand(source, seen, out);
  return out;
}

GLuint buildProgram(const std::string& version, const std::vector<std::pair<GLenum, std::string>>& stages) {
  constexpr GLsizei kLogBytes = 8192;
  char log[kLogBytes] = {};
  const GLuint program = gl::CreateProgram();
  for (const auto& [type, source] : stages) {
    const std::string text = "#version " + version + "\n" + expandIncludes(source);
    const char* pointer = text.c_str();
    const GLuint shader = gl::CreateShader(type);
    gl::ShaderSource(shader, 1, &pointer, nullptr);
    gl::CompileShader(shader);
    GLint isFine = 0;
    gl::GetShaderiv(shader, GL_COMPILE_STATUS, &isFine);
    if (!isFine) {
      gl::GetShaderInfoLog(shader, kLogBytes, nullptr, log);
      gl::DeleteShader(shader);
      gl::DeleteProgram(program);
      throw std::runtime_error("shader does not compile: " + std::string(log));
    }
    gl::AttachShader(program, shader);
    gl::DeleteShader(shader);
  }
  gl::LinkProgram(program);
  GLint isFine = 0;
  gl::GetProgramiv(program, GL_LINK_STATUS, &isFine);
  if (isFine) return program;
  gl::GetProgramInfoLog(program, kLogBytes, nullptr, log);
  gl::DeleteProgram(program);
  throw std::runtime_error("program does not link: " + std::string(log));
}

}  // namespace gnomon::offscreen
