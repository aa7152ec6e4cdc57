#include <algorithm>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <system_error>
#include <vector>

#include <fmt/format.h>
#include <CLI/App.hpp>
#include <nlohmann/json.hpp>

#include "waymark/cli/console_control.hpp"
#include "waymark/cli/detections_json.hpp"
#include "waymark/cli/experiment_grid.hpp"
#include "waymark/cli/interrupt.hpp"
#include "waymark/cli/loop_steps.hpp"
#include "waymark/cli/verb.hpp"
#include "waymark/config/faults_file.hpp"
#include "waymark/config/text_file.hpp"
#include "waymark/config/yaml_fields.hpp"
#include "waymark/jobs/staged_folder.hpp"

namespace waymark::cli {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostGridBytes = std::size_t{1} << 20U;
constexpr std::uint64_t kOtherDay = 1000;  // the replay has other noise than the teach lap

struct ExperimentArgs {
  std::string grid;
  std::string output = "experiment";
  bool force = false;
  bool json = false;
};

/// One replay.
struct ExperimentRun {
  std::string cell{};  ///< everything but the seed, in words
  std::uint64_t seed = 0;
  bool finished = false;
  std::string ending{};
  std::optional<ReplayJudgement> judged{};
};

struct ExperimentCell {
  std::string world, robot, controller, faults;
  double speed_m_s = 0;
  [[nodiscard]] std::string words() const {
    return fmt::format("{}, {}, {}, {} m/s{}", world, robot, controller, speed_m_s,
                       faults == kNoFaults ? "" : ", " + faults);
  }
};

/// A taught and mapped lap for a world, a robot and a seed.
Status make_lap(const Stage& stage, const fs::path& folder, Console& console) {
  std::error_code ignored;
  fs::create_directories(folder, ignored);
  const std::string lap = (folder / "lap.mcap").string();
  fs::remove(lap, ignored);
  const auto taught = teach_lap(stage, {.output = lap}, console);
  if (!taught) return tl::unexpected(taught.error());
  const auto map = map_recording({.lap = lap, .folder = folder / "map"}, control_from(console));
  return map ? Status() : tl::unexpected(map.error());
}

Result<ExperimentRun> replay_cell(Stage stage, const ExperimentGrid& grid, const ExperimentCell& cell,
                                  const fs::path& map, std::uint64_t seed, Console& console) {
  stage.simulated.robot.seed = seed + kOtherDay;
  if (cell.faults != kNoFaults) {
    auto faults = read_faults(cell.faults, stage.simulated.world);
    if (!faults) return tl::unexpected(faults.error());
    stage.simulated.robot.faults = std::move(*faults);
  }
  ReplayJob job{.folder = map};
  job.replay.laps = grid.laps;
  job.controller = cell.controller;
  job.replay.profile.speed_m_s = cell.speed_m_s;
  job.replay.safety.max_speed_m_s = std::max(job.replay.safety.max_speed_m_s, 1.2 * cell.speed_m_s);
  const auto report = replay_route(stage, job, console);
  if (!report) return tl::unexpected(report.error());
  return ExperimentRun{cell.words(), seed, succeeded(*report), ending(*report), report->judgement};
}

Result<std::vector<ExperimentRun>> run_lap(const ExperimentGrid& grid, const ExperimentCell& place,
                                           std::uint64_t seed, const fs::path& folder, Console& console) {
  const auto stage = stage_of(grid, place.world, place.robot, seed);
  if (!stage) return tl::unexpected(stage.error());
  if (Status status = make_lap(*stage, folder, console); !status) return tl::unexpected(status.error());
  std::vector<ExperimentRun> runs;
  for (const std::string& controller : grid.controllers) {
    for (const double speed : grid.speeds_m_s) {
      for (const std::string& faults : grid.faults) {
        if (interrupted()) return runs;
        const ExperimentCell cell{place.world, place.robot, controller, faults, speed};
        auto run = replay_cell(*stage, grid, cell, folder / "map", seed, console);
        if (!run) return tl::unexpected(run.error());
        runs.push_back(std::move(*run));
      }
    }
  }
  return runs;
}

double median(std::vector<double> values) {
  std::ranges::sort(values);
  const std::size_t n = values.size();
  return n == 0 ? 0 : (values[(n - 1) / 2] + values[n / 2]) / 2;
}

nlohmann::ordered_json summary_of(const std::string& cell, const std::vector<const ExperimentRun*>& runs) {
  std::vector<double> rmse;
  std::vector<double> largest;
  int finished = 0;
  std::vector<std::string> endings;
  for (const ExperimentRun* run : runs) {
    finished += run->finished ? 1 : 0;
    if (!run->finished) endings.push_back(fmt::format("seed {}: {}", run->seed, run->ending));
    if (!run->judged) continue;
    rmse.push_back(run->judged->cross_track_rmse_m);
    largest.push_back(run->judged->cross_track_max_m);
  }
  const auto middle = [](const std::vector<double>& v) {
    return v.empty() ? nlohmann::ordered_json() : nlohmann::ordered_json(median(v));
  };
  const auto worst = [](const std::vector<double>& v) {
    return v.empty() ? nlohmann::ordered_json() : nlohmann::ordered_json(*std::ranges::max_element(v));
  };
  return {{"what", cell},
          {"runs", runs.size()},
          {"completed", finished},
          {"cross_track_rmse_median_m", middle(rmse)},
          {"cross_track_rmse_worst_m", worst(rmse)},
          {"cross_track_max_median_m", middle(largest)},
          {"cross_track_max_worst_m", worst(largest)},
          {"endings", endings}};
}

std::string table_of(const nlohmann::ordered_json& cells) {
  std::string text = fmt::format("{:<52}{:>6}{:>11}{:>22}{:>22}\n", "", "runs", "completed",
                                 "rmse median/worst [m]", "max median/worst [m]");
  for (const auto& cell : cells) {
    const auto metres = [&](const char* key) {  // nothing to judge is no zero
      return cell[key].is_null() ? std::string("-") : fmt::format("{:.4f}", cell[key].get<double>());
    };
    text += fmt::format("{:<52}{:>6}{:>11}{:>14} /{:>6}{:>14} /{:>6}\n", cell["what"].get<std::string>(),
                        cell["runs"].get<int>(), cell["completed"].get<int>(),
                        metres("cross_track_rmse_median_m"), metres("cross_track_rmse_worst_m"),
                        metres("cross_track_max_median_m"), metres("cross_track_max_worst_m"));
    for (const auto& words : cell["endings"]) text += "    " + words.get<std::string>() + "\n";
  }
  return text;
}

Result<std::vector<ExperimentRun>> run_grid(const ExperimentGrid& grid, const fs::path& folder,
                                            Console& console) {
  std::vector<ExperimentRun> runs;
  int lap = 0;
  for (const std::string& world : grid.worlds) {
    for (const std::string& robot : grid.robots) {
      for (const std::uint64_t seed : grid.seeds) {
        if (interrupted()) return runs;
        auto some =
            run_lap(grid, {world, robot, "", "", 0}, seed, folder / fmt::format("lap-{}", ++lap), console);
        if (!some) return tl::unexpected(some.error());
        runs.insert(runs.end(), some->begin(), some->end());
      }
    }
  }
  return runs;
}

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
  if (Status status = check_output(args); !status) {
    console.say(status.error());
    return ExitCode::SomeFailed;
  }
  const auto runs = run_grid(*grid, args.output, console);
  if (!runs && interrupted()) {
    console.say("stopped: what was recorded is kept; --force begins anew");
    return ExitCode::Interrupted;
  }
  if (!runs) {
    console.say(runs.error());
    return ExitCode::SomeFailed;
  }
  std::vector<std::string> order;
  std::map<std::string, std::vector<const ExperimentRun*>> cells;
  for (const ExperimentRun& run : *runs) {
    if (cells[run.cell].empty()) order.push_back(run.cell);
    cells[run.cell].push_back(&run);
  }
  nlohmann::ordered_json summaries = nlohmann::ordered_json::array();
  for (const std::string& cell : order) summaries.push_back(summary_of(cell, cells[cell]));
  const Status written = write_text_file(fs::path(args.output) / "experiment.json", summaries.dump(2) + "\n");
  console.print(args.json ? json_line({{"cells", summaries}}) : table_of(summaries));
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
  app.add_flag("--force", args->force, "Write over an experiment that is in the folder");
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
