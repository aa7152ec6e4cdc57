#include "waymark/app/cli/console.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace waymark::cli {
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

TEST(NamingFlag, SpeaksAsPeopleType) {
  EXPECT_EQ(to_string(naming_flag({ErrorCode::InvalidArgument, "too big", {.key = "tag_size_m"}, {}})),
            "(--tag-size-m): too big");
  EXPECT_EQ(naming_flag({ErrorCode::InvalidArgument, "m", {}, {}}).place.key, "");
  EXPECT_EQ(naming_flag({ErrorCode::InvalidArgument, "m", {.key = "--per-page"}, {}}).place.key,
            "--per-page");
}

TEST(NamingFlag, LeavesAPlaceInAFileAsItIs) {
  const Error error =
      naming_flag({ErrorCode::InvalidArgument, "m", {.source = "a.yaml", .key = "tag_size_m"}, {}});
  EXPECT_EQ(error.place.key, "tag_size_m");
}

TEST(ExitCodeOf, IsUsageWhereAFlagIsWrongAndFailureWhereAFileIs) {
  EXPECT_EQ(exit_code_of({ErrorCode::InvalidArgument, "m", {.key = "--laps"}, {}}), ExitCode::Usage);
  EXPECT_EQ(exit_code_of({ErrorCode::Unreadable, "m", {.source = "lap.mcap"}, {}}), ExitCode::SomeFailed);
}

}  // namespace
}  // namespace waymark::cli
