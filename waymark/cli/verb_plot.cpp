#include <algorithm>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <CLI/App.hpp>

#include "waymark/base/suggest.hpp"
#include "waymark/cli/console_control.hpp"
#include "waymark/cli/failure.hpp"
#include "waymark/cli/verb.hpp"
#include "waymark/jobs/figure_files.hpp"
#include "waymark/jobs/report_page.hpp"
#include "waymark/jobs/staged_folder.hpp"

namespace waymark::cli {
namespace {

struct PlotArgs {
  std::vector<std::string> runs;
  std::string figure;
  std::string output;
  bool force = false;
};

/// Where the figure goes; whatever stands there is somebody's.
Status check_output(const PlotArgs& args, const std::filesystem::path& output) {
  if (args.figure.empty() && !args.output.empty())
    return fail(ErrorCode::InvalidArgument, "which figure is to be drawn is not said", {.key = "--output"},
                "Name it with --figure; without -o the figures are listed.");
  if (args.figure.empty() && args.force)
    return fail(ErrorCode::InvalidArgument, "nothing is written", {.key = "--force"},
                "Name a figure with --figure; without it the figures are listed.");
  if (args.figure.empty()) return {};
  std::error_code ignored;
  if (!args.force && std::filesystem::is_regular_file(output, ignored))
    return fail(ErrorCode::Unwritable, "there is a file already", {.source = output.string()},
                "Give another name with -o, or --force to replace it.");
  return check_output_file(output);
}

std::string list_of(const std::vector<plot::PageFigure>& figures) {
  std::string text;
  for (const plot::PageFigure& each : figures)
    text += fmt::format("{:<16} {}, {}\n", each.name, each.figure.title, each.caption);
  return text;
}

Result<std::vector<plot::PageFigure>> read_figures(const PlotArgs& args, const JobControl& control) {
  const Result<Runs> runs = read_runs(args.runs, control);
  if (!runs) return tl::unexpected(runs.error());
  const Result<plot::Page> page = report_page(*runs, control);
  if (!page) return tl::unexpected(page.error());
  return figures_of(*page);
}

ExitCode plot_one(const PlotArgs& args, Console& console) {
  const std::filesystem::path output = args.output.empty() ? args.figure + ".svg" : args.output;
  if (const Status free = check_output(args, output); !free) return fail_with(free.error(), console);
  const Result<std::vector<plot::PageFigure>> figures = read_figures(args, control_from(console));
  if (!figures) return console.failed(figures.error(), ExitCode::SomeFailed);
  if (args.figure.empty()) {
    console.print(list_of(*figures));
    return ExitCode::Ok;
  }
  const auto found = std::ranges::find(*figures, args.figure, &plot::PageFigure::name);
  if (found == figures->end()) {
    std::vector<std::string> names;
    for (const plot::PageFigure& each : *figures) names.push_back(each.name);
    console.say(Error{ErrorCode::NotFound,
                      fmt::format("these runs have no figure '{}'", args.figure),
                      {.key = "--figure"},
                      suggestion(args.figure, names)});
    return ExitCode::Usage;
  }
  std::vector<std::string> files;
  const Status written = write_figure(output, found->figure, {output.extension().string()}, files);
  if (!written) return console.failed(written.error(), ExitCode::SomeFailed);
  console.say("wrote " + files.front());
  return ExitCode::Ok;
}

Run prepare_plot(CLI::App& app) {
  const auto args = std::make_shared<PlotArgs>();
  app.add_option("RUN", args->runs, "Recordings, folders of maps, or the folder of a demo")
      ->required()
      ->type_name("...");
  app.add_option("--figure", args->figure, "Name of the figure. Unless given: the figures are listed")
      ->type_name("NAME");
  app.add_option("-o,--output", args->output, "File to write: .svg, .png or .pdf (usual: NAME.svg)")
      ->type_name("FILE");
  app.add_flag("--force", args->force, "Replace a file that is there");
  return [args](Console& console) { return plot_one(*args, console); };
}

}  // namespace

Verb plot_verb() {
  return {.name = "plot",
          .sentence = "Draw one figure of a report into a file of its own",
          .help =
              R"(The figures that `waymark report` shows, one by one, for a paper or a slide.

Exit code: 0 written or listed, 1 something could not be read or a file is there already, 2 wrong usage or no
such figure.

Examples:
  waymark plot demo
  waymark plot demo --figure floor -o floor.pdf
)",
          .prepare = prepare_plot,
          .verbs = {}};
}

}  // namespace waymark::cli
