// Errors as JSON, one line each.
#include "waymark/app/common/json_line.hpp"

#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace waymark {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

TEST(JsonLine, AnErrorHasOnlyWhatIsKnownOfItsPlace) {
  const auto bare = to_json(Error{ErrorCode::NotFound, "no map"});
  EXPECT_EQ(bare.dump(), R"({"code":"not_found","message":"no map"})");
  const auto whole = to_json(Error{ErrorCode::Unreadable,
                                   "cut",
                                   {.source = "a.mcap", .line = 3, .byte = 70'000'000'000, .key = "x.y"},
                                   "Record again."});
  EXPECT_EQ(whole["source"], "a.mcap");
  EXPECT_EQ(whole["line"], 3);
  EXPECT_EQ(whole["byte"], 70'000'000'000);
  EXPECT_EQ(whole["key"], "x.y");
  EXPECT_EQ(whole["hint"], "Record again.");
}

TEST(JsonLine, IsOneLineWhateverItHolds) {
  const std::string hostile = std::string("a\nb\"\\\t") + '\xff' + "\xc3\x28" + '\0' + "end";
  const std::string line = json_line({{"name", hostile}});
  EXPECT_EQ(std::count(line.begin(), line.end(), '\n'), 1);
  EXPECT_EQ(line.back(), '\n');
  const auto read = nlohmann::json::parse(line);
  EXPECT_THAT(read["name"].get<std::string>(),
              AllOf(HasSubstr("a\nb\"\\\t"), HasSubstr("\xEF\xBF\xBD"), HasSubstr("end")));
}

}  // namespace
}  // namespace waymark
