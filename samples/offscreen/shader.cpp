#include "shader.h"

#include <sstream>

namespace gnomon::offscreen {
namespace {

// Each #include line becomes that file's flat text, between "#line 1 NUMBER // NAME" and a line that returns to the source: drivers
// refuse names there, so withNames() puts them into the log.
std::string withIncludes(const std::string& source) {
  std::string out;
  std::istringstream lines(source);
  std::size_t number = 0, parts = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    if (line.rfind("#include", 0) != 0) {
      out += line + '\n';
      continue;
    }
    const std::size_t from = line.find('"') + 1;
    const std::string name = line.substr(from, line.find('"', from) - from);
    const auto text = flatTexts().find(name);
    if (text == flatTexts().end()) throw std::runtime_error("#include \"" + name + "\": no such include");
    out += "#line 1 " + std::to_string(++parts) + " // flat/" + name + "\n" + text->second + "#line " + std::to_string(number + 1) + " 0\n";
  }
  return out;
}

// A driver's log with file names for the numbers in a source: "2:34(5): error" becomes "flat/gnomon_cast.glsl:34(5): error".
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

GLuint buildProgram(const std::string& version, const std::vector<std::pair<GLenum, std::string>>& stages) {
  constexpr GLsizei kLogBytes = 8192;
  char log[kLogBytes] = {};
  const GLuint program = gl::CreateProgram();
  for (const auto& [type, source] : stages) {
    const std::string text = "#version " + version + "\n#line 1 0\n" + withIncludes(source);
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
