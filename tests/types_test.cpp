#include "support.h"

#include <set>
#include <string>

namespace gnomon::test {
namespace {

constexpr int kStatusCount = static_cast<int>(Status::floatRange) + 1;

TEST(Types, EveryStatusNamesItsFieldAndRule) {
  for (int i = 1; i < kStatusCount; ++i) {
    const auto status = static_cast<Status>(i);
    EXPECT_NE(std::string(statusField(status)), "") << i;
    EXPECT_NE(std::string(statusRule(status)), "unknown status") << i;
  }
  EXPECT_EQ(std::string(statusRule(static_cast<Status>(kStatusCount))), "unknown status");
}

TEST(Types, EveryWarningHasItsOwnText) {
  std::set<std::string> texts;
  for (int i = 0; i < kWarningCount; ++i) texts.insert(warningText(static_cast<Warning>(1u << i)));
  EXPECT_EQ(texts.size(), static_cast<std::size_t>(kWarningCount));
  EXPECT_EQ(texts.count(""), 0u);
}

}  // namespace
}  // namespace gnomon::test
