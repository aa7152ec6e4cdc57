#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "waymark/app/common/field_refusals.hpp"
#include "waymark/app/common/job_control.hpp"
#include "waymark/app/common/report_fields.hpp"
#include "waymark/base/error.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/plot/render.hpp"
#include "waymark/plot/square_board.hpp"
#include "waymark/plot/tag_board.hpp"
#include "waymark/plot/tag_sheet.hpp"

/// Lays out printable pages with boards or sheets of tags, and writes their files.
namespace waymark {

/// The files written, and the error if writing stopped early.
struct WrittenPages {
  std::vector<std::string> files;
  Status status{};
};

/// The file name for one of several pages: "tags-07.png" is page 7 of 24 for "tags.png". The name of a single
/// page is unchanged.
[[nodiscard]] std::string page_path(const std::string& path, std::size_t page, std::size_t pages);

/// Where and how pages are written.
struct PageFiles {
  plot::FileFormat format = plot::FileFormat::Pdf;
  std::string path{};
  double dpi = 300;      ///< resolution of PNG files
  bool replace = false;  ///< whether to overwrite existing files; otherwise they cause an error (Unwritable),
                         ///< and nothing is written
  std::string target{};  ///< content of a .yaml file written next to the first page; not written if empty
};

/// Writes pages to a single PDF, or to one SVG or PNG file each. Stops at the first error, or if cancelled.
[[nodiscard]] WrittenPages write_pages(const std::vector<plot::Drawing>& pages, const PageFiles& to,
                                       const JobControl& control);

/// Paper and output files as requested by the user.
struct PageRequest {
  PageFiles files{};
  std::string family = "tag36h11";
  std::string paper = "A4";
  std::string orientation = "auto";

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.files.path,
          JobField("output FILE",
                   "File to write: .pdf, .svg or .png (several pages of .svg and .png get numbers)")
              .required());
    visit(self.family, JobField("family NAME", "Tag family"));
    visit(self.paper,
          JobField("paper NAME", "A6 to A0, Letter, Legal, Tabloid, or WIDTHxHEIGHT in millimetres"));
    visit(self.orientation,
          JobField("orientation NAME",
                   "Orientation of the page: auto (the one that fits more), portrait or landscape"));
    visit(self.files.dpi,
          JobField("dpi NUMBER", "Pixels per inch of .png, stored in the file. From 10 to 2400."));
    visit(self.files.replace, JobField("force", "Replace existing files").less());
  }
};
/// Sets the paper and the orientation of the page options. Fails also if the format of the output file is
/// unknown.
template <class Options>
[[nodiscard]] Status apply_paper(const PageRequest& request, Options& options) {
  const auto paper = plot::parse_paper(request.paper);
  if (!paper) return tl::unexpected(paper.error());
  const auto orientation = plot::parse_orientation(request.orientation);
  if (!orientation) return tl::unexpected(orientation.error());
  options.paper = *paper;
  options.orientation = *orientation;
  const auto format = plot::format_of(request.files.path);
  return format ? Status() : tl::unexpected(format.error());
}
/// The requested family; an error names the field.
[[nodiscard]] Result<FamilyId> requested_family(const PageRequest& request);

/// The markers printed on a ChArUco board, in the order of board_markers(); empty for a chessboard. Loads
/// OpenCV, which provides the dictionaries.
[[nodiscard]] Result<std::vector<plot::Cells>> printed_markers(const CalibrationBoard& board);

/// Lays out a chessboard, or a ChArUco board with its markers. Fails with the errors of check_board(),
/// printed_markers() and layout_square_board().
[[nodiscard]] Result<plot::SquareBoardLayout> plan_square_board(plot::SquareBoardOptions options);

/// A calibration board as requested by the user, without the options of tag boards.
struct BoardRequest {
  std::string style = "aprilgrid";
  bool kalibr_yaml = false;
  CalibrationBoard squares{};  ///< used for a chessboard or ChArUco board
  bool tiled = false;          ///< whether to distribute it over as many pages as it needs

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.style, JobField("style NAME",
                               "Style of the board: aprilgrid (for Kalibr, with black squares at the tag "
                               "corners), separate (for AprilTag 3 and `waymark detect`), chessboard, or "
                               "charuco (OpenCV's, with markers in white squares)"));
    visit(self.kalibr_yaml,
          JobField("kalibr_yaml", "Also write the target file for Kalibr next to the board (.yaml)").less());
    visit(self.squares.size_m,
          JobField("square_size_m NUMBER", "Side of a square of a chessboard or ChArUco board"));
    visit(self.squares.marker_m,
          JobField("marker_size_m NUMBER", "Side of the black square of a ChArUco board's marker"));
    visit(
        self.squares.dictionary,
        JobField("dictionary NAME",
                 "Markers of a ChArUco board: OpenCV's name of their dictionary, such as 4x4_50 or 5x5_1000")
            .less());
    visit(self.squares.legacy_pattern, JobField("legacy_pattern",
                                                "ChArUco pattern of OpenCV before 4.6: with an even number "
                                                "of rows the upper left square is white")
                                           .less());
    visit(
        self.tiled,
        JobField(
            "tiled",
            "Distribute a chessboard or ChArUco board over as many pages as it needs, to be cut and joined"));
  }

  /// Whether it is a chessboard or a ChArUco board.
  [[nodiscard]] bool of_squares() const { return style == "chessboard" || style == "charuco"; }
};

/// Fails if a style is neither a plot::BoardStyle (tags) nor a BoardKind (squares).
[[nodiscard]] Status check_board_style(const std::string& style);
/// The same, and fails if fields are set that have no effect on this style.
[[nodiscard]] Status check_effects(const BoardRequest& board, const GivenFields& given);

/// A board of tags on its page, and its target file for Kalibr.
struct PlannedBoard {
  plot::BoardLayout layout;
  std::string kalibr_target;  ///< text of the target file; empty if not requested
};
/// Fails with the errors of layout_board(), and with those of kalibr_target() under the key kalibr_yaml.
[[nodiscard]] Result<PlannedBoard> plan_board(const plot::BoardOptions& options, bool kalibr);

[[nodiscard]] std::string to_text(const plot::BoardLayout& layout, const std::vector<std::string>& files);
[[nodiscard]] std::string to_text(const plot::SheetLayout& layout, const std::vector<std::string>& files);
[[nodiscard]] std::string to_text(const plot::SquareBoardLayout& layout,
                                  const std::vector<std::string>& files);

/// A layout and the files written for it.
template <class Layout>
struct Printed {
  Layout layout{};
  std::vector<std::string> files{};
};
[[nodiscard]] ReportFields fields(const Printed<plot::BoardLayout>& board);
[[nodiscard]] ReportFields fields(const Printed<plot::SheetLayout>& sheet);
[[nodiscard]] ReportFields fields(const Printed<plot::SquareBoardLayout>& board);

}  // namespace waymark
