#pragma once

#include <string>
#include <utility>

#include "waymark/base/error.hpp"
#include "waymark/cli/flags.hpp"
#include "waymark/cli/paper_flags.hpp"
#include "waymark/plot/board.hpp"
#include "waymark/plot/square_board.hpp"
#include "waymark/samples/calibration_board.hpp"

namespace waymark::cli {

/// A board of tags, as it will be drawn.
struct PlannedBoard {
  plot::BoardLayout layout;
  plot::FileFormat format = plot::FileFormat::Pdf;
  std::string kalibr_target;  ///< empty when it was not asked for
};

/// The flags of a calibration board.
struct BoardFlags {
  explicit BoardFlags(CLI::App& verb);

  /// Whether it is made of squares: a chessboard or a ChArUco board.
  [[nodiscard]] bool squares() const { return style == "chessboard" || style == "charuco"; }
  /// Fails for an unknown style, and for flags that have no effect on it.
  [[nodiscard]] Status check_style() const;
  /// Everything that can be wrong with a board of tags, before anything is drawn.
  [[nodiscard]] Result<PlannedBoard> plan() const;
  /// The layout of a chessboard or a ChArUco board, and the kind of its file.
  [[nodiscard]] Result<std::pair<plot::SquareBoardLayout, plot::FileFormat>> plan_squares() const;

  const CLI::App& app;
  Settings settings;
  std::string style = "aprilgrid";
  bool kalibr_yaml = false;
  CalibrationBoard board_of_squares{};  ///< of a chessboard or ChArUco board
  bool tiled = false;
  PaperFlags paper;
  OptionFlags<plot::BoardOptions> board;
  CLI::Option* tag_size;
};

}  // namespace waymark::cli
