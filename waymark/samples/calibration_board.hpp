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

/// Printed boards whose corners, where four squares meet, are detected individually.
enum class BoardKind : std::uint8_t {
  Chessboard,  ///< detected only if the whole board is in view
  Charuco,     ///< a chessboard with an ArUco marker in each white square, which identifies its corners
  AprilGrid,   ///< Kalibr's board: tags of tag36h11 with a border of two cells, and black squares that touch
               ///< their corners
};

/// "chessboard", "charuco", "aprilgrid".
[[nodiscard]] std::string_view to_string(BoardKind kind);
[[nodiscard]] std::optional<BoardKind> board_kind(std::string_view word);

struct CalibrationBoard {
  BoardKind kind = BoardKind::Charuco;
  int columns = 0;       ///< squares in a row; AprilGrid: tags
  int rows = 0;          ///< squares in a column; AprilGrid: tags
  double size_m = 0;     ///< side of a square; AprilGrid: side of a tag's black square
  double marker_m = 0;   ///< ChArUco: side of a marker's black square
  double spacing = 0.3;  ///< AprilGrid: gap between two tags, as a fraction of their size
  int first_id = 0;      ///< ChArUco: id of the first marker; AprilGrid: id of the lower left tag
  std::string dictionary = "4x4_50";  ///< ChArUco: OpenCV's name without "DICT_", in lower case
  /// ChArUco as OpenCV drew it before 4.6: the lower left square is black. Since 4.6 the upper left square is
  /// black, which differs if the number of rows is even.
  bool legacy_pattern = false;

  friend bool operator==(const CalibrationBoard&, const CalibrationBoard&) = default;
};

/// A marker on a board: centre and side of its black square [m]; x right, y down, from the centre of the
/// board.
struct BoardMarker {
  int id = 0;
  Eigen::Vector2d middle_m{0, 0};
  double size_m = 0;
};

/// A corner of a board as observed in one image.
struct BoardCorner {
  int number = 0;            ///< index into board_corners()
  Eigen::Vector2d px{0, 0};  ///< distorted, pixel centres at +1/2
};

/// Fails (InvalidArgument; the place contains the field) on fewer than 3 x 3 squares or 1 x 1 tags, on
/// invalid sizes, or if a marker fills its square.
[[nodiscard]] Status check_board(const CalibrationBoard& board);

/// Corner positions of a board [m]; x right, y down, from its centre. For a chessboard and a ChArUco board,
/// these are the inner corners row by row from the upper left. For an AprilGrid, they are TL, TR, BR, BL of
/// each tag; tags are ordered as in Kalibr, row by row from the lower left to the right and up. O(corners).
[[nodiscard]] std::vector<Eigen::Vector2d> board_corners(const CalibrationBoard& board);

/// The markers of a ChArUco board (row by row from the top, as in OpenCV) or an AprilGrid; empty for a
/// chessboard.
[[nodiscard]] std::vector<BoardMarker> board_markers(const CalibrationBoard& board);

/// Whether the square in this column and row (from the upper left) of a chessboard or ChArUco board is black.
[[nodiscard]] bool is_black_square(const CalibrationBoard& board, int column, int row);

}  // namespace waymark
