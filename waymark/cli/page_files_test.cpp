#include "waymark/cli/page_files.hpp"

#include <gtest/gtest.h>

namespace waymark::cli {
namespace {

TEST(PagePath, NumbersPagesSoThatTheySortAndKeepsTheNameOfTheOnlyOne) {
  EXPECT_EQ(page_path("out/tags.png", 1, 1), "out/tags.png");
  EXPECT_EQ(page_path("out/tags.png", 7, 9), "out/tags-7.png");
  EXPECT_EQ(page_path("tags.svg", 7, 24), "tags-07.svg");
  EXPECT_EQ(page_path("a.b/tags.v2.svg", 100, 100), "a.b/tags.v2-100.svg");
}

TEST(NamingFlag, SpeaksAsPeopleType) {
  EXPECT_EQ(to_string(naming_flag({ErrorCode::InvalidArgument, "too big", {.key = "tag_size_m"}, {}})),
            "(--tag-size-m): too big");
  EXPECT_EQ(naming_flag({ErrorCode::InvalidArgument, "m", {}, {}}).place.key, "");
  EXPECT_EQ(naming_flag({ErrorCode::InvalidArgument, "m", {.key = "--per-page"}, {}}).place.key,
            "--per-page");
}

}  // namespace
}  // namespace waymark::cli
