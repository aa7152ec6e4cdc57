#include "waymark/app/tags/tag_prints.hpp"

#include <filesystem>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/data.hpp"
#include "waymark/app/common/job_control.hpp"

namespace waymark {
namespace {

using ::testing::AllOf;

TEST(PagePath, NumbersPagesForSortingAndKeepsTheNameOfASinglePage) {
  EXPECT_EQ(page_path("out/tags.png", 1, 1), "out/tags.png");
  EXPECT_EQ(page_path("out/tags.png", 7, 9), "out/tags-7.png");
  EXPECT_EQ(page_path("tags.svg", 7, 24), "tags-07.svg");
  EXPECT_EQ(page_path("a.b/tags.v2.svg", 100, 100), "a.b/tags.v2-100.svg");
}

TEST(WritePages, WritesNoFileIfCancelled) {
  JobControl control;
  control.cancelled = [] { return true; };
  const WrittenPages written = write_pages({plot::Drawing{}}, {plot::FileFormat::Svg, "never.svg"}, control);
  EXPECT_FALSE(written.status);
  EXPECT_TRUE(written.files.empty());
}

TEST(WritePages, WritesATargetBesideThePageAndDoesNotReplaceOne) {
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

TEST(WritePages, ReportsAMissingFolder) {
  plot::Drawing page;
  page.width_mm = page.height_mm = 10;
  const WrittenPages written = write_pages({page}, {plot::FileFormat::Svg, "/no/such/folder/a.svg"}, {});
  ASSERT_FALSE(written.status);
  EXPECT_EQ(written.status.error().code, ErrorCode::Unwritable);
}

using ::testing::HasSubstr;

using ::testing::StartsWith;

TEST(BoardStyle, IsAStyleOfTagsOrOfSquares) {
  for (const char* style : {"aprilgrid", "separate", "chessboard", "charuco"})
    EXPECT_TRUE(check_board_style(style));
  EXPECT_THAT(to_string(check_board_style("chesboard").error()),
              AllOf(StartsWith("(style): "), HasSubstr("'chesboard'"), HasSubstr("'chessboard'")));
}

TEST(PlannedBoardOfTags, HasAKalibrTargetOnlyIfRequested) {
  plot::BoardOptions options{.tag_size_m = 0.024};
  EXPECT_EQ(plan_board(options, false)->kalibr_target, "");
  EXPECT_THAT(plan_board(options, true)->kalibr_target, HasSubstr("aprilgrid"));
  options.style = plot::BoardStyle::Separate;
  ASSERT_TRUE(plan_board(options, false));
  EXPECT_THAT(to_string(plan_board(options, true).error()), StartsWith("(kalibr_yaml): "));
  options.tag_size_m = 4;
  EXPECT_THAT(to_string(plan_board(options, false).error()), HasSubstr("fit"));
}

TEST(TagPrints, ASheetReportsPagesAndTags) {
  const auto layout =
      plot::layout_sheet(FamilyId::Tag36h11, {0, 1, 2, 3, 4}, {.tag_size_m = 0.1, .per_page = 2});
  ASSERT_TRUE(layout) << to_string(layout.error());
  const std::vector<std::string> files = {"tags-1.svg", "tags-2.svg", "tags-3.svg"};
  EXPECT_THAT(to_text(*layout, files),
              AllOf(HasSubstr("tags-1.svg …: 3 pages A4, 2 tags "), HasSubstr("of 0.1 m")));
  const auto json = to_json(fields(Printed<plot::SheetLayout>{*layout, files}));
  EXPECT_EQ(json["pages"], 3);
  EXPECT_EQ(json["tags"], 5);
  EXPECT_EQ(json["files"].size(), 3U);
  const auto one = plot::layout_sheet(FamilyId::Tag36h11, {7}, {.tag_size_m = 0.15});
  ASSERT_TRUE(one);
  EXPECT_THAT(to_text(*one, {"tag.pdf"}), HasSubstr("tag.pdf: 1 page A4, 1 tag "));
}

TEST(TagPrints, ABoardNamesItsTargetFile) {
  const auto layout = plot::layout_board({.columns = 4, .rows = 3, .tag_size_m = 0.03});
  ASSERT_TRUE(layout) << to_string(layout.error());
  EXPECT_THAT(to_text(*layout, {"board.pdf", "board.yaml"}),
              AllOf(HasSubstr("4 x 3 tags"), HasSubstr("board.yaml: ")));
  const auto json = to_json(fields(Printed<plot::BoardLayout>{*layout, {"board.pdf"}}));
  EXPECT_EQ(json["tags"], 12);
  EXPECT_EQ(json["paper_size_m"][0].get<double>() + json["paper_size_m"][1].get<double>(), 0.507);
}

TEST(TagPrints, AChessboardHasNoMarkers) {
  CalibrationBoard board{.kind = BoardKind::Chessboard, .columns = 6, .rows = 5, .size_m = 0.03};
  const auto none = printed_markers(board);
  ASSERT_TRUE(none);
  EXPECT_TRUE(none->empty());
  const auto layout = plot::layout_square_board({.board = board});
  ASSERT_TRUE(layout) << to_string(layout.error());
  const auto json = to_json(fields(Printed<plot::SquareBoardLayout>{*layout, {"board.pdf"}}));
  EXPECT_FALSE(json.contains("dictionary"));
  EXPECT_EQ(json["square_size_m"], 0.03);
  EXPECT_THAT(to_text(*layout, {"board.pdf"}),
              AllOf(HasSubstr("6 x 5 squares"), HasSubstr("0.03 m"), HasSubstr("1 page A4")));
}

}  // namespace
}  // namespace waymark
