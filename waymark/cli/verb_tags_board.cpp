#include <algorithm>
#include <filesystem>
#include <memory>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <CLI/App.hpp>
#include <nlohmann/json.hpp>

#include "waymark/base/suggest.hpp"
#include "waymark/cli/console_control.hpp"
#include "waymark/cli/failure.hpp"
#include "waymark/cli/flags.hpp"
#include "waymark/cli/paper_flags.hpp"
#include "waymark/cli/verb.hpp"
#include "waymark/codecs/image_file.hpp"
#include "waymark/jobs/json_line.hpp"
#include "waymark/jobs/staged_folder.hpp"
#include "waymark/jobs/tag_prints.hpp"
#include "waymark/jobs/write_pages.hpp"
#include "waymark/plot/board.hpp"
#include "waymark/plot/square_board.hpp"

namespace waymark::cli {
namespace {

struct BoardArgs {
  explicit BoardArgs(CLI::App& verb)
      : app(verb),
        settings(verb),
        paper(verb),
        board(verb, settings, "board", kFirstGroup),
        tag_size(name_tag_size(verb)) {}

  const CLI::App& app;
  Settings settings;
  std::string style = "aprilgrid";
  bool kalibr_yaml = false;
  CalibrationBoard squares{};  ///< of a chessboard or ChArUco board
  bool tiled = false;
  PaperFlags paper;
  OptionFlags<plot::BoardOptions> board;
  CLI::Option* tag_size;
};

struct Planned {
  plot::BoardLayout layout;
  plot::FileFormat format = plot::FileFormat::Pdf;
  std::string kalibr_target;  ///< empty when it was not asked for
};

/// Everything that can be wrong before anything is drawn.
Result<Planned> plan(const BoardArgs& args) {
  plot::BoardOptions options;
  if (const Status size = check_tag_size(*args.tag_size, args.board.given("tag_size_m")); !size)
    return tl::unexpected(size.error());
  if (const Status applied = args.board.apply(options); !applied) return tl::unexpected(applied.error());
  const auto format = args.paper.apply(options);
  if (!format) return tl::unexpected(format.error());
  const auto family = args.paper.family();
  if (!family) return tl::unexpected(family.error());
  const auto style = plot::parse_board_style(args.style);
  if (!style) return tl::unexpected(style.error());
  options.family = *family;
  options.style = *style;
  auto layout = plot::layout_board(options);
  if (!layout) return tl::unexpected(layout.error());
  Planned planned{std::move(*layout), *format, {}};
  if (args.kalibr_yaml) {
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

/// The style, and flags that have no effect on it.
Status check_style_flags(const BoardArgs& args, bool squares) {
  const std::vector<std::string> styles = {"aprilgrid", "separate", "chessboard", "charuco"};
  if (std::ranges::find(styles, args.style) == styles.end())
    return fail(ErrorCode::InvalidArgument, fmt::format("unknown board style '{}'", args.style.substr(0, 60)),
                {.key = "style"}, suggestion(args.style, styles));
  const char* hint = squares ? "Leave it out, or choose --style separate or aprilgrid."
                             : "Leave it out, or choose --style chessboard or charuco.";
  const std::string why = fmt::format("this has no effect on the style {}", args.style);
  Status status;
  for (const char* flag :
       {"--square-size-m", "--marker-size-m", "--dictionary", "--legacy-pattern", "--tiled"})
    if (status && !squares) status = refuse_flag(args.app, flag, why, hint);
  for (const char* flag : {"--tag-size-m", "--spacing", "--family", "--kalibr-yaml"})
    if (status && squares) status = refuse_flag(args.app, flag, why, hint);
  for (const char* flag : {"--marker-size-m", "--dictionary", "--legacy-pattern", "--first-id"})
    if (status && args.style == "chessboard") status = refuse_flag(args.app, flag, why, "Leave it out.");
  return status;
}

/// The layout of a chessboard or a ChArUco board, and the kind of its file.
Result<std::pair<plot::SquareBoardLayout, plot::FileFormat>> plan_squares(const BoardArgs& args) {
  // Not by args.board.apply(): it wants the size of a tag, which these boards have not.
  const auto given = [&](const char* flag, auto& value) {
    const CLI::Option* option = args.app.get_option(flag);
    if (option->count() > 0) value = option->as<std::remove_reference_t<decltype(value)>>();
  };
  plot::SquareBoardOptions options{.board = args.squares, .tiled = args.tiled};
  options.board.kind = *board_kind(args.style);
  options.board.columns = plot::BoardOptions().columns;
  options.board.rows = plot::BoardOptions().rows;
  given("--cols", options.board.columns);
  given("--rows", options.board.rows);
  given("--first-id", options.board.first_id);
  given("--margin-m", options.margin_m);
  const auto format = args.paper.apply(options);
  if (!format) return tl::unexpected(format.error());
  if (const Status usable = check_board(options.board); !usable) return tl::unexpected(usable.error());
  auto markers = printed_markers(options.board);
  if (!markers) return tl::unexpected(markers.error());
  options.markers = *std::move(markers);
  auto layout = plot::layout_square_board(options);
  if (!layout) return tl::unexpected(layout.error());
  return std::pair(*std::move(layout), *format);
}

ExitCode draw_squares(const BoardArgs& args, Console& console) {
  const auto planned = plan_squares(args);
  if (!planned) {
    const ErrorCode code = planned.error().code;
    return code == ErrorCode::NotFound || code == ErrorCode::Unsupported  // the module
               ? console.failed(planned.error(), ExitCode::SomeFailed)
               : fail_usage(planned.error(), console);
  }
  const auto& [layout, format] = *planned;
  const WrittenPages written =
      write_pages(plot::draw_square_board(layout), args.paper.files(format), control_from(console));
  if (args.paper.json) console.print(json_line(to_json(layout, written.files)));
  if (!written.status) return fail_writing(written.status.error(), console);
  if (!args.paper.json) console.print(to_text(layout, written.files));
  console.say(kPrintReminder);
  return ExitCode::Ok;
}

/// The target file must not replace another one.
Status check_target(const Planned& planned, const BoardArgs& args) {
  if (planned.kalibr_target.empty()) return {};
  return check_new_file(std::filesystem::path(args.paper.output).replace_extension(".yaml"),
                        args.paper.force);
}

/// board.yaml beside board.pdf.
void write_target(const Planned& planned, WrittenPages& written) {
  if (planned.kalibr_target.empty() || !written.status) return;
  const std::string path = std::filesystem::path(written.files.front()).replace_extension(".yaml").string();
  const std::vector<std::uint8_t> bytes(planned.kalibr_target.begin(), planned.kalibr_target.end());
  written.status = write_bytes(path, bytes);
  if (written.status) written.files.push_back(path);
}

ExitCode draw(const BoardArgs& args, Console& console) {
  const bool squares = args.style == "chessboard" || args.style == "charuco";
  if (const Status effective = check_style_flags(args, squares); !effective)
    return fail_usage(effective.error(), console);
  if (squares) return draw_squares(args, console);
  const auto planned = plan(args);
  if (!planned) return fail_usage(planned.error(), console);
  if (const Status free = check_target(*planned, args); !free) return fail_writing(free.error(), console);
  WrittenPages written = write_pages({plot::draw_board(planned->layout)}, args.paper.files(planned->format),
                                     control_from(console));
  write_target(*planned, written);
  if (args.paper.json) console.print(json_line(to_json(planned->layout, written.files)));
  if (!written.status) return fail_writing(written.status.error(), console);
  if (!args.paper.json) console.print(to_text(planned->layout, written.files));
  if (planned->layout.options.style == plot::BoardStyle::AprilGrid) {
    console.say(
        "Kalibr reads this board; `waymark detect` and AprilTag 3 do not, they want --style separate.");
  }
  console.say(kPrintReminder);
  return ExitCode::Ok;
}

Run prepare_tags_board(CLI::App& app) {
  const auto args = std::make_shared<BoardArgs>(app);
  add_option(
      app, "--style NAME", args->style,
      "Style of the board: aprilgrid (Kalibr's: black squares touch the corners of the tags, border of two "
      "cells), separate (single tags, as AprilTag 3 and `waymark detect` read them), chessboard, or charuco "
      "(OpenCV's: a marker in each white square)",
      kShown);
  add_flag(app, "--kalibr-yaml", args->kalibr_yaml,
           "Also write the target file for Kalibr beside the board (.yaml)", kMore);
  add_option(app, "--square-size-m NUMBER", args->squares.size_m,
             "Side of a square of a chessboard or ChArUco board");
  add_option(app, "--marker-size-m NUMBER", args->squares.marker_m,
             "Side of the black square of a ChArUco board's marker");
  add_option(app, "--dictionary NAME", args->squares.dictionary,
             "Markers of a ChArUco board: OpenCV's name of their dictionary, such as 4x4_50 or 5x5_1000",
             kShown, kMore);
  add_flag(
      app, "--legacy-pattern", args->squares.legacy_pattern,
      "A ChArUco board as OpenCV drew it before 4.6: with an even number of rows its upper left square is "
      "white",
      kMore);
  add_flag(app, "--tiled", args->tiled,
           "Spread a chessboard or ChArUco board over as many pages as it needs, to be cut and joined");
  return [args](Console& console) { return draw(*args, console); };
}

}  // namespace

Verb tags_board_verb() {
  return {
      .name = "board",
      .sentence = "Draw a calibration board to print, in true size",
      .help =
          R"(Numbers run row by row from the lower left tag to the right, then up, as Kalibr counts; its origin is
the lower left corner of the first tag, x right, y up. Print at 100 %, without "fit to page", measure
the ruler on the page, and mount the board on a flat, stiff plate. docs/howto/print-tags.md says more.
Of a chessboard and a ChArUco board --cols and --rows count squares.

Exit code: 0 written, 1 a file could not be written or is there already, 2 wrong usage or a board that does not fit.

Examples:
  waymark tags board --cols 6 --rows 6 --tag-size-m 0.024 --spacing 0.3 --paper A4 -o board.pdf
  waymark tags board --tag-size-m 0.03 --paper A3 --kalibr-yaml -o april.pdf
  waymark tags board --style separate --tag-size-m 0.024 -o separate.pdf
  waymark tags board --style charuco --cols 8 --rows 11 --square-size-m 0.02 --marker-size-m 0.015 -o charuco.pdf
  waymark tags board --style chessboard --cols 12 --rows 9 --square-size-m 0.05 --tiled -o chessboard.pdf
)",
      .prepare = prepare_tags_board,
      .verbs = {}};
}

}  // namespace waymark::cli
