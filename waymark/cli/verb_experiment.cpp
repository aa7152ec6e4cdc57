#include "waymark/cli/parts.hpp"
#include "waymark/live/run_grid.hpp"

namespace waymark::cli {
namespace {

struct ExperimentArgs : JobArgs<ExperimentJob> {
  explicit ExperimentArgs(CLI::App& app) : JobArgs(app, "One JSON object instead of a table") {}
};

ExitCode experiment(const ExperimentArgs& args, Console& console) {
  const auto grid = read_grid(args.job.grid);
  if (!grid) return console.failed(grid.error(), ExitCode::Usage);
  if (Status status = check_experiment_folder(args.job.output, args.job.force); !status)
    return console.failed(status.error(), ExitCode::SomeFailed);
  const auto report = run_experiment(*grid, args.job, control_from(console));
  if (!report && interrupted()) {
    console.say("stopped: what was recorded is kept; --force begins anew");
    return ExitCode::Interrupted;
  }
  if (!report) return console.failed(report.error(), ExitCode::SomeFailed);
  console.print(args.json ? json_line({{"cells", report->summaries}}) : experiment_table(report->summaries));
  if (!report->written) console.say(report->written.error());
  if (interrupted()) return ExitCode::Interrupted;
  return report->all_finished ? ExitCode::Ok : ExitCode::SomeFailed;
}

}  // namespace

Verb experiment_verb() {
  return {
      .name = "experiment",
      .sentence =
          "Teach, map and replay a whole grid of worlds, robots, controllers, speeds, faults and seeds",
      .help =
          R"(For each world, robot and seed a lap is taught and mapped, then driven again with each controller, speed and
script of faults. Prints a row for each combination: how many seeds were completed, median and worst
cross-track error by the truth; and how those ended that were not. Keys of the grid, with what they are unless
given: worlds: [circuit24], robots: [limo], controllers: [follower], faults: [none], speeds_m_s: [0.4],
seeds: [1], laps: 1, images: false.

Exit code: 0 all were completed, 1 some were not, 2 the grid makes no sense, 130 stopped by Ctrl-C.

Example:
  waymark experiment grid.yaml -o experiment
)",
      .prepare = prepared(experiment)};
}

}  // namespace waymark::cli
