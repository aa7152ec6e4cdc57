// Printed calibration boards.
#include <algorithm>
#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "tests/sheets/tag_finder.hpp"
#include "tests/support/raster.hpp"
#include "waymark/plot/render.hpp"
#include "waymark/plot/tag_board.hpp"
#include "waymark/plot/tag_outline.hpp"

namespace waymark::plot {
namespace {

using waymark::testing::edge_mm;
using waymark::testing::Raster;

constexpr double kToleratedMm = 0.05;

Raster printed(const BoardLayout& layout, double dpi) {
  const Drawing page = draw_board(layout);
  return waymark::testing::rasterise_pdf(render_pdf({&page, 1}).value(), 1, dpi);
}

BoardOptions board(BoardStyle style, double tag_size_m, double spacing) {
  BoardOptions options;
  options.tag_size_m = tag_size_m;
  options.spacing = spacing;
  options.style = style;
  return options;
}

double ink_at(const Raster& page, double x_mm, double y_mm) {
  return page.ink(static_cast<int>(x_mm * page.px_per_mm()), static_cast<int>(y_mm * page.px_per_mm()),
                  static_cast<int>(x_mm * page.px_per_mm()) + 1,
                  static_cast<int>(y_mm * page.px_per_mm()) + 1);
}

TEST(PrintedAprilGrid, HasTagsAndSquaresAtTheirPositions) {
  const BoardLayout layout = layout_board(board(BoardStyle::AprilGrid, 0.024, 0.3)).value();
  const Raster page = printed(layout, 300);
  const double cell_mm = 2.4;
  const double gap_mm = 7.2;
  for (const PlacedTag& placed : layout.tags) {
    const Box& square = placed.square;
    const double band0 = square.y_mm + cell_mm;
    const double band1 = square.bottom_mm() - cell_mm;
    EXPECT_NEAR(edge_mm(page, true, square.x_mm - 3, square.x_mm + 3, band0, band1), square.x_mm,
                kToleratedMm);
    EXPECT_NEAR(edge_mm(page, true, square.right_mm() - 3, square.right_mm() + 3, band0, band1),
                square.right_mm(), kToleratedMm);
    // The square that touches the upper left corner is black exactly up to the corner.
    const double inside_mm = 0.3;
    EXPECT_EQ(ink_at(page, square.x_mm - inside_mm, square.y_mm - inside_mm), 1.0);
    EXPECT_EQ(ink_at(page, square.x_mm + inside_mm, square.y_mm - inside_mm), 0.0);
    EXPECT_EQ(ink_at(page, square.x_mm - inside_mm, square.y_mm + inside_mm), 0.0);
    EXPECT_EQ(ink_at(page, square.x_mm + inside_mm, square.y_mm + inside_mm), 1.0);
    EXPECT_NEAR(edge_mm(page, true, square.x_mm - gap_mm - 2, square.x_mm - gap_mm + 2,
                        square.y_mm - gap_mm + 1, square.y_mm - 1),
                square.x_mm - gap_mm, kToleratedMm);
  }
}

/// Every cell of every tag in the layout of Kalibr's detector: a border of two cells around the code.
TEST(PrintedAprilGrid, ShowsTheCodesFromTheLowerLeftCorner) {
  const BoardLayout layout = layout_board(board(BoardStyle::AprilGrid, 0.024, 0.3)).value();
  const Raster page = printed(layout, 150);
  const double left_mm = layout.board.x_mm + 7.2;
  const double bottom_mm = layout.board.bottom_mm() - 7.2;
  for (int number = 0; number < 36; ++number) {
    const Cells cells = two_cell_border({FamilyId::Tag36h11, number});
    const int row = number / 6;
    const double x_mm = left_mm + (number % 6) * 31.2;
    const double y_mm = bottom_mm - row * 31.2 - 24;
    for (int y = 0; y < cells.width; ++y) {
      for (int x = 0; x < cells.width; ++x) {
        const bool ink = cells.at(x, y);
        ASSERT_EQ(ink_at(page, x_mm + (x + 0.5) * 2.4, y_mm + (y + 0.5) * 2.4), ink ? 1.0 : 0.0)
            << number << " " << x << " " << y;
      }
    }
  }
}

TEST(PrintedBoardOfSeparateTags, IsReadByAprilTagInOrder) {
  for (const auto& [family, size_m, spacing] :
       {std::tuple(FamilyId::Tag36h11, 0.024, 0.3), std::tuple(FamilyId::TagStandard41h12, 0.015, 1.0),
        std::tuple(FamilyId::Tag25h9, 0.026, 0.15)}) {
    BoardOptions options = board(BoardStyle::Separate, size_m, spacing);
    options.family = family;
    options.rows = 5;
    const BoardLayout layout = layout_board(options).value();
    const Raster page = printed(layout, 200);
    const auto seen = waymark::testing::find_tags(page, family);
    ASSERT_EQ(seen.size(), 30U) << to_string(family);
    for (std::size_t i = 0; i < seen.size(); ++i) {
      EXPECT_EQ(seen[i].tag, layout.tags[i].tag);
      const Box& square = layout.tags[i].square;
      EXPECT_NEAR(seen[i].corners_mm[0].x_mm, square.x_mm, 0.1);
      EXPECT_NEAR(seen[i].corners_mm[0].y_mm, square.y_mm, 0.1);
      EXPECT_NEAR(seen[i].corners_mm[2].x_mm, square.right_mm(), 0.1);
      EXPECT_NEAR(seen[i].corners_mm[2].y_mm, square.bottom_mm(), 0.1);
    }
  }
}

/// The reason for two styles. If this fails, AprilTag detects Kalibr's boards, and the documentation must
/// change.
TEST(PrintedAprilGrid, IsNotReadByAprilTag) {
  const BoardLayout layout = layout_board(board(BoardStyle::AprilGrid, 0.024, 0.3)).value();
  EXPECT_EQ(waymark::testing::find_tags(printed(layout, 150), FamilyId::Tag36h11).size(), 0U);
}

TEST(PrintedBoard, PrintsItsParameters) {
  const Drawing page = draw_board(layout_board(board(BoardStyle::AprilGrid, 0.024, 0.3)).value());
  const std::string text = waymark::testing::text_of_pdf(render_pdf({&page, 1}).value());
  for (const char* words : {"24 mm", "tag36h11", "0 to 35", "7.2 mm", "0.3", "tag 0", "100 %"}) {
    EXPECT_NE(text.find(words), std::string::npos) << words << " is not in:\n" << text;
  }
}

}  // namespace
}  // namespace waymark::plot
