// report: speed against error, measured: the command's options and its run.
//
// Test: tests/report_test.cpp
#pragma once

#include <string>
#include <vector>

#include <CLI/CLI.hpp>

namespace gnomon::report {

struct ReportArguments {
  std::vector<std::string> scenes, methods, merged;
  std::string folder, shard;
  bool quick = false, profile = false;

  void addTo(CLI::App& app);
};

// Returns an exit code. Throws cli::Refusal for bad input, std::runtime_error where the machine fails.
int report(const ReportArguments& arguments);

}  // namespace gnomon::report
