// page: a report's records as one HTML page that needs nothing beside it, a summary for a README, and a table for programs.
//
// Test: tests/report_test.cpp
#pragma once

#include <string>

#include "summary.h"

namespace gnomon::report {

// folder: where the records' pictures lie; those that are missing are left out.
[[nodiscard]] std::string pageOf(const Records& records, const std::string& folder);

// The plot over all scenes, and its table in Markdown.
[[nodiscard]] std::string summarySvg(const Records& records);
[[nodiscard]] std::string summaryTable(const Records& records);

// One line for each record, refused ones included.
[[nodiscard]] std::string csvOf(const Records& records);

// Records, summary, correlations and the papers' comparisons.
[[nodiscard]] cli::Json jsonOf(const Records& records);

}  // namespace gnomon::report
