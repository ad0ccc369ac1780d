// The README's snippets: the C++ ones are compiled as they stand (tests/CMakeLists.txt cuts them out into readme_snippets.cpp), the GLSL ones
// by a driver.
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "shader.h"

namespace {

std::vector<std::string> snippets(const std::string& language) {
  std::ifstream file(std::string(GNOMON_SOURCE_DIR) + "/README.md");
  std::vector<std::string> out;
  bool isInside = false;
  for (std::string line; std::getline(file, line);) {
    if (line.rfind("```", 0) == 0) {
      isInside = !isInside && line == "```" + language;
      if (isInside) out.emplace_back();
    } else if (isInside) {
      out.back() += line + "\n";
    }
  }
  return out;
}

TEST(Readme, ShaderSnippetsCompile) {
  const auto context = gnomon::offscreen::createContext(gnomon::offscreen::defaultBackend(), 4, 5);
  gnomon::offscreen::gl::load(*context);
  const std::vector<std::string> all = snippets("glsl");
  ASSERT_EQ(all.size(), 2u);
  // The first screen's lines are statements with an include; the second snippet is global and gives the hook.
  const std::size_t body = all[0].find('\n') + 1;
  const std::string fragment =
      all[1] + "in vec3 world; in vec3 normal; out vec4 colour;\nvoid main() {\n" + all[0].substr(body) + "colour = vec4(lit);\n}\n";
  EXPECT_EQ(all[0].substr(0, body), "#include \"gnomon.glsl\"\n");
  const std::string vertex =
      "out vec3 world; out vec3 normal;\nvoid main() { world = normal = vec3(1.0); gl_Position = vec4(world, 1.0); }\n";
  for (const char* version : {"330 core", "450"})
    EXPECT_NO_THROW((void)gnomon::offscreen::buildProgram(version, {{GL_VERTEX_SHADER, vertex}, {GL_FRAGMENT_SHADER, fragment}}));
}

// The block's size that the README states.
TEST(Readme, StatesTheBlocksSize) {
  std::ifstream file(std::string(GNOMON_SOURCE_DIR) + "/README.md");
  std::ostringstream text;
  text << file.rdbuf();
  EXPECT_NE(text.str().find("4352 bytes"), std::string::npos);  // 256 + 16 * 256, asserted in solver/block.cpp
}

}  // namespace
