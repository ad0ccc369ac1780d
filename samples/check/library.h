// library: the product's own includes as the tool carries them, and what they define. Nothing is listed by hand: all of it is read from the texts.
//
// Shader part: none.
// Test: tests/check_test.cpp
#pragma once

#include <map>
#include <set>
#include <string>
#include <vector>

#include "scan.h"

namespace gnomon::check {

// The texts of glsl/*.glsl by file name; copied in by the build, so that an installed tool needs no folder beside it.
[[nodiscard]] const std::map<std::string, std::string>& libraryTexts();

// The path that stands for one of them: "<gnomon>/gnomon_block.glsl".
inline constexpr const char* kLibraryFolder = "<gnomon>/";

struct Library {
  std::vector<Function> functions;  // with a body, or macros that stand for one
  std::vector<Function> hooks;  // without: the host's shader defines them
  std::vector<Struct> structs;
  std::set<std::string> options;  // macros that the host may define
  std::set<std::string> macros;  // macros that it may not
  std::vector<std::string> names;  // all of these and the block's, for suggestions
  int layoutVersion = 0, mostPartitions = 0;
};
[[nodiscard]] const Library& library();

// An include, or a copy of one, in which each macro that stands for a function is that function, under the signature in its comment and on
// the macro's line; its body says nothing. What a compiler says of it is said of the names and arguments that the user wrote.
[[nodiscard]] std::string withFunctions(const std::string& text);

// The file is one of the library's: carried by the tool, or a copy under the same name.
[[nodiscard]] bool isLibraryFile(const std::string& path);

// Value of "#define name <number>" in a text, and its line; false: there is none.
[[nodiscard]] bool findNumber(const std::string& text, const std::string& name, int& value, int& line);

}  // namespace gnomon::check
