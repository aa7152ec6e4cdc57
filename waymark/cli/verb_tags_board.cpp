#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <CLI/App.hpp>
#include <nlohmann/json.hpp>

#include "waymark/cli/console_control.hpp"
#include "waymark/cli/failure.hpp"
#include "waymark/cli/paper_flags.hpp"
#include "waymark/cli/verb.hpp"
#include "waymark/codecs/image_file.hpp"
#include "waymark/jobs/json_line.hpp"
#include "waymark/jobs/tag_prints.hpp"
#include "waymark/jobs/write_pages.hpp"
#include "waymark/plot/board.hpp"

namespace waymark::cli {
namespace {

struct BoardArgs {
  explicit BoardArgs(CLI::App& app)
      : settings(app), paper(app), board(app, settings, "board", kFirstGroup), tag_size(name_tag_size(app)) {}

  Settings settings;
  std::string style = "aprilgrid";
  bool kalibr_yaml = false;
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

/// board.yaml beside board.pdf.
void write_target(const Planned& planned, WrittenPages& written) {
  if (planned.kalibr_target.empty() || !written.status) return;
  const std::string path = std::filesystem::path(written.files.front()).replace_extension(".yaml").string();
  const std::vector<std::uint8_t> bytes(planned.kalibr_target.begin(), planned.kalibr_target.end());
  written.status = write_bytes(path, bytes);
  if (written.status) written.files.push_back(path);
}

ExitCode draw(const BoardArgs& args, Console& console) {
  const auto planned = plan(args);
  if (!planned) return fail_usage(planned.error(), console);
  WrittenPages written = write_pages({plot::draw_board(planned->layout)}, planned->format, args.paper.output,
                                     args.paper.dpi, control_from(console));
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
  app.add_option(
         "--style", args->style,
         "Style of the board: aprilgrid (Kalibr's: black squares touch the corners of the tags, border of "
         "two cells) or separate (single tags, as AprilTag 3 and `waymark detect` read them)")
      ->capture_default_str()
      ->type_name("NAME");
  app.add_flag("--kalibr-yaml", args->kalibr_yaml,
               "Also write the target file for Kalibr beside the board (.yaml)");
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

Exit code: 0 written, 1 a file could not be written, 2 wrong usage or a board that does not fit.

Examples:
  waymark tags board --cols 6 --rows 6 --tag-size-m 0.024 --spacing 0.3 --paper A4 -o board.pdf
  waymark tags board --tag-size-m 0.03 --paper A3 --kalibr-yaml -o april.pdf
  waymark tags board --style separate --tag-size-m 0.024 -o separate.pdf
)",
      .prepare = prepare_tags_board,
      .verbs = {}};
}

}  // namespace waymark::cli
