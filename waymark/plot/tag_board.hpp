#pragma once

#include <string>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/families/family.hpp"
#include "waymark/plot/tag_sheet.hpp"

namespace waymark::plot {

/// The two styles of tag board.
enum class BoardStyle {
  /// As printed and read by Kalibr (wiki of github.com/ethz-asl/kalibr, "Calibration targets"): tags with a
  /// two-cell black border, and black squares that touch their corners. Every tag corner is therefore a
  /// saddle point. AprilTag 3 does not detect such tags, because the squares connect the borders and AprilTag
  /// 3 expects a one-cell border.
  AprilGrid,
  /// Tags that AprilTag 3 can detect, with white gaps between them.
  Separate,
};

/// "aprilgrid" or "separate". Error: InvalidArgument with a suggestion.
[[nodiscard]] Result<BoardStyle> parse_board_style(std::string_view text);
[[nodiscard]] std::string_view to_string(BoardStyle style);

/// A calibration board. Numbers start at first_id in the lower left corner and increase to the right along
/// each row, then upwards, as in Kalibr. In Kalibr's GridCalibrationTargetAprilgrid, the origin is the lower
/// left corner of tag 0, with x to the right and y up.
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

/// A board laid out on its page, in millimetres.
struct BoardLayout {
  BoardOptions options;
  Paper paper;  ///< in the orientation used
  Box board;    ///< the tags and the gap around them
  Box caption;  ///< dimension arrows and description, below the board
  Footer footer;
  std::vector<PlacedTag> tags;  ///< sorted by number; `cells` is the drawn area, others are empty
};

/// Pure. Errors: InvalidArgument for an invalid size, more tags than the family has, or a gap too narrow to
/// separate neighbouring tags. Also for an AprilGrid made from a family without an outer black border. Also
/// if the board does not fit; the hint then contains the largest size that fits.
[[nodiscard]] Result<BoardLayout> layout_board(const BoardOptions& options);

/// Draws the page.
[[nodiscard]] Drawing draw_board(const BoardLayout& layout);

/// The Kalibr target file for this board (keys target_type, tagCols, tagRows, tagSize [m], tagSpacing).
/// Error: Unsupported for boards that Kalibr cannot read: a style other than AprilGrid, a family other than
/// tag36h11, or numbers that do not start at 0.
[[nodiscard]] Result<std::string> kalibr_target(const BoardOptions& options);

}  // namespace waymark::plot
