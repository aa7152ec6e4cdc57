#include "waymark/jobs/write_pages.hpp"

#include <gtest/gtest.h>

namespace waymark {
namespace {

TEST(PagePath, NumbersPagesSoThatTheySortAndKeepsTheNameOfTheOnlyOne) {
  EXPECT_EQ(page_path("out/tags.png", 1, 1), "out/tags.png");
  EXPECT_EQ(page_path("out/tags.png", 7, 9), "out/tags-7.png");
  EXPECT_EQ(page_path("tags.svg", 7, 24), "tags-07.svg");
  EXPECT_EQ(page_path("a.b/tags.v2.svg", 100, 100), "a.b/tags.v2-100.svg");
}

TEST(WritePages, StopsWithoutAFileOnceItIsCancelled) {
  JobControl control;
  control.cancelled = [] { return true; };
  const WrittenPages written = write_pages({plot::Drawing{}}, {plot::FileFormat::Svg, "never.svg"}, control);
  EXPECT_FALSE(written.status);
  EXPECT_TRUE(written.files.empty());
}

TEST(WritePages, NamesTheFolderThatIsNotThere) {
  plot::Drawing page;
  page.width_mm = page.height_mm = 10;
  const WrittenPages written = write_pages({page}, {plot::FileFormat::Svg, "/no/such/folder/a.svg"}, {});
  ASSERT_FALSE(written.status);
  EXPECT_EQ(written.status.error().code, ErrorCode::Unwritable);
}

}  // namespace
}  // namespace waymark
