#include <type_traits>

#include "waymark/app/cli/paper_flags.hpp"
#include "waymark/app/cli/parts.hpp"

namespace waymark::cli {
namespace {

struct BoardArgs : BoardRequest {
  explicit BoardArgs(CLI::App& verb)
      : settings(verb), paper(verb), board(settings, "board", kFirstGroup), tag_size(name_tag_size(verb)) {
    add_fields(verb, static_cast<BoardRequest&>(*this));
  }

  Settings settings;
  PaperFlags paper;
  OptionFlags<plot::BoardOptions> board;
  CLI::Option* tag_size;
};

/// Checks a board of tags before anything is drawn.
Result<PlannedBoard> plan(const BoardArgs& args) {
  plot::BoardOptions options;
  Status usable = check_tag_size(*args.tag_size, args.board.given("tag_size_m"));
  if (usable) usable = args.board.apply(options);
  if (usable) usable = args.paper.apply(options);
  if (!usable) return tl::unexpected(usable.error());
  const auto family = args.paper.family();
  if (!family) return tl::unexpected(family.error());
  const auto style = plot::parse_board_style(args.style);
  if (!style) return tl::unexpected(style.error());
  options.family = *family;
  options.style = *style;
  return plan_board(options, args.kalibr_yaml);
}

Result<plot::SquareBoardLayout> plan_squares(const BoardArgs& args) {
  // Does not use board.apply(), because it requires a tag size, which these boards do not have.
  const auto given = [&args](const char* flag, auto& value) {
    const CLI::Option* option = args.settings.app().get_option(flag);
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
  if (const Status usable = args.paper.apply(options); !usable) return tl::unexpected(usable.error());
  return plan_square_board(options);
}

ExitCode draw_squares(const BoardArgs& args, Console& console) {
  const auto layout = plan_squares(args);
  if (layout) return args.paper.write(*layout, plot::draw_square_board(*layout), console);
  const ErrorCode code = layout.error().code;
  return code == ErrorCode::NotFound || code == ErrorCode::Unsupported  // the OpenCV module is missing
             ? console.failed(layout.error(), ExitCode::SomeFailed)
             : fail_usage(layout.error(), console);
}

ExitCode draw(const BoardArgs& args, Console& console) {
  if (const Status effective = check_effects(args, given_on(args.settings.app())); !effective)
    return fail_usage(effective.error(), console);
  if (args.of_squares()) return draw_squares(args, console);
  const auto planned = plan(args);
  if (!planned) return fail_usage(planned.error(), console);
  const bool of_kalibr = planned->layout.options.style == plot::BoardStyle::AprilGrid;
  return args.paper.write(planned->layout, {plot::draw_board(planned->layout)}, console,
                          of_kalibr ? "Kalibr reads this board; `waymark detect` and AprilTag 3 need "
                                      "`style=separate`."
                                    : "",
                          planned->kalibr_target);
}

}  // namespace

Verb tags_board_verb() {
  return {
      .name = "board",
      .sentence = "Draw a calibration board to print, in true size",
      .help =
          R"(Ids increase from the lower left tag to the right, then row by row upwards, as in Kalibr. The origin is the
lower left corner of the first tag, x right, y up. Print at 100 %, without "fit to page", measure the ruler on the
page, and mount the board on a flat, stiff plate (docs/howto/print-tags.md). For a chessboard or a ChArUco board,
--cols and --rows count squares.
Exit code: 0 written, 1 a file exists or could not be written, 2 wrong usage or a board that does not fit.

Examples:
  waymark tags board --cols 6 --rows 6 --tag-size-m 0.024 --spacing 0.3 --paper A4 -o board.pdf
  waymark tags board --tag-size-m 0.03 --paper A3 --kalibr-yaml -o april.pdf
  waymark tags board --style separate --tag-size-m 0.024 -o separate.pdf
  waymark tags board --style charuco --cols 8 --rows 11 --square-size-m 0.02 --marker-size-m 0.015 -o charuco.pdf
  waymark tags board --style chessboard --cols 12 --rows 9 --square-size-m 0.05 --tiled -o chessboard.pdf
)",
      .prepare = prepared(draw),
      .report = report_of_any<Printed<plot::BoardLayout>, Printed<plot::SquareBoardLayout>>};
}

}  // namespace waymark::cli
