#include <algorithm>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <CLI/App.hpp>
#include <nlohmann/json.hpp>

#include "waymark/cli/console_control.hpp"
#include "waymark/cli/interrupt.hpp"
#include "waymark/cli/verb.hpp"
#include "waymark/config/text_file.hpp"
#include "waymark/config/yaml_fields.hpp"
#include "waymark/jobs/json_line.hpp"
#include "waymark/jobs/staged_folder.hpp"
#include "waymark/live/run_grid.hpp"

namespace waymark::cli {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostGridBytes = std::size_t{1} << 20U;
struct ExperimentArgs {
  std::string grid;
  std::string output = "experiment";
  bool force = false;
  bool json = false;
};

/// What an experiment found takes hours: it is written over only when that is asked for.
Status check_output(const ExperimentArgs& args) {
  const fs::path folder = args.output;
  std::error_code ignored;
  for (const fs::path& path : {folder / "experiment.json", folder / "lap-1"}) {
    if (!args.force && fs::exists(path, ignored))
      return fail(ErrorCode::Unwritable, "an experiment was written here already", {.source = path.string()},
                  "Give another folder with --output, or --force to write over it.");
  }
  return check_output_folder(folder);
}

Result<ExperimentGrid> read_grid(const std::string& path) {
  const auto text = read_text_file(path, kMostGridBytes);
  if (!text) return tl::unexpected(text.error());
  const auto tree = parse_yaml(*text, path);
  if (!tree) return tl::unexpected(tree.error());
  if (tree->kind == YamlNode::Kind::Null)  // an accident, not the wish for the usual one
    return fail(ErrorCode::InvalidArgument, "the grid is empty", {.source = path},
                "Name what is to be driven, such as  seeds: [1, 2, 3]");
  return parse_fields<ExperimentGrid>(*text, path);
}

ExitCode experiment(const ExperimentArgs& args, Console& console) {
  const auto grid = read_grid(args.grid);
  Status sensible = grid ? check_grid(*grid) : tl::unexpected(grid.error());
  if (!sensible) {
    if (sensible.error().place.source.empty()) sensible.error().place.source = args.grid;
    console.say(sensible.error());
    return ExitCode::Usage;
  }
  if (Status status = check_output(args); !status)
    return console.failed(status.error(), ExitCode::SomeFailed);
  const auto runs = run_grid(*grid, args.output, control_from(console));
  if (!runs && interrupted()) {
    console.say("stopped: what was recorded is kept; --force begins anew");
    return ExitCode::Interrupted;
  }
  if (!runs) return console.failed(runs.error(), ExitCode::SomeFailed);
  const nlohmann::ordered_json summaries = summaries_of(*runs);
  const Status written = write_text_file(fs::path(args.output) / "experiment.json", summaries.dump(2) + "\n");
  console.print(args.json ? json_line({{"cells", summaries}}) : experiment_table(summaries));
  if (!written) console.say(written.error());
  if (interrupted()) return ExitCode::Interrupted;
  const bool all =
      written && std::ranges::all_of(*runs, [](const ExperimentRun& run) { return run.finished; });
  return all ? ExitCode::Ok : ExitCode::SomeFailed;
}

Run prepare_experiment(CLI::App& app) {
  const auto args = std::make_shared<ExperimentArgs>();
  app.add_option("GRID", args->grid, "What is combined with what (.yaml, keys below)")
      ->required()
      ->type_name("");
  app.add_option("-o,--output", args->output, "Folder for laps, maps and experiment.json")
      ->capture_default_str()
      ->type_name("FOLDER");
  app.add_flag("--force", args->force, "Replace an experiment that is in the folder");
  app.add_flag("--json", args->json, "One JSON object instead of a table");
  return [args](Console& console) { return experiment(*args, console); };
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
      .prepare = prepare_experiment,
      .verbs = {}};
}

}  // namespace waymark::cli
