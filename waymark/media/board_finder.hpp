#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/image/image.hpp"
#include "waymark/samples/calibration_board.hpp"

namespace waymark {

/// A marker from a dictionary: the cells within its black border, row by row from the top left; true means
/// black.
struct MarkerCells {
  int width = 0;
  std::vector<bool> black{};
};

/// The corners of a board found in one image.
struct FoundBoard {
  std::vector<BoardCorner> corners{};  ///< ordered by number; empty if no board was found
  /// For a ChArUco board, the side of its markers divided by the side of its squares, as measured in the
  /// image.
  std::optional<double> marker_share{};
};

/// Finds calibration boards and their markers using OpenCV (the module libwaymark-boards.so of
/// `media/opencv`).
class BoardFinder {
 public:
  /// Loads the module. Fails (NotFound, Unsupported) if it or OpenCV is not installed; the hint names the
  /// packages.
  [[nodiscard]] static Result<BoardFinder> load();

  /// The corners of a board in an image. Fails (InvalidArgument) on an invalid board (check_board()), an
  /// unknown dictionary or one with too few markers. Chessboards are found with the method of Duda and Frese,
  /// "Accurate Detection and Localization of Checkerboard Corners for Calibration" (BMVC 2018). Markers are
  /// found with the method of Garrido-Jurado and others, "Automatic generation and detection of highly
  /// reliable fiducial markers under occlusion" (2014), and corners between markers with cornerSubPix.
  [[nodiscard]] Result<FoundBoard> find(const ImageView& image, const CalibrationBoard& board) const;
  /// The cells of a printed marker. Fails (InvalidArgument) on an unknown dictionary or number.
  [[nodiscard]] Result<MarkerCells> marker(const std::string& dictionary, int number) const;

  /// Identifies the dictionary of the markers in an image of any board. Returns the smallest dictionary that
  /// contains all of them ("5x5_100"), or "aprilgrid" for tag36h11 tags with a two-cell border. Empty unless
  /// at least four markers of some dictionary are found. Slow, because it tries all dictionaries.
  [[nodiscard]] Result<std::string> name_markers(const ImageView& image) const;

  /// The module's functions, for use by the module only.
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
