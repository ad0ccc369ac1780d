// plan: what a report measures: methods with their settings, texel budgets, and the papers' own comparisons.
//
// A row whose method the tool does not know is left out, so that a method appears once it exists.
// Test: tests/report_test.cpp
#pragma once

#include <string>
#include <vector>

#include "case.h"

namespace gnomon::report {

// One way to spend a budget: a point in each plot.
struct Variant {
  std::string label;  // unique in its study
  std::string method;
  cli::Json settings = cli::Json::object();  // of the method, as a case has them
  int partitions = 4;
  double texels = 0.0;  // of all maps; 0: the group's budget
  bool samples = false;  // told what the view samples: sdsm; any other method is cut by them too
  bool pictured = false;
};

// Variants measured side by side, interleaved, on the same views.
struct Study {
  std::string name, title;
  int width = 640, height = 360;
  std::vector<double> texels = {};  // budgets, smallest first
  std::string light = {};  // only views under the light of this name, where a scene has one; empty: all views
  bool allViews = true;  // or each scene's first
  bool isPath = false;  // count flips along a camera path and a light path
  std::vector<Variant> variants = {};  // the first is what the others are compared with
};

inline constexpr const char* kSweep = "sweep";

// The sweep, then the papers' comparisons. methods: only these, by name; none: all. quick: fewer views, budgets and rows.
[[nodiscard]] std::vector<Study> studies(const std::vector<std::string>& methods, bool quick);

}  // namespace gnomon::report
