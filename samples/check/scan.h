// scan: GLSL as tokens with their places, and what they declare. No expression is understood: only names, signatures, struct members and
// blocks, which is what a checker needs where the compiler gives no tree or refuses the shader.
//
// Shader part: none.
// Test: tests/check_test.cpp
#pragma once

#include <string>
#include <vector>

#include "glsl_compile.h"

namespace gnomon::check {

struct Token {
  std::string text;
  GlslPlace place;
};

// Comments and directives skipped, #line obeyed.
[[nodiscard]] std::vector<Token> tokensOf(const std::string& text, const std::string& file);

// One directive of a text: "define", "NAME 16", its line.
struct Directive {
  std::string name, rest;
  int line = 0;
};
[[nodiscard]] std::vector<Directive> directivesOf(const std::string& text);

// Every identifier in a text, in order.
[[nodiscard]] std::vector<std::string> wordsOf(const std::string& text);

struct Function {
  std::string name;
  std::string signature;  // "float gnomonCompare(int map, vec2 uv, float layer, float depth)"
  std::vector<std::string> types;  // of its parameters, without qualifiers
  GlslPlace place;
  bool isDefinition = false;
};

struct Member {
  std::string type, name, array;  // array: what stands between the brackets; empty: none
  GlslPlace place;
};

struct Struct {
  std::string name;
  std::vector<Member> members;
  GlslPlace place;
};

// A uniform or buffer block.
struct Block {
  std::string name;
  std::vector<std::string> layout;  // the words of layout(...)
  std::vector<Member> members;
  GlslPlace place;
};

struct Declarations {
  std::vector<Function> functions;
  std::vector<Struct> structs;
  std::vector<Block> blocks;
  std::vector<Token> names;  // every name that follows a type: variables, parameters, members, functions
};
[[nodiscard]] Declarations declarationsOf(const std::vector<Token>& tokens);

// The candidate that is a slip of the hand away from a name; empty: none.
[[nodiscard]] std::string nearest(const std::string& name, const std::vector<std::string>& candidates);

}  // namespace gnomon::check
