#include "waymark/cli/tags_board_flags.hpp"

#include <algorithm>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <CLI/App.hpp>

#include "waymark/base/suggest.hpp"
#include "waymark/cli/failure.hpp"
#include "waymark/jobs/tag_prints.hpp"

namespace waymark::cli {

BoardFlags::BoardFlags(CLI::App& verb)
    : app(verb),
      settings(verb),
      paper(verb),
      board(verb, settings, "board", kFirstGroup),
      tag_size(name_tag_size(verb)) {
  add_option(
      verb, "--style NAME", style,
      "Style of the board: aprilgrid (Kalibr's: black squares touch the corners of the tags, border of two "
      "cells), separate (single tags, as AprilTag 3 and `waymark detect` read them), chessboard, or charuco "
      "(OpenCV's: a marker in each white square)",
      kShown);
  add_flag(verb, "--kalibr-yaml", kalibr_yaml,
           "Also write the target file for Kalibr beside the board (.yaml)", kMore);
  add_option(verb, "--square-size-m NUMBER", board_of_squares.size_m,
             "Side of a square of a chessboard or ChArUco board");
  add_option(verb, "--marker-size-m NUMBER", board_of_squares.marker_m,
             "Side of the black square of a ChArUco board's marker");
  add_option(verb, "--dictionary NAME", board_of_squares.dictionary,
             "Markers of a ChArUco board: OpenCV's name of their dictionary, such as 4x4_50 or 5x5_1000",
             kShown, kMore);
  add_flag(
      verb, "--legacy-pattern", board_of_squares.legacy_pattern,
      "A ChArUco board as OpenCV drew it before 4.6: with an even number of rows its upper left square is "
      "white",
      kMore);
  add_flag(verb, "--tiled", tiled,
           "Spread a chessboard or ChArUco board over as many pages as it needs, to be cut and joined");
}

Result<PlannedBoard> BoardFlags::plan() const {
  plot::BoardOptions options;
  if (const Status size = check_tag_size(*tag_size, board.given("tag_size_m")); !size)
    return tl::unexpected(size.error());
  if (const Status applied = board.apply(options); !applied) return tl::unexpected(applied.error());
  const auto format = paper.apply(options);
  if (!format) return tl::unexpected(format.error());
  const auto family = paper.family();
  if (!family) return tl::unexpected(family.error());
  const auto known_style = plot::parse_board_style(style);
  if (!known_style) return tl::unexpected(known_style.error());
  options.family = *family;
  options.style = *known_style;
  auto layout = plot::layout_board(options);
  if (!layout) return tl::unexpected(layout.error());
  PlannedBoard planned{std::move(*layout), *format, {}};
  if (kalibr_yaml) {
    auto target = plot::kalibr_target(options);
    if (!target) {
      Error error = target.error();
      error.place.key = "--kalibr-yaml";
      return tl::unexpected(std::move(error));
    }
    planned.kalibr_target = std::move(*target);
  }
  return planned;
}

Status BoardFlags::check_style() const {
  const std::vector<std::string> styles = {"aprilgrid", "separate", "chessboard", "charuco"};
  if (std::ranges::find(styles, style) == styles.end())
    return fail(ErrorCode::InvalidArgument, fmt::format("unknown board style '{}'", style.substr(0, 60)),
                {.key = "style"}, suggestion(style, styles));
  const char* hint = squares() ? "Leave it out, or choose --style separate or aprilgrid."
                               : "Leave it out, or choose --style chessboard or charuco.";
  const std::string why = fmt::format("this has no effect on the style {}", style);
  Status status;
  for (const char* flag :
       {"--square-size-m", "--marker-size-m", "--dictionary", "--legacy-pattern", "--tiled"})
    if (status && !squares()) status = refuse_flag(app, flag, why, hint);
  for (const char* flag : {"--tag-size-m", "--spacing", "--family", "--kalibr-yaml"})
    if (status && squares()) status = refuse_flag(app, flag, why, hint);
  for (const char* flag : {"--marker-size-m", "--dictionary", "--legacy-pattern", "--first-id"})
    if (status && style == "chessboard") status = refuse_flag(app, flag, why, "Leave it out.");
  return status;
}

Result<std::pair<plot::SquareBoardLayout, plot::FileFormat>> BoardFlags::plan_squares() const {
  // Not by board.apply(): it wants the size of a tag, which these boards have not.
  const auto given = [this](const char* flag, auto& value) {
    const CLI::Option* option = app.get_option(flag);
    if (option->count() > 0) value = option->as<std::remove_reference_t<decltype(value)>>();
  };
  plot::SquareBoardOptions options{.board = board_of_squares, .tiled = tiled};
  options.board.kind = *board_kind(style);
  options.board.columns = plot::BoardOptions().columns;
  options.board.rows = plot::BoardOptions().rows;
  given("--cols", options.board.columns);
  given("--rows", options.board.rows);
  given("--first-id", options.board.first_id);
  given("--margin-m", options.margin_m);
  const auto format = paper.apply(options);
  if (!format) return tl::unexpected(format.error());
  auto layout = plan_square_board(options);
  if (!layout) return tl::unexpected(layout.error());
  return std::pair(*std::move(layout), *format);
}

}  // namespace waymark::cli
