#include "waymark/app/cli/folded_warnings.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace waymark {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

std::vector<std::string> weak_tags(int count) {
  std::vector<std::string> warnings;
  for (int i = 0; i < count; ++i)
    warnings.push_back(fmt::format("tag36h11:{} hangs on 7 views of at most {} px", i, 20 + i % 5));
  return warnings;
}

TEST(FoldedWarnings, OfAKindTheFirstAreSaidAndTheOthersCounted) {
  std::vector<std::string> warnings = weak_tags(2000);
  warnings.insert(warnings.begin() + 1000, "no mapped tag was seen for 3.1 s");
  EXPECT_THAT(folded_warnings(warnings),
              ElementsAre(warnings[0], warnings[1], warnings[2], HasSubstr("1997 more"),
                          "no mapped tag was seen for 3.1 s"));
}

TEST(FoldedWarnings, FewAreSaidAsTheyAre) {
  EXPECT_EQ(folded_warnings(weak_tags(4)), weak_tags(4));
  EXPECT_TRUE(folded_warnings({}).empty());
  EXPECT_EQ(folded_warnings({"-1.5", "", "x"}), (std::vector<std::string>{"-1.5", "", "x"}));
}

}  // namespace
}  // namespace waymark
