#include "waymark/app/cli/parts.hpp"
#include "waymark/app/evaluate/plot_figure.hpp"

namespace waymark::cli {
namespace {

ExitCode plot_one(const PlotJob& job, Console& console) {
  const Result<PlotReport> report = plot_figure(job, control_from(console));
  if (!report) return fail_with(report.error(), console);
  if (report->written.empty())
    console.print(to_text(*report));
  else
    console.note("wrote " + report->written);
  return ExitCode::Ok;
}

}  // namespace

Verb plot_verb() {
  return {
      .name = "plot",
      .sentence = "Draw a single figure of a report",
      .help =
          R"(Writes a figure of `waymark report` to a file, for a paper or a slide. Without --figure, it lists the figures.

Exit code: 0 written or listed, 1 an input could not be read or the file already exists, 2 wrong usage or no
such figure.

Examples:
  waymark plot demo
  waymark plot demo --figure floor -o floor.pdf
)",
      .prepare = prepared_job(plot_one)};
}

}  // namespace waymark::cli
