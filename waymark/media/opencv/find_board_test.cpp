// Renders boards from their geometry and checks that corners are found at their rendered positions, with the
// numbers of the board.
#include "waymark/media/opencv/find_board.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include <gtest/gtest.h>
#include <Eigen/LU>

#include "waymark/base/random.hpp"

namespace waymark {
namespace {

constexpr int kWidth = 640;
constexpr int kHeight = 480;

/// Homography from the board to the image, with mild perspective and about 700 px per metre.
Eigen::Matrix3d view(double tilt = 0.3) {
  Eigen::Matrix3d H;
  H << 1500, 90, 320, -60, 1450, 240, tilt, -0.5 * tilt, 1;
  return H;
}

Eigen::Vector2d seen(const Eigen::Matrix3d& px_H_board, const Eigen::Vector2d& board_m) {
  const Eigen::Vector3d p = px_H_board * Eigen::Vector3d(board_m.x(), board_m.y(), 1);
  return p.head<2>() / p.z();
}

/// Whether a point of a chessboard or ChArUco board is black.
bool is_black(const CalibrationBoard& board, const std::map<int, MarkerCells>& cells,
              const Eigen::Vector2d& m) {
  const double column = m.x() / board.size_m + 0.5 * board.columns;
  const double row = m.y() / board.size_m + 0.5 * board.rows;
  if (column < 0 || row < 0 || column >= board.columns || row >= board.rows) return false;
  if (is_black_square(board, static_cast<int>(column), static_cast<int>(row))) return true;
  for (const BoardMarker& marker : board_markers(board)) {
    const Eigen::Vector2d off = m - marker.middle_m;
    if (off.cwiseAbs().maxCoeff() > marker.size_m / 2) continue;
    const MarkerCells& inner = cells.at(marker.id);
    const double cell_m = marker.size_m / (inner.width + 2);
    const int x = static_cast<int>((off.x() + marker.size_m / 2) / cell_m) - 1;
    const int y = static_cast<int>((off.y() + marker.size_m / 2) / cell_m) - 1;
    if (x < 0 || y < 0 || x >= inner.width || y >= inner.width) return true;
    return inner.black[static_cast<std::size_t>(y * inner.width + x)];
  }
  return false;
}

Image painted(const CalibrationBoard& board, const Eigen::Matrix3d& px_H_board) {
  std::map<int, MarkerCells> cells;
  for (const BoardMarker& marker : board_markers(board))
    cells[marker.id] = marker_cells(board.dictionary, marker.id).value();
  const Eigen::Matrix3d board_H_px = px_H_board.inverse();
  constexpr int kFine = 4;
  Image image(kWidth, kHeight, 230);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      int black = 0;
      for (int k = 0; k < kFine * kFine; ++k) {
        const Eigen::Vector2d px(x + (k % kFine + 0.5) / kFine, y + (k / kFine + 0.5) / kFine);
        black += is_black(board, cells, seen(board_H_px, px)) ? 1 : 0;
      }
      image.row(y)[x] = static_cast<std::uint8_t>(230 - 200 * black / (kFine * kFine));
    }
  }
  return image;
}

/// A chessboard is symmetric under half a turn, so its corners may be numbered from the other end.
void expect_corners(const CalibrationBoard& board, const Eigen::Matrix3d& px_H_board, std::size_t fewest) {
  const auto found = find_board(painted(board, px_H_board).view(), board);
  ASSERT_TRUE(found) << to_string(found.error());
  const auto places = board_corners(board);
  EXPECT_GE(found->corners.size(), fewest);
  double worst_px = 0;
  double worst_turned_px = 0;
  for (const BoardCorner& corner : found->corners) {
    const auto number = static_cast<std::size_t>(corner.number);
    worst_px = std::max(worst_px, (corner.px - seen(px_H_board, places[number])).norm());
    const Eigen::Vector2d& other = places[places.size() - 1 - number];
    worst_turned_px = std::max(worst_turned_px, (corner.px - seen(px_H_board, other)).norm());
  }
  const bool either = board.kind == BoardKind::Chessboard;
  EXPECT_LT(either ? std::min(worst_px, worst_turned_px) : worst_px, 0.25) << "pixel centres at one half";
}

CalibrationBoard chessboard() {
  return {.kind = BoardKind::Chessboard, .columns = 8, .rows = 6, .size_m = 0.03};
}
CalibrationBoard charuco() {
  return {.kind = BoardKind::Charuco, .columns = 7, .rows = 5, .size_m = 0.04, .marker_m = 0.03};
}

TEST(FindBoard, ChessboardCornersAreAtTheirRenderedPositions) {
  expect_corners(chessboard(), view(), 35);
  expect_corners(chessboard(), view(-0.8), 35);
}

TEST(FindBoard, CharucoCornersAreNumberedByMarkersEvenIfHalfInView) {
  expect_corners(charuco(), view(), 22);
  Eigen::Matrix3d half = view();
  half(0, 2) += 300;
  expect_corners(charuco(), half, 6);
}

TEST(FindBoard, MarkerSizeRelativeToSquareIsMeasured) {
  const auto found = find_board(painted(charuco(), view()).view(), charuco());
  ASSERT_TRUE(found && found->marker_share);
  EXPECT_NEAR(*found->marker_share, 0.75, 0.03);
}

TEST(FindBoard, FindsNothingWithoutABoard) {
  Random random(4);
  Image noise(kWidth, kHeight);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) noise.row(y)[x] = static_cast<std::uint8_t>(random.index(256));
  for (const CalibrationBoard& board : {chessboard(), charuco()}) {
    EXPECT_TRUE(find_board(noise.view(), board)->corners.empty());
    EXPECT_TRUE(find_board(Image(kWidth, kHeight, 90).view(), board)->corners.empty());
    EXPECT_TRUE(find_board(ImageView(), board)->corners.empty()) << "an empty image";
    EXPECT_TRUE(find_board(Image(3, 2, 90).view(), board)->corners.empty()) << "a few pixels";
  }
}

TEST(FindBoard, ATooSmallOrUnknownDictionaryIsAnError) {
  CalibrationBoard large = charuco();
  large.first_id = 45;  // of 50 ids, but the board has 17 markers
  const auto found = find_board(painted(charuco(), view()).view(), large);
  ASSERT_FALSE(found);
  EXPECT_EQ(found.error().place.key, "dictionary");
  const auto unknown = marker_cells("4x4_51", 0);
  ASSERT_FALSE(unknown);
  EXPECT_NE(unknown.error().hint.find("4x4_50"), std::string::npos) << unknown.error().hint;
  EXPECT_TRUE(marker_cells("DICT_5X5_100", 99)) << "OpenCV's name";
  EXPECT_FALSE(marker_cells("4x4_50", 50));
  EXPECT_FALSE(marker_cells("4x4_50", -1));
}

TEST(NameMarkers, ReturnsTheSmallestDictionaryThatContainsAll) {
  EXPECT_EQ(name_markers(painted(charuco(), view()).view()), "4x4_50");
  EXPECT_EQ(name_markers(painted(chessboard(), view()).view()), "");
}

}  // namespace
}  // namespace waymark
