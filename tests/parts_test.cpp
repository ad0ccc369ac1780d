// A part is one algorithm or stage: header, solver file, GLSL file or a word that there is none, test and README section share a stem.
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>
#include <string>

#include <gtest/gtest.h>

namespace {

namespace fs = std::filesystem;

const fs::path kRoot = GNOMON_SOURCE_DIR;
const std::set<std::string> kNoParts{"gnomon", "export"};

std::string read(const fs::path& path) {
  std::ifstream file(path);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

std::set<std::string> stems(const fs::path& folder, const std::string& extension) {
  std::set<std::string> out;
  for (const auto& entry : fs::directory_iterator(kRoot / folder))
    if (entry.path().extension() == extension) out.insert(entry.path().stem().string());
  return out;
}

TEST(Parts, EachHasEveryFile) {
  const std::string readme = read(kRoot / "README.md");
  for (const std::string& stem : stems("include/gnomon", ".h")) {
    if (kNoParts.count(stem) > 0) continue;
    const std::string header = read(kRoot / "include/gnomon" / (stem + ".h"));
    EXPECT_TRUE(fs::exists(kRoot / "solver" / (stem + ".cpp"))) << stem;
    EXPECT_NE(readme.find("\n## " + stem + "\n"), std::string::npos) << stem << ": no README section";
    EXPECT_EQ(header.rfind("// " + stem + ": ", 0), 0u) << stem << ": the header must open with its name and what it does";
    const std::size_t test = header.find("// Test: ");
    ASSERT_NE(test, std::string::npos) << stem;
    std::istringstream tests(header.substr(test + 9, header.find('\n', test) - test - 9));
    for (std::string name; std::getline(tests, name, ',');) {
      name.erase(0, name.find_first_not_of(' '));
      EXPECT_TRUE(fs::exists(kRoot / name)) << stem << ": " << name;
    }
    const bool hasNone = header.find("Shader part: none.") != std::string::npos;
    const bool hasGlsl = header.find("Shader part: glsl/gnomon_") != std::string::npos;
    EXPECT_TRUE(hasNone || hasGlsl) << stem << ": the header must name its shader part, or say none";
    if (hasNone) {
      EXPECT_FALSE(fs::exists(kRoot / "glsl" / ("gnomon_" + stem + ".glsl"))) << stem;
    }
  }
}

TEST(Parts, NoSolverFileWithoutAHeader) {
  const std::set<std::string> headers = stems("include/gnomon", ".h");
  for (const std::string& stem : stems("solver", ".cpp")) EXPECT_EQ(headers.count(stem), 1u) << stem;
}

TEST(Parts, EveryShaderFileBelongsToAHeader) {
  for (std::string stem : stems("glsl", ".glsl")) {
    if (kNoParts.count(stem) > 0) continue;
    ASSERT_EQ(stem.rfind("gnomon_", 0), 0u);
    stem.erase(0, 7);
    const std::string header = read(kRoot / "include/gnomon" / (stem + ".h"));
    EXPECT_NE(header.find("glsl/gnomon_" + stem + ".glsl"), std::string::npos) << stem;
  }
}

// The solver depends on GLM and the standard library, and allocates nothing.
TEST(Parts, TheSolverIncludesOnlyGlmAndTheStandardLibrary) {
  for (const std::string folder : {"solver", "include/gnomon"})
    for (const auto& entry : fs::directory_iterator(kRoot / folder)) {
      std::istringstream lines(read(entry.path()));
      for (std::string line; std::getline(lines, line);) {
        if (line.rfind("#include ", 0) != 0) continue;
        const std::string name = line.substr(10, line.size() - 11);
        const bool isOwn =
            line[9] == '"' && (name.rfind("gnomon/", 0) == 0 || fs::exists(kRoot / "solver" / name) || name == "gnomon_block.glsl");
        const bool isGlm = name.rfind("glm/", 0) == 0,
                   isStandard = line[9] == '<' && name.find('/') == std::string::npos && name.find('.') == std::string::npos;
        EXPECT_TRUE(isOwn || isGlm || isStandard) << entry.path() << ": " << line;
      }
    }
}

}  // namespace
