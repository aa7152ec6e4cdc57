#include <fmt/ranges.h>

#include "waymark/app/cli/parts.hpp"
#include "waymark/app/common/route_files.hpp"
#include "waymark/app/replay/optimize_route.hpp"

namespace waymark::cli {
namespace {

struct OptimizeArgs {
  explicit OptimizeArgs(CLI::App& app)
      : settings(app), weights(settings, "weights", "Weights"), profile(settings, "profile", "Speed") {
    app.get_option("--speed-m-s")->group(kFirstGroup);
    add_fields(app, job);
    add_option(app, "--weights FILE", weights_file,
               "Options of the optimisation: a .yaml file with the keys below");
    app.add_flag("--json", json, "Print one JSON object instead of a table");
  }

  Settings settings;
  OptimizeJob job{};
  std::string weights_file;
  bool json = false;
  OptionFlags<OptimizerOptions> weights;
  OptionFlags<ProfileOptions> profile;
};

Result<OptimizerOptions> weights_of(const OptimizeArgs& args) {
  Result<OptimizerOptions> options =
      args.weights_file.empty() ? OptimizerOptions() : read_weights(args.weights_file);
  if (!options) return options;
  if (Status status = args.weights.apply(*options); !status) return tl::unexpected(status.error());
  return options;
}

ExitCode optimize(const OptimizeArgs& args, Console& console) {
  OptimizeJob job = args.job;
  Status status = check_route_name(job.name, "name");
  if (status) status = args.profile.apply(job.profile);
  const auto options = status ? weights_of(args) : tl::unexpected(status.error());
  if (!options) return fail_usage(options.error(), console);
  job.options = *options;
  const auto report = optimize_route_of(job);
  if (!report) return fail_with(report.error(), console);
  if (!report->backups.empty())
    console.note(
        fmt::format("the previous files were renamed with a number: {}", fmt::join(report->backups, ", ")));
  console.print(args.json ? json_line(fields(*report)) : to_text(job, *report));
  return ExitCode::Ok;
}

}  // namespace

Verb optimize_verb() {
  return {
      .name = "optimize",
      .sentence = "Compute a faster or smoother route close to a taught one",
      .help =
          R"(Moves the route sideways within a corridor to optimise a weighted sum of lap time, smoothness, distance from
tags, and tags in view. The smallest distance to a tag and the share of the route with two tags in view are at
least those of the taught route. If no such route is found, the taught route is kept. Writes route-NAME.yaml and
a figure (route-NAME.svg) into the folder. `waymark replay` drives the taught route unless --route names another.

Exit code: 0 a route was written, 1 a file was unusable, 2 wrong usage.

Example:
  waymark optimize map --name fast --speed-m-s 0.8
)",
      .prepare = prepared(optimize),
      .report = report_of<OptimizeReport>};
}

}  // namespace waymark::cli
