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
