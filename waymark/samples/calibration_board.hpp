#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "waymark/base/error.hpp"

namespace waymark {

/// Printed boards whose corners, at which four squares meet, are detected individually.
enum class BoardKind : std::uint8_t {
  Chessboard,  ///< detected only if the whole board is visible
  Charuco,     ///< a chessboard with an ArUco marker in each white square, which identifies its corners
  AprilGrid,   ///< Kalibr boards: tag36h11 tags with a two-cell border, and black squares touching their
               ///< corners
};

/// "chessboard", "charuco", "aprilgrid".
[[nodiscard]] std::string_view to_string(BoardKind kind);
[[nodiscard]] std::optional<BoardKind> board_kind(std::string_view word);

struct CalibrationBoard {
  BoardKind kind = BoardKind::Charuco;
  int columns = 0;       ///< squares in a row; for an AprilGrid, tags
  int rows = 0;          ///< squares in a column; for an AprilGrid, tags
  double size_m = 0;     ///< side of a square; for an AprilGrid, side of a tag's black square
  double marker_m = 0;   ///< ChArUco: side of the black square of a marker
  double spacing = 0.3;  ///< AprilGrid: gap between two tags as a fraction of their size
  int first_id = 0;      ///< ChArUco: id of the first marker; AprilGrid: id of the lower left tag
  std::string dictionary = "4x4_50";  ///< ChArUco: OpenCV's name without "DICT_", in lower case
  /// ChArUco board as drawn by OpenCV before 4.6, with a black square at the lower left. Since 4.6 the upper
  /// left square is black, which makes a difference if the number of rows is even.
  bool legacy_pattern = false;

  friend bool operator==(const CalibrationBoard&, const CalibrationBoard&) = default;
};

/// A marker on a board, with the centre and side of its black square [m]. The origin is the centre of the
/// board, with x to the right and y down.
struct BoardMarker {
  int id = 0;
  Eigen::Vector2d middle_m{0, 0};
  double size_m = 0;
};

/// A corner of a board as observed in one image.
struct BoardCorner {
  int number = 0;            ///< index into board_corners()
  Eigen::Vector2d px{0, 0};  ///< distorted, with pixel centres at +1/2
};

/// Fails on fewer than 3 x 3 squares or 1 x 1 tags, on an invalid size, and if a marker fills its square. The
/// error (InvalidArgument) names the field.
[[nodiscard]] Status check_board(const CalibrationBoard& board);

/// Corner positions of a board [m], with the origin at its centre, x to the right and y down. For a
/// chessboard and a ChArUco board, these are the inner corners row by row from the upper left. For an
/// AprilGrid, they are TL, TR, BR, BL of each tag; as in Kalibr, tags are ordered row by row from the lower
/// left to the right and up. O(corners).
[[nodiscard]] std::vector<Eigen::Vector2d> board_corners(const CalibrationBoard& board);

/// The markers on a ChArUco board (row by row from the top, as in OpenCV) or on an AprilGrid; empty for a
/// chessboard.
[[nodiscard]] std::vector<BoardMarker> board_markers(const CalibrationBoard& board);

/// Whether the square in this column and row (counted from the upper left) of a chessboard or ChArUco board
/// is black.
[[nodiscard]] bool is_black_square(const CalibrationBoard& board, int column, int row);

}  // namespace waymark
