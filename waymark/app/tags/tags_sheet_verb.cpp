#include "waymark/app/cli/paper_flags.hpp"
#include "waymark/app/cli/parts.hpp"
#include "waymark/families/family.hpp"

namespace waymark::cli {
namespace {

struct SheetArgs {
  explicit SheetArgs(CLI::App& app)
      : settings(app), paper(app), sheet(settings, "sheet", kFirstGroup), tag_size(name_tag_size(app)) {
    add_option(app, "--ids LIST", ids, "Ids of the tags, for example 0-23 or 0-3,7,9", kRequired);
  }

  Settings settings;
  std::string ids;
  PaperFlags paper;
  OptionFlags<plot::SheetOptions> sheet;
  CLI::Option* tag_size;
};

/// Checks the sheet before anything is drawn.
Result<plot::SheetLayout> plan(const SheetArgs& args) {
  plot::SheetOptions options;
  Status usable = check_tag_size(*args.tag_size, args.sheet.given("tag_size_m"));
  if (usable) usable = args.sheet.apply(options);
  if (usable) usable = args.paper.apply(options);
  if (!usable) return tl::unexpected(usable.error());
  const auto family = args.paper.family();
  if (!family) return tl::unexpected(family.error());
  const auto numbers = parse_tag_numbers(*family, args.ids);
  if (!numbers) return tl::unexpected(numbers.error());
  return plot::layout_sheet(*family, *numbers, options);
}

ExitCode draw_sheet(const SheetArgs& args, Console& console) {
  const auto layout = plan(args);
  if (!layout) return fail_usage(layout.error(), console);
  return args.paper.write(*layout, plot::draw_sheet(*layout), console);
}

}  // namespace

Verb tags_sheet_verb() {
  return {
      .name = "sheet",
      .sentence = "Draw tags to print, in true size",
      .help =
          R"(The size of a tag is the side of the square at the edge between its black and white borders; an arrow below each
tag shows it. Families with an inner border (circle, custom, standard) extend beyond it. Cut along the dashed lines:
the white margin within them belongs to the tag. Print at 100 %, without "fit to page", and measure the ruler on the
page. docs/howto/print-tags.md explains how to choose family and size.
Exit code: 0 written, 1 a file exists or could not be written, 2 wrong usage or a tag that does not fit, 130 stopped
by Ctrl-C.

Examples:
  waymark tags sheet --family 36h11 --ids 0-23 --tag-size-m 0.16 --paper A4 -o tags.pdf
  waymark tags sheet --ids 0-3,7,9 --tag-size-m 0.05 --per-page 1 --dpi 600 -o tags.png
)",
      .prepare = prepared(draw_sheet),
      .report = report_of<Printed<plot::SheetLayout>>};
}

}  // namespace waymark::cli
