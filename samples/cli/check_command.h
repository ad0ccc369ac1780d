// check_command: `gnomon check`: what is checked, from the command line and from a list, and the answer as text or JSON.
//
// Shader part: none.
// Test: tests/check_test.cpp
#pragma once

#include <string>
#include <vector>

namespace CLI {
class App;
}

namespace gnomon::cli {

struct CheckArguments {
  std::vector<std::string> files, folders, defines, targets;
  std::string stage, list;
  bool isJson = false, hasStatistics = false;

  void addTo(CLI::App& app);
};

// 0: nothing wrong, 1: errors found. Throws Refusal for arguments, lists and files that cannot be used.
[[nodiscard]] int check(const CheckArguments& arguments);

}  // namespace gnomon::cli
