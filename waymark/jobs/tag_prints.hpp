#pragma once

#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "waymark/plot/board.hpp"
#include "waymark/plot/sheet_layout.hpp"
#include "waymark/plot/square_board.hpp"

/// What was drawn of a board or a sheet of tags, and the files it was written to.
namespace waymark {

/// The markers of a ChArUco board as they are printed, in the order of board_markers(); of a chessboard none.
/// Loads OpenCV, which has the dictionaries.
[[nodiscard]] Result<std::vector<plot::Cells>> printed_markers(const CalibrationBoard& board);

/// A chessboard or a ChArUco board with its markers on its pages. Errors: those of check_board(),
/// printed_markers() and layout_square_board().
[[nodiscard]] Result<plot::SquareBoardLayout> plan_square_board(plot::SquareBoardOptions options);

/// Fails on a style that is neither one of tags (plot::BoardStyle) nor of squares (BoardKind).
[[nodiscard]] Status check_board_style(const std::string& style);

/// A board of tags on its page, and what Kalibr reads of it.
struct PlannedBoard {
  plot::BoardLayout layout;
  std::string kalibr_target;  ///< empty when it was not asked for
};
/// Errors: those of layout_board(); of kalibr_target() with the key --kalibr-yaml.
[[nodiscard]] Result<PlannedBoard> plan_board(const plot::BoardOptions& options, bool kalibr);

[[nodiscard]] std::string to_text(const plot::BoardLayout& layout, const std::vector<std::string>& files);
[[nodiscard]] nlohmann::ordered_json to_json(const plot::BoardLayout& layout,
                                             const std::vector<std::string>& files);
[[nodiscard]] std::string to_text(const plot::SheetLayout& layout, const std::vector<std::string>& files);
[[nodiscard]] nlohmann::ordered_json to_json(const plot::SheetLayout& layout,
                                             const std::vector<std::string>& files);
[[nodiscard]] std::string to_text(const plot::SquareBoardLayout& layout,
                                  const std::vector<std::string>& files);
[[nodiscard]] nlohmann::ordered_json to_json(const plot::SquareBoardLayout& layout,
                                             const std::vector<std::string>& files);

}  // namespace waymark
