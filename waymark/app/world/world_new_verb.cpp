#include "waymark/app/cli/parts.hpp"
#include "waymark/app/world/lay_world.hpp"

namespace waymark::cli {
namespace {

struct NewArgs : LayWorldRequest {
  explicit NewArgs(CLI::App& app) : settings(app), layout(settings, "layout", kFirstGroup) {
    add_fields(app, static_cast<LayWorldRequest&>(*this));
    app.add_flag("--json", json, "Print one JSON object instead of text");
  }

  Settings settings;
  bool json = false;
  OptionFlags<TagLayoutOptions> layout;
};

ExitCode make_world(const NewArgs& args, Console& console) {
  TagLayoutOptions layout;
  const Status status = args.layout.apply(layout);
  const auto job = status ? described_lay_world(args, layout) : tl::unexpected(status.error());
  if (!job) return fail_usage(job.error(), console);
  const Result<LayWorldReport> report = lay_world(*job, control_from(console));
  if (!report) return fail_with(report.error(), console);
  console.print(args.json ? json_line(fields(*report)) : to_text(*report));
  return ExitCode::Ok;
}

}  // namespace

Verb world_new_verb() {
  return {
      .name = "new",
      .sentence = "Make a world with tags along a drawn or driven line",
      .help =
          R"(Places upright tags along the line: as few as needed to have two of them in view everywhere, and none closer to the hull
than --clearance-m (measured in 3D). A line that returns to its start is a lap; a part that repeats the lap is cut off.
A line that continues elsewhere is kept completely.

Exit code: 0 a world was written, 1 the line could not be read, or no tag could be placed, 2 wrong usage.

Example:
  waymark world new --path lap.mcap -o mine.yaml --tag-size-m 0.12
)",
      .prepare = prepared(make_world),
      .report = report_of<LayWorldReport>};
}

}  // namespace waymark::cli
