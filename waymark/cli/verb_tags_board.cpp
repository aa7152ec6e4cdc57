#include <memory>

#include <CLI/App.hpp>
#include <nlohmann/json.hpp>

#include "waymark/cli/console_control.hpp"
#include "waymark/cli/failure.hpp"
#include "waymark/cli/tags_board_flags.hpp"
#include "waymark/cli/verb.hpp"
#include "waymark/jobs/json_line.hpp"
#include "waymark/jobs/tag_prints.hpp"
#include "waymark/jobs/write_pages.hpp"

namespace waymark::cli {
namespace {

ExitCode draw_squares(const BoardFlags& args, Console& console) {
  const auto planned = args.plan_squares();
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

ExitCode draw(const BoardFlags& args, Console& console) {
  if (const Status effective = args.check_style(); !effective) return fail_usage(effective.error(), console);
  if (args.squares()) return draw_squares(args, console);
  const auto planned = args.plan();
  if (!planned) return fail_usage(planned.error(), console);
  PageFiles files = args.paper.files(planned->format);
  files.target = planned->kalibr_target;
  const WrittenPages written = write_pages({plot::draw_board(planned->layout)}, files, control_from(console));
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
  const auto args = std::make_shared<BoardFlags>(app);
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
