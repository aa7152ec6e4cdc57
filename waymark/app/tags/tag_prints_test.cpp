#include "waymark/app/tags/tag_prints.hpp"

#include <filesystem>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/data.hpp"

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

TEST(WritePages, WritesATargetBesideThePageAndReplacesNone) {
  const std::filesystem::path folder = testing::fresh_folder("write_pages");
  plot::Drawing page;
  page.width_mm = page.height_mm = 10;
  PageFiles to{plot::FileFormat::Svg, (folder / "board.svg").string()};
  to.target = "target_type: 'aprilgrid'\n";
  const WrittenPages written = write_pages({page}, to, {});
  ASSERT_TRUE(written.status) << to_string(written.status.error());
  ASSERT_EQ(written.files.size(), 2U);
  EXPECT_EQ(written.files[1], (folder / "board.yaml").string());
  EXPECT_EQ(std::filesystem::file_size(written.files[1]), to.target.size());
  ASSERT_TRUE(std::filesystem::remove(written.files[0]));
  const WrittenPages again = write_pages({page}, to, {});
  ASSERT_FALSE(again.status);
  EXPECT_NE(to_string(again.status.error()).find("board.yaml"), std::string::npos);
  EXPECT_FALSE(std::filesystem::exists(written.files[0])) << "no page without its target";
}

TEST(WritePages, NamesTheFolderThatIsNotThere) {
  plot::Drawing page;
  page.width_mm = page.height_mm = 10;
  const WrittenPages written = write_pages({page}, {plot::FileFormat::Svg, "/no/such/folder/a.svg"}, {});
  ASSERT_FALSE(written.status);
  EXPECT_EQ(written.status.error().code, ErrorCode::Unwritable);
}

using ::testing::HasSubstr;
using ::testing::StartsWith;

TEST(BoardStyle, IsOneOfTagsOrOfSquares) {
  for (const char* style : {"aprilgrid", "separate", "chessboard", "charuco"})
    EXPECT_TRUE(check_board_style(style));
  EXPECT_THAT(to_string(check_board_style("chesboard").error()),
              StartsWith("(style): unknown board style 'chesboard'. Did you mean 'chessboard'?"));
}

TEST(PlannedBoardOfTags, HoldsWhatKalibrReadsOnlyWhereItIsAskedFor) {
  plot::BoardOptions options{.tag_size_m = 0.024};
  EXPECT_EQ(plan_board(options, false)->kalibr_target, "");
  EXPECT_THAT(plan_board(options, true)->kalibr_target, HasSubstr("aprilgrid"));
  options.style = plot::BoardStyle::Separate;
  ASSERT_TRUE(plan_board(options, false));
  EXPECT_THAT(to_string(plan_board(options, true).error()), StartsWith("(--kalibr-yaml): "));
  options.tag_size_m = 4;
  EXPECT_THAT(to_string(plan_board(options, false).error()), HasSubstr("fit"));
}

}  // namespace
}  // namespace waymark
