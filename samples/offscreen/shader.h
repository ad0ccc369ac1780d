// shader: programs that include the product's GLSL files.
#pragma once

#include <map>
#include <string>
#include <utility>
#include <vector>

#include "gl.h"

namespace gnomon::offscreen {

// The product's GLSL files with their includes in place, by name.
[[nodiscard]] const std::map<std::string, std::string>& flatTexts();

// Compiles and links; each stage is a type (GL_VERTEX_SHADER, ...) and a source without its #version line, which `version` gives
// ("330 core"); #include "name" takes the flat text of one of the product's files. Throws std::runtime_error with the driver's log. The
// caller deletes the program.
[[nodiscard]] GLuint buildProgram(const std::string& version, const std::vector<std::pair<GLenum, std::string>>& stages);

}  // namespace gnomon::offscreen
