#include <algorithm>
#include <filesystem>

#include "waymark/cli/parts.hpp"
#include "waymark/config/text_file.hpp"
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
  const auto runs = run_grid(*grid, args.job.output, control_from(console));
  if (!runs && interrupted()) {
    console.say("stopped: what was recorded is kept; --force begins anew");
    return ExitCode::Interrupted;
  }
  if (!runs) return console.failed(runs.error(), ExitCode::SomeFailed);
  const nlohmann::ordered_json summaries = summaries_of(*runs);
  const Status written =
      write_text_file(std::filesystem::path(args.job.output) / "experiment.json", summaries.dump(2) + "\n");
  console.print(args.json ? json_line({{"cells", summaries}}) : experiment_table(summaries));
  if (!written) console.say(written.error());
  if (interrupted()) return ExitCode::Interrupted;
  const bool all =
      written && std::ranges::all_of(*runs, [](const ExperimentRun& run) { return run.finished; });
  return all ? ExitCode::Ok : ExitCode::SomeFailed;
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
