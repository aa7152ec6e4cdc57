#pragma once

#include <string>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/families/family.hpp"
#include "waymark/plot/tag_sheet.hpp"

namespace waymark::plot {

/// The two styles of a board of tags.
enum class BoardStyle {
  /// As Kalibr prints and reads it (wiki of github.com/ethz-asl/kalibr, "Calibration targets"): a black
  /// border of two cells, and black squares that touch the corners of the tags. Every tag corner is therefore
  /// a saddle point. AprilTag 3 does not detect such tags, because the squares join the borders and its
  /// border has one cell.
  AprilGrid,
  /// Tags as AprilTag 3 detects them, with white gaps between them.
  Separate,
};

/// "aprilgrid" or "separate". Error: InvalidArgument with a suggestion.
[[nodiscard]] Result<BoardStyle> parse_board_style(std::string_view text);
[[nodiscard]] std::string_view to_string(BoardStyle style);

/// A calibration board. Numbers run from first_id row by row, from the lower left tag to the right and then
/// up, as in Kalibr. In its GridCalibrationTargetAprilgrid the origin is the lower left corner of tag 0, x
/// right, y up.
struct BoardOptions {
  int columns = 6;
  int rows = 6;
  double tag_size_m = 0.0;
  double spacing = 0.3;
  int first_id = 0;
  double margin_m = 0.005;
  FamilyId family = FamilyId::Tag36h11;
  BoardStyle style = BoardStyle::AprilGrid;
  Paper paper = {"A4", 210, 297};
  Orientation orientation = Orientation::Auto;

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.columns,
          Field{"cols",
                "Number of tags in a row; for a chessboard or ChArUco board the squares, not their corners.",
                1, 100});
    visit(
        self.rows,
        Field{"rows",
              "Number of tags in a column; for a chessboard or ChArUco board the squares, not their corners.",
              1, 100});
    visit(self.tag_size_m, Field{"tag_size_m", "Side of the black square of a tag, in metres.", 0.001, 5});
    visit(self.spacing, Field{"spacing", "Gap between two tags, as a fraction of their size.", 0.01, 1});
    visit(
        self.first_id,
        Field{"first_id", "Id of the lower left tag, or of the first marker of a ChArUco board.", 0, 100000});
    visit(
        self.margin_m,
        Field{"margin_m", "Width of the paper's edge that the printer cannot print on, in metres.", 0, 0.1});
  }
};

/// A board on its page, in millimetres.
struct BoardLayout {
  BoardOptions options;
  Paper paper;  ///< in its orientation
  Box board;    ///< tags and the gap around them
  Box caption;  ///< below the board: dimension arrows and description
  Footer footer;
  std::vector<PlacedTag> tags;  ///< by number; `cells` is the drawn area, `tile` and `caption` are empty
};

/// Pure. Errors: InvalidArgument for an invalid size, more tags than the family has, or a gap too narrow to
/// separate neighbours. Also for an AprilGrid of a family without an outer black border, and for a board that
/// does not fit; its hint contains the largest size that fits.
[[nodiscard]] Result<BoardLayout> layout_board(const BoardOptions& options);

/// The drawn page.
[[nodiscard]] Drawing draw_board(const BoardLayout& layout);

/// The target file of Kalibr for this board (keys target_type, tagCols, tagRows, tagSize [m], tagSpacing).
/// Error: Unsupported for boards that Kalibr does not read: a style other than AprilGrid, a family other than
/// tag36h11, or numbers that do not start at 0.
[[nodiscard]] Result<std::string> kalibr_target(const BoardOptions& options);

}  // namespace waymark::plot
