#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/image/image.hpp"
#include "waymark/samples/calibration_board.hpp"

namespace waymark {

/// A marker of a dictionary: the cells within its black border, row by row from the top left; true is black.
struct MarkerCells {
  int width = 0;
  std::vector<bool> black{};
};

/// A board as one picture shows it.
struct FoundBoard {
  std::vector<BoardCorner> corners{};  ///< by number; empty: there is no board
  /// Of a ChArUco board: the side of its markers over that of their squares, as the picture shows them.
  std::optional<double> marker_share{};
};

/// Calibration boards and their markers, by OpenCV (the module libwaymark-boards.so of `media/opencv`).
class BoardFinder {
 public:
  /// Loads the module. Fails (NotFound, Unsupported) where it or OpenCV is not installed, in words that name
  /// the packages.
  [[nodiscard]] static Result<BoardFinder> load();

  /// The corners of a board in a picture. Fails (InvalidArgument)
  /// on a board that is none (check_board()), an unknown dictionary or one with too few markers. A chessboard
  /// is found by Duda and Frese, "Accurate Detection and Localization of Checkerboard Corners for
  /// Calibration" (BMVC 2018), markers by Garrido-Jurado and others, "Automatic generation and detection of
  /// highly reliable fiducial markers under occlusion" (2014), corners between markers by cornerSubPix.
  [[nodiscard]] Result<FoundBoard> find(const ImageView& image, const CalibrationBoard& board) const;
  /// A marker as it is printed. Fails (InvalidArgument) on an unknown dictionary or number.
  [[nodiscard]] Result<MarkerCells> marker(const std::string& dictionary, int number) const;

  /// Which markers a picture shows, whatever board was expected: the smallest dictionary that holds all of
  /// them ("5x5_100"), "aprilgrid" for tags of tag36h11 with a border of two cells; empty: not four of any.
  /// Slow: tries all.
  [[nodiscard]] Result<std::string> name_markers(const ImageView& image) const;

  /// What the module gives; for the module only.
  struct Functions {
    void (*find)(const ImageView&, const CalibrationBoard&, FoundBoard&, Error&) = nullptr;
    void (*marker)(const std::string&, int, MarkerCells&, Error&) = nullptr;
    void (*name_markers)(const ImageView&, std::string&, Error&) = nullptr;
  };

 private:
  explicit BoardFinder(const Functions& functions) : functions_(functions) {}

  Functions functions_;
};

inline constexpr const char* kBoardFinderSymbol = "waymark_board_finder";

}  // namespace waymark
