#include "waymark/plot/tag_board.hpp"

#include <cmath>
#include <limits>

#include <rapidcheck.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"
#include "waymark/plot/render.hpp"

namespace waymark::plot {
namespace {

using ::testing::HasSubstr;
constexpr double kSlackMm = 1e-6;

BoardOptions board_of(double tag_size_m) {
  BoardOptions options;
  options.tag_size_m = tag_size_m;
  return options;
}

Error error_of(const BoardOptions& options) {
  const auto layout = layout_board(options);
  return layout ? Error{.message = "no error"} : layout.error();
}

void expect_error(const BoardOptions& options, const char* key, const char* value) {
  const auto layout = layout_board(options);
  ASSERT_FALSE(layout) << key << " " << value;
  EXPECT_EQ(layout.error().code, ErrorCode::InvalidArgument);
  EXPECT_EQ(layout.error().place.key, key);
  EXPECT_THAT(layout.error().message + layout.error().hint, HasSubstr(value));
  testing::expect_on_page("tags", layout.error());
}

/// Kalibr, GridCalibrationTargetAprilgrid::createGridPoints: corner (row, column) in the grid of 2 rows x 2
/// columns of corners per tag. Measured from the lower left corner of tag 0, with x to the right and y up, in
/// units of the tag size.
Point kalibr_corner(int row, int column, double spacing) {
  const int tag_column = column / 2;
  const int tag_row = row / 2;
  return {tag_column * (1 + spacing) + column % 2, tag_row * (1 + spacing) + row % 2};
}

TEST(Board, CornersAreWhereKalibrExpectsThem) {
  BoardOptions options = board_of(0.024);
  options.columns = 5;
  const BoardLayout layout = layout_board(options).value();
  ASSERT_EQ(layout.tags.size(), 30U);
  const Box origin = layout.tags.front().square;
  for (const PlacedTag& placed : layout.tags) {
    const int row = placed.tag.number / 5;
    const int column = placed.tag.number % 5;
    const Point wanted = kalibr_corner(2 * row, 2 * column, 0.3);
    EXPECT_NEAR(placed.square.x_mm - origin.x_mm, wanted.x_mm * 24, kSlackMm);
    EXPECT_NEAR(origin.bottom_mm() - placed.square.bottom_mm(), wanted.y_mm * 24, kSlackMm);
    const Point opposite = kalibr_corner(2 * row + 1, 2 * column + 1, 0.3);
    EXPECT_NEAR(placed.square.right_mm() - origin.x_mm, opposite.x_mm * 24, kSlackMm);
    EXPECT_NEAR(origin.bottom_mm() - placed.square.y_mm, opposite.y_mm * 24, kSlackMm);
  }
}

TEST(Board, StaysOnThePage) {
  EXPECT_TRUE(rc::check([] {
    BoardOptions options = board_of(*rc::gen::inRange(50, 1000) / 1e4);
    options.columns = *rc::gen::inRange(1, 9);
    options.rows = *rc::gen::inRange(1, 9);
    options.spacing = *rc::gen::inRange(13, 100) / 100.0;
    options.style = *rc::gen::element(BoardStyle::AprilGrid, BoardStyle::Separate);
    options.paper = *rc::gen::elementOf(known_papers());
    const auto layout = layout_board(options);
    if (!layout) {
      RC_ASSERT(layout.error().message.find("does not fit") != std::string::npos);
      RC_DISCARD("does not fit");
    }
    const double margin_mm = options.margin_m * 1e3;
    RC_ASSERT(layout->board.x_mm >= margin_mm - kSlackMm);
    RC_ASSERT(layout->board.y_mm >= margin_mm - kSlackMm);
    RC_ASSERT(layout->board.right_mm() <= layout->paper.width_mm - margin_mm + kSlackMm);
    RC_ASSERT(layout->caption.y_mm >= layout->board.bottom_mm() - kSlackMm);
    RC_ASSERT(layout->caption.bottom_mm() <= layout->footer.strip.y_mm + kSlackMm);
    const double gap_mm = options.spacing * options.tag_size_m * 1e3;
    for (const PlacedTag& placed : layout->tags) {
      RC_ASSERT(placed.square.x_mm >= layout->board.x_mm + gap_mm - kSlackMm);
      RC_ASSERT(placed.square.bottom_mm() <= layout->board.bottom_mm() - gap_mm + kSlackMm);
    }
  }));
}

TEST(Board, TheHintHasSizeAndPaperThatFit) {
  expect_error(board_of(0.03), "tag_size_m", "243.0 x 243.0 mm");
  EXPECT_THAT(error_of(board_of(0.03)).hint, HasSubstr("0.0246 m"));
  EXPECT_THAT(error_of(board_of(0.03)).hint, HasSubstr("Tabloid"));
  EXPECT_TRUE(layout_board(board_of(0.0246)));
  EXPECT_FALSE(layout_board(board_of(0.0247)));
  BoardOptions options = board_of(0.03);
  options.paper = parse_paper("Tabloid").value();
  EXPECT_TRUE(layout_board(options));
}

TEST(Board, InvalidBoardsAreRejected) {
  for (const double size_m : {0.0, -1.0, 30.0, std::numeric_limits<double>::quiet_NaN()}) {
    expect_error(board_of(size_m), "tag_size_m", "m");
  }
  BoardOptions options = board_of(0.024);
  options.columns = 0;
  expect_error(options, "cols", "[1, 100]");
  options = board_of(0.024);
  options.spacing = std::numeric_limits<double>::quiet_NaN();
  expect_error(options, "spacing", "nan");
  options = board_of(0.024);
  options.first_id = 560;
  expect_error(options, "family", "595");
  expect_error(options, "family", "0 to 586");
  options = board_of(0.024);
  options.family = FamilyId::TagStandard41h12;
  expect_error(options, "family", "'separate'");
  options.style = BoardStyle::Separate;
  expect_error(options, "spacing", "1.000");
  options = board_of(0.02);
  options.style = BoardStyle::Separate;
  options.spacing = 0.12;
  expect_error(options, "spacing", "0.125");
  options.spacing = 0.125;
  EXPECT_TRUE(layout_board(options));
}

TEST(Board, StylesRoundTrip) {
  for (const BoardStyle style : {BoardStyle::AprilGrid, BoardStyle::Separate})
    EXPECT_EQ(parse_board_style(to_string(style)).value(), style);
  const Error unknown = parse_board_style("aprilgird").error();
  EXPECT_EQ(unknown.place.key, "style");
  EXPECT_THAT(unknown.hint, HasSubstr("'aprilgrid'"));
  testing::expect_on_page("tags", unknown);
}

TEST(KalibrTarget, IsTheExpectedFile) {
  EXPECT_EQ(kalibr_target(board_of(0.0246)).value(),
            "target_type: 'aprilgrid'\ntagCols: 6\ntagRows: 6\ntagSize: 0.0246\ntagSpacing: 0.3\n");
}

TEST(KalibrTarget, IsRejectedForBoardsThatKalibrDoesNotRead) {
  BoardOptions options = board_of(0.02);
  options.style = BoardStyle::Separate;
  EXPECT_EQ(kalibr_target(options).error().code, ErrorCode::Unsupported);
  options = board_of(0.02);
  options.family = FamilyId::Tag25h9;
  EXPECT_EQ(kalibr_target(options).error().code, ErrorCode::Unsupported);
  options = board_of(0.02);
  options.first_id = 1;
  EXPECT_EQ(kalibr_target(options).error().code, ErrorCode::Unsupported);
  testing::expect_on_page("tags", kalibr_target(options).error());
}

TEST(Board, SameInputSameBytes) {
  const Drawing page = draw_board(layout_board(board_of(0.02)).value());
  const Drawing again = draw_board(layout_board(board_of(0.02)).value());
  EXPECT_EQ(render_svg(page).value(), render_svg(again).value());
  EXPECT_EQ(render_pdf({&page, 1}).value(), render_pdf({&again, 1}).value());
}

}  // namespace
}  // namespace waymark::plot
