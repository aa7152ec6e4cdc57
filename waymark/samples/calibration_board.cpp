#include "waymark/samples/calibration_board.hpp"

#include <cmath>
#include <utility>

#include <fmt/format.h>

namespace waymark {
namespace {

constexpr std::array<std::pair<BoardKind, std::string_view>, 3> kKinds = {
    {{BoardKind::Chessboard, "chessboard"},
     {BoardKind::Charuco, "charuco"},
     {BoardKind::AprilGrid, "aprilgrid"}}};

double pitch_of(const CalibrationBoard& board) {
  return board.kind == BoardKind::AprilGrid ? board.size_m * (1 + board.spacing) : board.size_m;
}

/// The centre of a square or tag; `row` is counted from the top.
Eigen::Vector2d middle_of(const CalibrationBoard& board, int column, int row) {
  return pitch_of(board) * Eigen::Vector2d(column - 0.5 * (board.columns - 1), row - 0.5 * (board.rows - 1));
}

bool is_length(double length_m) { return std::isfinite(length_m) && length_m > 0; }

}  // namespace

std::string_view to_string(BoardKind kind) {
  for (const auto& [candidate, name] : kKinds)
    if (candidate == kind) return name;
  return "";
}

std::optional<BoardKind> board_kind(std::string_view word) {
  for (const auto& [kind, name] : kKinds)
    if (name == word) return kind;
  return std::nullopt;
}

Status check_board(const CalibrationBoard& board) {
  const bool grid = board.kind == BoardKind::AprilGrid;
  constexpr int kMaxSide = 200;
  const int least = grid ? 1 : 3;
  const auto wrong = [](std::string message, const char* key, std::string hint) {
    return fail(ErrorCode::InvalidArgument, std::move(message), {.key = key}, std::move(hint));
  };
  if (board.columns < least || board.rows < least || board.columns > kMaxSide || board.rows > kMaxSide)
    return wrong(fmt::format("{} x {} {} are not a valid {}", board.columns, board.rows,
                             grid ? "tags" : "squares", to_string(board.kind)),
                 "cols", fmt::format("Set `cols` and `rows` to values from {} to {}.", least, kMaxSide));
  if (!is_length(board.size_m))
    return wrong(fmt::format("the side of a {} is missing", grid ? "tag" : "square"),
                 grid ? "tag_size_m" : "square_size_m", "Measure it on the print, in metres.");
  if (grid && !(board.spacing > 0 && board.spacing <= 1))
    return wrong(fmt::format("the spacing {} is not between 0 and 1", board.spacing), "spacing",
                 "Set it to the gap between two tags divided by their size.");
  if (board.kind == BoardKind::Charuco && board.marker_m == 0)
    return wrong("the side of a marker is missing", "marker_size_m",
                 "Measure the black square of a marker on the print, in metres.");
  if (board.kind == BoardKind::Charuco && !(is_length(board.marker_m) && board.marker_m < board.size_m))
    return wrong("the side of a marker must be between 0 and the side of its square", "marker_size_m",
                 "Measure the black square of a marker on the print, in metres.");
  if (board.first_id < 0) return wrong("the first id is negative", "first_id", "Ids start at 0.");
  return {};
}

std::vector<Eigen::Vector2d> board_corners(const CalibrationBoard& board) {
  std::vector<Eigen::Vector2d> corners;
  if (board.kind != BoardKind::AprilGrid) {
    const Eigen::Vector2d half = Eigen::Vector2d::Constant(0.5 * board.size_m);
    for (int row = 0; row + 1 < board.rows; ++row)
      for (int column = 0; column + 1 < board.columns; ++column)
        corners.emplace_back(middle_of(board, column, row) + half);
    return corners;
  }
  const double half = 0.5 * board.size_m;
  for (const BoardMarker& tag : board_markers(board))
    for (const auto& [x, y] : {std::pair(-half, -half), {half, -half}, {half, half}, {-half, half}})
      corners.emplace_back(tag.middle_m + Eigen::Vector2d(x, y));
  return corners;
}

std::vector<BoardMarker> board_markers(const CalibrationBoard& board) {
  std::vector<BoardMarker> markers;
  int id = board.first_id;
  if (board.kind == BoardKind::AprilGrid) {
    for (int row = board.rows - 1; row >= 0; --row)
      for (int column = 0; column < board.columns; ++column)
        markers.push_back({id++, middle_of(board, column, row), board.size_m});
  } else if (board.kind == BoardKind::Charuco) {
    for (int row = 0; row < board.rows; ++row)
      for (int column = 0; column < board.columns; ++column)
        if (!is_black_square(board, column, row))
          markers.push_back({id++, middle_of(board, column, row), board.marker_m});
  }
  return markers;
}

bool is_black_square(const CalibrationBoard& board, int column, int row) {
  const bool from_below = board.legacy_pattern && board.kind == BoardKind::Charuco;
  return (column + (from_below ? board.rows - 1 - row : row)) % 2 == 0;
}

}  // namespace waymark
