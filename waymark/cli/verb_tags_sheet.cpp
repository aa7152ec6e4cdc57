#include "waymark/cli/paper_flags.hpp"
#include "waymark/cli/parts.hpp"
#include "waymark/families/tag_numbers.hpp"
#include "waymark/jobs/tag_prints.hpp"
#include "waymark/jobs/write_pages.hpp"

namespace waymark::cli {
namespace {

struct SheetArgs {
  explicit SheetArgs(CLI::App& app)
      : settings(app), paper(app), sheet(app, settings, "sheet", kFirstGroup), tag_size(name_tag_size(app)) {
    add_option(app, "--ids LIST", ids, "Ids of the tags, for example 0-23 or 0-3,7,9", kRequired);
  }

  Settings settings;
  std::string ids;
  PaperFlags paper;
  OptionFlags<plot::SheetOptions> sheet;
  CLI::Option* tag_size;
};

struct Planned {
  plot::SheetLayout layout;
  plot::FileFormat format = plot::FileFormat::Pdf;
};

/// Everything that can be wrong before anything is drawn.
Result<Planned> plan(const SheetArgs& args) {
  plot::SheetOptions options;
  if (const Status size = check_tag_size(*args.tag_size, args.sheet.given("tag_size_m")); !size)
    return tl::unexpected(size.error());
  if (const Status applied = args.sheet.apply(options); !applied) return tl::unexpected(applied.error());
  const auto format = args.paper.apply(options);
  if (!format) return tl::unexpected(format.error());
  const auto family = args.paper.family();
  if (!family) return tl::unexpected(family.error());
  const auto numbers = parse_tag_numbers(*family, args.ids);
  if (!numbers) return tl::unexpected(numbers.error());
  auto layout = plot::layout_sheet(*family, *numbers, options);
  if (!layout) return tl::unexpected(layout.error());
  return Planned{std::move(*layout), *format};
}

ExitCode draw(const SheetArgs& args, Console& console) {
  const auto planned = plan(args);
  if (!planned) return fail_usage(planned.error(), console);
  const plot::SheetLayout& layout = planned->layout;
  const WrittenPages written =
      write_pages(plot::draw_sheet(layout), args.paper.files(planned->format), control_from(console));
  if (args.paper.json) console.print(json_line(to_json(layout, written.files)));
  if (!written.status) return fail_writing(written.status.error(), console);
  if (!args.paper.json) console.print(to_text(layout, written.files));
  console.say(kPrintReminder);
  return ExitCode::Ok;
}

}  // namespace

Verb tags_sheet_verb() {
  return {
      .name = "sheet",
      .sentence = "Draw tags to print, in true size",
      .help =
          R"(The size of a tag is the side of the square where its black border meets the white one; an arrow
below each tag shows it. Families with an inner border (circle, custom, standard) reach beyond it.
Cut along the dashed lines: the white margin within them belongs to the tag. Print at 100 %, without
"fit to page", and measure the ruler on the page. How to choose: docs/howto/print-tags.md.

Exit code: 0 written, 1 a file could not be written or is there already, 2 wrong usage or a tag that does not fit, 130
stopped by Ctrl-C.

Examples:
  waymark tags sheet --family 36h11 --ids 0-23 --tag-size-m 0.16 --paper A4 -o tags.pdf
  waymark tags sheet --ids 0-3,7,9 --tag-size-m 0.05 --per-page 1 --dpi 600 -o tags.png
)",
      .prepare = prepared(draw)};
}

}  // namespace waymark::cli
