#pragma once

#include <string>

#include "waymark/base/error.hpp"
#include "waymark/image/image.hpp"
#include "waymark/media/board_finder.hpp"

namespace waymark {

/// Implements BoardFinder::name_markers().
[[nodiscard]] std::string name_markers(const ImageView& image);

/// Implements BoardFinder::find() and marker(); requires a board that check_board() accepts.
[[nodiscard]] Result<FoundBoard> find_board(const ImageView& image, const CalibrationBoard& board);
[[nodiscard]] Result<MarkerCells> marker_cells(const std::string& dictionary, int number);

}  // namespace waymark
