#include "shader.h"

#include <algorithm>
#include <fstream>
#include <sstream>

namespace gnomon::offscreen {
namespace {

// Each part begins with "#line 1 NUMBER // NAME" and ends with one that returns to the part around it: drivers refuse names there,
// so withNames() puts them into the log.
void expand(const std::string& source, std::size_t part, std::vector<std::string>& seen, std::string& out) {
  std::istringstream lines(source);
  std::size_t number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    if (line.rfind("#include", 0) != 0) {
      out += line + '\n';
      continue;
    }
    const std::size_t from = line.find('"') + 1;
    const std::string name = line.substr(from, line.find('"', from) - from);
    const std::string back = "#line " + std::to_string(number + 1) + " " + std::to_string(part) + "\n";
    if (std::find(seen.begin(), seen.end(), name) != seen.end()) {
      out += '\n';
      continue;
    }
    seen.push_back(name);
    std::ifstream file(std::string(GNOMON_GLSL_DIR) + "/" + name);
    if (!file) throw std::runtime_error(std::string(GNOMON_GLSL_DIR) + "/" + name + ": cannot be read");
    std::ostringstream text;
    text << file.rdbuf();
    const std::size_t own = seen.size();  // 0 is the source itself
    out += "#line 1 " + std::to_string(own) + " // " + name + "\n";
    expand(text.str(), own, seen, out);
    out += back;
  }
}

// A driver's log with file names for the numbers of an expanded source: "2:34(5): error" becomes "gnomon_cast.glsl:34(5): error".
std::string withNames(const std::string& log, const std::string& source) {
  std::vector<std::string> names{"source"};
  std::istringstream lines(source);
  for (std::string line; std::getline(lines, line);)
    if (line.rfind("#line 1 ", 0) == 0 && line.find(" // ") != std::string::npos) names.push_back(line.substr(line.find(" // ") + 4));
  std::string out;
  std::istringstream messages(log);
  for (std::string line; std::getline(messages, line);) {
    const std::size_t digits = line.find_first_not_of("0123456789");
    const bool isNumbered = digits != 0 && digits != std::string::npos && digits < 4 && line[digits] == ':';
    const std::size_t part = isNumbered ? std::stoul(line) : names.size();
    out += (part < names.size() ? names[part] + line.substr(digits) : line) + '\n';
  }
  return out;
}

}  // namespace

std::string expandIncludes(const std::string& source) {
  std::vector<std::string> seen;
  std::string out;
  expand(source, 0, seen, out);
  return out;
}

GLuint buildProgram(const std::string& version, const std::vector<std::pair<GLenum, std::string>>& stages) {
  constexpr GLsizei kLogBytes = 8192;
  char log[kLogBytes] = {};
  const GLuint program = gl::CreateProgram();
  for (const auto& [type, source] : stages) {
    const std::string text = "#version " + version + "\n#line 1 0\n" + expandIncludes(source);
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
      throw std::runtime_error("shader does not compile: " + withNames(log, text));
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
