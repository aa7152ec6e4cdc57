#include "waymark/app/cli/field_flags.hpp"

#include <set>

#include <gtest/gtest.h>

namespace waymark::cli {
namespace {

bool has_flag(std::string_view flag) {
  static const std::set<std::string_view> flags = {"--tag-size-m", "--anchor", "--json", "--output", "--imu"};
  return flags.contains(flag);
}
std::string written(std::string_view text) { return with_flags(text, has_flag); }

TEST(FieldFlags, AFieldBecomesAFlagWithItsValue) {
  EXPECT_EQ(written("Give `tag_size_m`, the side."), "Give --tag-size-m, the side.");
  EXPECT_EQ(written("`tag_size_m=0.16`"), "--tag-size-m 0.16");
  EXPECT_EQ(written("`imu`/`anchor` or `output`"), "--imu/--anchor or -o");
  EXPECT_EQ(written("`json=true`"), "--json");
  EXPECT_EQ(written("`anchor=`"), "--anchor ");
}

TEST(FieldFlags, ACommandKeepsItsBackticks) {
  EXPECT_EQ(written("run `waymark map LAP anchor=tag36h11:3 json=true`!"),
            "run `waymark map LAP --anchor tag36h11:3 --json`!");
  EXPECT_EQ(written("`waymark map json`"), "`waymark map json`") << "a word without '=' is an input";
}

TEST(FieldFlags, OtherTextStaysUnchanged) {
  for (const std::string_view text :
       {"", "`", "no field", "`unknown`", "`Tag_Size_m`", "`tag_size_m", "a `b c` d", "``", "```", "`--json`",
        "`waymark map unknown=3`", "`9`", "`é`"})
    EXPECT_EQ(written(text), text);
  EXPECT_EQ(written("a ` b `json`"), "a ` b --json") << "an unmatched backtick before a field";
}

TEST(FieldFlags, ASecondConversionChangesNothing) {
  const std::string once = written("Give `tag_size_m=2` to `waymark map anchor=1`.");
  EXPECT_EQ(written(once), once);
}

}  // namespace
}  // namespace waymark::cli
