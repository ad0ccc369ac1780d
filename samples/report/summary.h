// summary: what a report's records say: one row for each variant over all views, rank correlations, the papers' comparisons.
//
// Test: tests/report_test.cpp
#pragma once

#include <map>
#include <string>
#include <vector>

#include "case.h"

namespace gnomon::report {

// Records by their keys' text; later ones replace earlier ones.
using Records = std::map<std::string, cli::Json>;

// A record's place in Records.
[[nodiscard]] std::string keyText(const cli::Json& record);

// Reads a file of one record a line; a last line that an interruption cut off is left out. No file: none.
void readRecords(const std::string& path, Records& records);

// A study's records in the order they were planned, refused ones left out.
[[nodiscard]] std::vector<const cli::Json*> recordsOf(const Records& records, const std::string& study, const std::string& scene = "",
                                                      double texels = 0.0);

// Distinct values of a key's member, in the order of their first record.
[[nodiscard]] std::vector<cli::Json> valuesOf(const std::vector<const cli::Json*>& records, const std::string& member);

// Spearman's rank correlation, equal values sharing their mean rank. NaN for fewer than three pairs, or where all of one side are equal.
[[nodiscard]] double spearman(const std::vector<double>& a, const std::vector<double>& b);

struct Row {
  std::string label;
  cli::Json method;
  int views = 0;  // view x budget, in which the first variant of the study was measured too
  double frame = 0.0, shadow = 0.0, triangles = 0.0;  // over the first variant's: geometric means of ratios
  double wrong = 0.0, wrongNear = 0.0;  // the same; half a pixel is added to each count, so that none is 0
  double wrongShare = 0.0;  // of the counted pixels, mean
  double meanError = 0.0, maxError = 0.0, neededOverLimit = 0.0;  // geometric means; NaN where unknown
  double passes = 0.0, texels = 0.0, solveUs = 0.0, flips = 0.0, flipsLight = 0.0, unserved = 0.0, distance = 0.0;  // means
};
[[nodiscard]] std::vector<Row> summarise(const std::vector<const cli::Json*>& records);

// Predicted mean error against wrong pixels near true edges over the variants of one scene and budget, both summed over the scene's views.
struct Correlation {
  std::string scene;
  double texels = 0.0, overVisible = 0.0, acrossEdges = 0.0;
  int variants = 0;
};
[[nodiscard]] std::vector<Correlation> correlations(const Records& records);

// Of the finite ones; NaN where there are none.
[[nodiscard]] double median(std::vector<double> values);

}  // namespace gnomon::report
