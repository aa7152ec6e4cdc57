#pragma once

#include <string>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/plot/drawing.hpp"
#include "waymark/plot/tag_outline.hpp"
#include "waymark/plot/tag_sheet.hpp"
#include "waymark/samples/calibration_board.hpp"

namespace waymark::plot {

/// A chessboard or a ChArUco board for printing.
struct SquareBoardOptions {
  CalibrationBoard board{};
  /// for ChArUco, in the order of board_markers(), each with its one-cell black border
  std::vector<Cells> markers{};
  Paper paper = {"A4", 210, 297};
  Orientation orientation = Orientation::Auto;
  double margin_m = 0.005;
  bool tiled = false;  ///< spreads a board larger than the paper over several pages
};

/// The part of a board on one page, made of whole squares; columns and rows are counted from the upper left.
struct SquareBoardPage {
  int first_column = 0;
  int first_row = 0;
  int columns = 0;
  int rows = 0;
  Box area;  ///< position of these squares on the page
};

/// A board laid out on its pages, row by row, in millimetres.
struct SquareBoardLayout {
  SquareBoardOptions options;
  Paper paper;  ///< in the orientation used
  Footer footer;
  int across = 1;  ///< number of pages per row
  int down = 1;
  std::vector<SquareBoardPage> pages;
};

/// Pure. Errors: InvalidArgument from check_board(), for an AprilGrid, a wrong number of markers, or a square
/// larger than the paper. Also if the board does not fit on the paper without tiling; the hint contains the
/// largest size that fits.
[[nodiscard]] Result<SquareBoardLayout> layout_square_board(const SquareBoardOptions& options);

/// Draws the pages. An edge that joins another page is a dashed line to cut along, with a cross at each end.
[[nodiscard]] std::vector<Drawing> draw_square_board(const SquareBoardLayout& layout);

}  // namespace waymark::plot
