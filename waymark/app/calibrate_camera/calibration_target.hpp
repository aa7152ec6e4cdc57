#pragma once

#include <optional>
#include <string>
#include <vector>

#include "waymark/app/common/field_refusals.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/mapping/camera/target_mark.hpp"
#include "waymark/media/board_finder.hpp"
#include "waymark/tags/tag_finder.hpp"

namespace waymark {

/// Description of a calibration target.
struct TargetOptions {
  std::string kind = "tags";  ///< "tags", or a name known to board_kind()
  int columns = 0;            ///< number of tags per row or, for a chessboard, of squares
  int rows = 0;
  double tag_size_m = 0;  ///< used for tags and AprilGrids
  double spacing = 0.3;   ///< gap between two tags, as a fraction of the tag size
  int first_id = 0;       ///< ID of the lower left tag, or of the first marker
  double square_size_m = 0;
  double marker_size_m = 0;
  std::string dictionary = "4x4_50";
  bool legacy_pattern = false;
  std::string map{};  ///< map file with known tag poses, used instead of a board

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    fields_of_board(self, visit);
    visit(self.map, JobField("map FILE", "Map with accurately known tag poses, to use instead of a board"));
  }

  /// All fields except `map`.
  template <class Self, class Visitor>
  static void fields_of_board(Self& self, Visitor&& visit) {
    visit(self.kind, JobField("target NAME",
                              "Calibration target: tags (`waymark tags board style=separate`), "
                              "chessboard, charuco or aprilgrid (from Kalibr)")
                         .one_of("tags,chessboard,charuco,aprilgrid"));
    visit(self.columns,
          JobField("cols INTEGER",
                   "Tags per row of the board; for a chessboard or ChArUco board, squares (not corners)"));
    visit(self.rows, JobField("rows INTEGER",
                              "Tags per column of the board; for a chessboard or ChArUco board, squares "
                              "(not corners)"));
    visit(self.tag_size_m,
          JobField("tag_size_m NUMBER", "Side of the black square of a tag, measured on the print"));
    visit(self.spacing, JobField("spacing NUMBER", "Gap between two tags, as a fraction of their size"));
    visit(
        self.first_id,
        JobField("first_id INTEGER", "Id of the lower left tag, or of the first marker").usually("0").less());
    visit(self.square_size_m,
          JobField("square_size_m NUMBER",
                   "Side of a square of a chessboard or ChArUco board, measured on the print"));
    visit(self.marker_size_m,
          JobField("marker_size_m NUMBER",
                   "Side of the black square of a ChArUco marker, measured on the print"));
    visit(self.dictionary,
          JobField("dictionary NAME",
                   "Marker dictionary of a ChArUco board, as named by OpenCV: 4x4_50, 5x5_1000"));
    visit(self.legacy_pattern, JobField("legacy_pattern",
                                        "ChArUco board as drawn by OpenCV before version 4.6; with an even "
                                        "number of rows, its upper left square is white")
                                   .less());
  }
};

/// Rejects fields that are given but have no effect on this kind of target.
void refuse_of_other_targets(const TargetOptions& options, FieldRefusals& refused);

/// A finder that detects nothing, for jobs that only read images and detect boards by other means.
[[nodiscard]] TagFinder no_tags();

/// The board, or `nullopt` for tags. Fails with InvalidArgument if options are invalid.
[[nodiscard]] Result<std::optional<CalibrationBoard>> board_of(const TargetOptions& options);

/// The target detected in one image.
struct SeenTarget {
  TargetMarks marks{};
  /// Ratio of marker side to square side, as observed in the image. Only set for ChArUco boards.
  std::optional<double> marker_share{};
};

/// A calibration target and its detector.
class CalibrationTarget {
 public:
  /// Reads the map, or loads the board finder. Fails with InvalidArgument if options are invalid.
  [[nodiscard]] static Result<CalibrationTarget> make(const TargetOptions& options);

  /// Tags with known poses. Empty for a board.
  [[nodiscard]] const TagMap& tags() const { return tags_; }
  [[nodiscard]] bool is_board() const { return board_.has_value(); }
  /// Kind of marks: "tags" or "corners".
  [[nodiscard]] const char* mark_kind() const { return is_board() ? "corners" : "tags"; }
  /// The marks in an image: board corners, or tags detected by `finder`.
  [[nodiscard]] Result<SeenTarget> find(const ImageView& image, const TagFinder& finder) const;
  /// Advice to give if no image shows the target, derived from one of the images. Slow.
  [[nodiscard]] std::string absence_advice(const ImageView& image) const;
  /// A warning if the given marker size for a ChArUco board is inconsistent with the images.
  [[nodiscard]] std::optional<std::string> marker_size_warning(std::vector<double> shares) const;

 private:
  CalibrationTarget() = default;

  TargetOptions options_{};
  TagMap tags_{};
  std::optional<CalibrationBoard> board_{};
  std::optional<BoardFinder> finder_{};
  std::vector<Eigen::Vector2d> places_m_{};  ///< corner positions on the board
};

}  // namespace waymark
