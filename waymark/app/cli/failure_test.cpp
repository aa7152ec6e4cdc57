#include "waymark/app/cli/failure.hpp"

#include <gtest/gtest.h>

namespace waymark::cli {
namespace {

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
