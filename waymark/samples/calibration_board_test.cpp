#include "waymark/samples/calibration_board.hpp"

#include <cmath>

#include <gtest/gtest.h>

namespace waymark {
namespace {

CalibrationBoard charuco(int columns, int rows, bool legacy = false) {
  return {.kind = BoardKind::Charuco,
          .columns = columns,
          .rows = rows,
          .size_m = 0.03,
          .marker_m = 0.02,
          .legacy_pattern = legacy};
}

TEST(CalibrationBoard, CornersLieWhereFourSquaresMeetAroundTheCentre) {
  const auto corners = board_corners(charuco(5, 4));
  ASSERT_EQ(corners.size(), 12U);
  EXPECT_LT((corners[0] - Eigen::Vector2d(-0.045, -0.03)).norm(), 1e-12);
  EXPECT_LT((corners[1] - Eigen::Vector2d(-0.015, -0.03)).norm(), 1e-12);
  EXPECT_LT((corners[11] + corners[0]).norm(), 1e-12);
}

TEST(CalibrationBoard, MarkersAreInWhiteSquaresRowByRow) {
  for (const CalibrationBoard& board :
       {charuco(5, 4), charuco(4, 4), charuco(4, 4, true), charuco(4, 5, true)}) {
    const auto markers = board_markers(board);
    EXPECT_EQ(markers.size(), static_cast<std::size_t>(board.columns * board.rows / 2));
    for (std::size_t i = 0; i < markers.size(); ++i) {
      EXPECT_EQ(markers[i].id, static_cast<int>(i));
      const int column =
          static_cast<int>(std::lround(markers[i].middle_m.x() / 0.03 + 0.5 * (board.columns - 1)));
      const int row = static_cast<int>(std::lround(markers[i].middle_m.y() / 0.03 + 0.5 * (board.rows - 1)));
      EXPECT_FALSE(is_black_square(board, column, row));
    }
  }
  EXPECT_TRUE(is_black_square(charuco(4, 4), 0, 0));
  EXPECT_FALSE(
      is_black_square(charuco(4, 4, true), 0, 0));  // before OpenCV 4.6, the lower left square was black
  EXPECT_TRUE(is_black_square(charuco(4, 4, true), 0, 3));
  EXPECT_TRUE(is_black_square(charuco(4, 5, true), 0, 0));
}

TEST(CalibrationBoard, AprilGridsCountFromTheLowerLeft) {
  const CalibrationBoard board{
      .kind = BoardKind::AprilGrid, .columns = 3, .rows = 2, .size_m = 0.04, .spacing = 0.25};
  const auto tags = board_markers(board);
  ASSERT_EQ(tags.size(), 6U);
  EXPECT_LT((tags[0].middle_m - Eigen::Vector2d(-0.05, 0.025)).norm(), 1e-12);
  EXPECT_LT((tags[5].middle_m - Eigen::Vector2d(0.05, -0.025)).norm(), 1e-12);
  const auto corners = board_corners(board);
  ASSERT_EQ(corners.size(), 24U);
  EXPECT_LT((corners[0] - Eigen::Vector2d(-0.07, 0.005)).norm(), 1e-12);  // TL
  EXPECT_LT((corners[2] - Eigen::Vector2d(-0.03, 0.045)).norm(), 1e-12);  // BR
}

TEST(CalibrationBoard, RejectsInvalidBoards) {
  EXPECT_TRUE(check_board(charuco(5, 4)));
  EXPECT_FALSE(check_board(charuco(2, 4)));
  EXPECT_FALSE(check_board(charuco(5, 100000)));
  CalibrationBoard board = charuco(5, 4);
  board.marker_m = 0.03;
  EXPECT_FALSE(check_board(board));
  board = charuco(5, 4);
  board.size_m = -1;
  EXPECT_FALSE(check_board(board));
  EXPECT_EQ(board_kind("charuco"), BoardKind::Charuco);
  EXPECT_FALSE(board_kind("charoco"));
}

}  // namespace
}  // namespace waymark
