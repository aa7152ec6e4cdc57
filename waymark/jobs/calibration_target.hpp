#pragma once

#include <optional>
#include <string>
#include <vector>

#include "waymark/mapping/calibration/target_mark.hpp"
#include "waymark/media/board_finder.hpp"
#include "waymark/tags/tag_finder.hpp"

namespace waymark {

/// A calibration target as a user describes it.
struct TargetDescription {
  std::string kind = "tags";  ///< "tags", or a board_kind()
  int columns = 0;            ///< tags, or squares of a chessboard
  int rows = 0;
  double tag_size_m = 0;  ///< tags and AprilGrids
  double spacing = 0.3;   ///< gap between two tags, as a share of their size
  int first_id = 0;       ///< of the lower left tag, or the first marker
  double square_size_m = 0;
  double marker_size_m = 0;
  std::string dictionary = "4x4_50";
  bool legacy_pattern = false;
  std::string map{};  ///< instead of a board: a file of tags whose places are known
};

/// A finder that finds nothing: the pictures are only read, for what finds a board in them.
[[nodiscard]] TagFinder no_tags();

/// The board that a description names; nothing: tags. InvalidArgument: what it says makes no board.
[[nodiscard]] Result<std::optional<CalibrationBoard>> described_board(const TargetDescription& description);

/// A target as one picture shows it.
struct SeenTarget {
  TargetPicture marks{};
  /// Of a ChArUco board: the side of its markers over that of their squares, as the picture shows them.
  std::optional<double> marker_share{};
};

/// What a camera is calibrated on, and how it is found in a picture.
class CalibrationTarget {
 public:
  /// Reads a map and loads what finds a board. InvalidArgument: what the description says makes no target.
  [[nodiscard]] static Result<CalibrationTarget> make(const TargetDescription& description);

  /// Tags whose places are known; empty: a board.
  [[nodiscard]] const TagMap& tags() const { return tags_; }
  [[nodiscard]] bool is_board() const { return board_.has_value(); }
  /// What a mark is: "tags" or "corners".
  [[nodiscard]] const char* marks_word() const { return is_board() ? "corners" : "tags"; }
  /// The marks in a picture: the corners of the board, or the tags that `finder` finds.
  [[nodiscard]] Result<SeenTarget> find(const ImageView& image, const TagFinder& finder) const;
  /// What to try where pictures do not show the target, in words, by what one of them shows. Slow.
  [[nodiscard]] std::string words_of_absence(const ImageView& image) const;
  /// Words where the markers of a ChArUco board are not as large as was said, by what the pictures show.
  [[nodiscard]] std::optional<std::string> words_of_marker_size(std::vector<double> shares) const;

 private:
  CalibrationTarget() = default;

  TargetDescription description_{};
  TagMap tags_{};
  std::optional<CalibrationBoard> board_{};
  std::optional<BoardFinder> finder_{};
  std::vector<Eigen::Vector2d> places_m_{};  ///< of the board's corners
};

}  // namespace waymark
