// claims: what the papers' own comparisons report, beside the studies that repeat them (plan.h).
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace gnomon::report {

struct Claim {
  const char *study, *title;
  std::string says;  // the claim, and what was measured
  std::vector<std::pair<std::string, std::string>> paper;  // variant, the paper's frame time over its first row's
  std::string remark;  // why ours differs, where it does
};

[[nodiscard]] const std::vector<Claim>& claims();

}  // namespace gnomon::report
