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
    warnings.push_back(fmt::format("tag36h11:{} has 7 observations of at most {} px", i, 20 + i % 5));
  return warnings;
}

TEST(FoldedWarnings, PrintsTheFirstOfEachKindAndCountsTheOthers) {
  std::vector<std::string> warnings = weak_tags(2000);
  warnings.insert(warnings.begin() + 1000, "no mapped tag was seen for 3.1 s");
  EXPECT_THAT(folded_warnings(warnings),
              ElementsAre(warnings[0], warnings[1], warnings[2], HasSubstr("1997 more"),
                          "no mapped tag was seen for 3.1 s"));
}

TEST(FoldedWarnings, KeepsFewWarningsUnchanged) {
  EXPECT_EQ(folded_warnings(weak_tags(4)), weak_tags(4));
  EXPECT_TRUE(folded_warnings({}).empty());
  EXPECT_EQ(folded_warnings({"-1.5", "", "x"}), (std::vector<std::string>{"-1.5", "", "x"}));
}

std::string named(const Place& place) {
  const auto has_flag = [](std::string_view flag) { return flag == "--tag-size-m"; };
  return naming_flag({ErrorCode::InvalidArgument, "m", place, {}}, has_flag).place.key;
}

TEST(NamingFlag, WritesTheFieldAsFlag) {
  EXPECT_EQ(named({.key = "tag_size_m"}), "--tag-size-m");
  EXPECT_EQ(named({}), "");
  EXPECT_EQ(named({.key = "--set follower.reach_m=9"}), "--set follower.reach_m=9");
  EXPECT_EQ(naming_flag({ErrorCode::InvalidArgument, "m", {.key = "tag_size_m"}, {}}, {}).place.key,
            "tag_size_m")
      << "without a table of flags";
}

TEST(NamingFlag, KeepsKeysWithoutFlag) {
  EXPECT_EQ(named({.source = "a.yaml", .key = "tag_size_m"}), "tag_size_m") << "a key in the file";
  EXPECT_EQ(named({.key = "fx"}), "fx");
  EXPECT_EQ(named({.key = "tag36h11:3"}), "tag36h11:3");
}

TEST(ExitCodeOf, IsUsageForAFieldAndSomeFailedForAFile) {
  const auto code = [](const Place& place) {
    return exit_code_of({ErrorCode::InvalidArgument, "m", place, {}});
  };
  EXPECT_EQ(code({.key = "laps"}), ExitCode::Usage);
  EXPECT_EQ(code({.key = "--set follower.reach_m=9"}), ExitCode::Usage);
  EXPECT_EQ(code({.source = "map", .key = "`route`"}), ExitCode::Usage);
  EXPECT_EQ(code({.source = "environment", .key = "ROS_DOMAIN_ID"}), ExitCode::Usage);
  EXPECT_EQ(code({.source = "robot.yaml", .key = "limits.speed_m_s"}), ExitCode::SomeFailed);
  EXPECT_EQ(code({.source = "lap.mcap"}), ExitCode::SomeFailed);
  EXPECT_EQ(code({}), ExitCode::SomeFailed);
}

TEST(FailUsage, ReturnsSomeFailedForAnErrorOfAFile) {
  std::FILE* err = std::tmpfile();
  ASSERT_NE(err, nullptr);
  Console console("waymark x", stdout, err);
  const auto code = [&](const Place& place) {
    return fail_usage({ErrorCode::InvalidArgument, "m", place, {}}, console);
  };
  EXPECT_EQ(code({}), ExitCode::Usage);
  EXPECT_EQ(code({.key = "world"}), ExitCode::Usage);
  EXPECT_EQ(code({.source = "map", .key = "`route`"}), ExitCode::Usage);
  EXPECT_EQ(code({.source = "robot.yaml", .line = 3, .key = "limits"}), ExitCode::SomeFailed);
  std::fclose(err);
}

TEST(Console, PrintsTheFieldOfAnErrorAsFlagOfTheVerbAndAnInputByName) {
  const auto has_flag = [](std::string_view flag) { return flag == "--world" || flag == "--map"; };
  const auto has_own = [](std::string_view flag) { return flag == "--map"; };
  std::FILE* err = std::tmpfile();
  ASSERT_NE(err, nullptr);
  Console console("waymark x", stdout, err, has_flag, has_own);
  console.note(Error{ErrorCode::NotFound, "none", {.key = "world"}, "Give `world`."});
  console.note(Error{ErrorCode::NotFound, "none", {.key = "map"}, {}});
  std::rewind(err);
  std::string text(200, '\0');
  text.resize(std::fread(text.data(), 1, text.size(), err));
  std::fclose(err);
  EXPECT_EQ(text, "waymark x: (world): none. Give --world.\nwaymark x: (--map): none\n");
}

TEST(Console, PrintsFieldsAsFlags) {
  const auto has_flag = [](std::string_view flag) { return flag == "--route" || flag == "--map"; };
  std::FILE* err = std::tmpfile();
  ASSERT_NE(err, nullptr);
  Console console("waymark x", stdout, err, has_flag);
  console.note(Error{ErrorCode::NotFound, "none", {.source = "map", .key = "`route`"}, "Give `map`."});
  console.note(Error{ErrorCode::NotFound, "none", {.key = "route"}, {}});
  std::rewind(err);
  std::string printed(200, '\0');
  printed.resize(std::fread(printed.data(), 1, printed.size(), err));
  std::fclose(err);
  EXPECT_EQ(printed, "waymark x: map (--route): none. Give --map.\nwaymark x: (--route): none\n");
}

}  // namespace
}  // namespace waymark::cli
