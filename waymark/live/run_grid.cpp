#include "waymark/live/run_grid.hpp"

#include <algorithm>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "waymark/config/faults_file.hpp"
#include "waymark/config/text_file.hpp"
#include "waymark/config/yaml_fields.hpp"
#include "waymark/jobs/map_recording.hpp"
#include "waymark/jobs/staged_folder.hpp"
#include "waymark/live/replay_route.hpp"
#include "waymark/live/teach_lap.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;

constexpr std::uint64_t kOtherDay = 1000;  // the replay has other noise than the teach lap

struct ExperimentCell {
  std::string world, robot, controller, faults;
  double speed_m_s = 0;
  [[nodiscard]] std::string words() const {
    return fmt::format("{}, {}, {}, {} m/s{}", world, robot, controller, speed_m_s,
                       faults == kNoFaults ? "" : ", " + faults);
  }
};

/// A taught and mapped lap for a world, a robot and a seed.
Status make_lap(const RobotSetup& setup, const fs::path& folder, const JobControl& control) {
  std::error_code ignored;
  fs::create_directories(folder, ignored);
  const std::string lap = (folder / "lap.mcap").string();
  fs::remove(lap, ignored);
  const auto taught = teach_lap(setup, {.output = lap}, control);
  if (!taught) return tl::unexpected(taught.error());
  const auto map = map_recording({.lap = lap, .folder = folder / "map"}, control);
  return map ? Status() : tl::unexpected(map.error());
}

Result<ExperimentRun> replay_cell(RobotSetup setup, const ExperimentGrid& grid, const ExperimentCell& cell,
                                  const fs::path& map, std::uint64_t seed, const JobControl& control) {
  setup.simulated.robot.seed = seed + kOtherDay;
  if (cell.faults != kNoFaults) {
    auto faults = read_faults(cell.faults, setup.simulated.world);
    if (!faults) return tl::unexpected(faults.error());
    setup.simulated.robot.faults = std::move(*faults);
  }
  ReplayJob job{.folder = map};
  job.replay.laps = grid.laps;
  job.replay.controller = *parse_controller(cell.controller);  // the grid was checked
  job.replay.profile.speed_m_s = cell.speed_m_s;
  job.replay.safety.max_speed_m_s = std::max(job.replay.safety.max_speed_m_s, 1.2 * cell.speed_m_s);
  const auto report = replay_route(setup, job, control);
  if (!report) return tl::unexpected(report.error());
  return ExperimentRun{cell.words(), seed, succeeded(*report), ending(*report), report->judgement};
}

Result<std::vector<ExperimentRun>> run_lap(const ExperimentGrid& grid, const ExperimentCell& place,
                                           std::uint64_t seed, const fs::path& folder,
                                           const JobControl& control) {
  const auto setup = setup_of(grid, place.world, place.robot, seed);
  if (!setup) return tl::unexpected(setup.error());
  if (Status status = make_lap(*setup, folder, control); !status) return tl::unexpected(status.error());
  std::vector<ExperimentRun> runs;
  for (const std::string& controller : grid.controllers) {
    for (const double speed : grid.speeds_m_s) {
      for (const std::string& faults : grid.faults) {
        if (control.cancelled()) return runs;
        const ExperimentCell cell{place.world, place.robot, controller, faults, speed};
        auto run = replay_cell(*setup, grid, cell, folder / "map", seed, control);
        if (!run) return tl::unexpected(run.error());
        runs.push_back(std::move(*run));
      }
    }
  }
  return runs;
}

}  // namespace

Result<ExperimentGrid> read_grid(const std::string& path) {
  constexpr std::size_t kMostBytes = std::size_t{1} << 20U;
  const auto text = read_text_file(path, kMostBytes);
  if (!text) return tl::unexpected(text.error());
  const auto tree = parse_yaml(*text, path);
  if (!tree) return tl::unexpected(tree.error());
  if (tree->kind == YamlNode::Kind::Null)  // an accident, not the wish for the usual one
    return fail(ErrorCode::InvalidArgument, "the grid is empty", {.source = path},
                "Name what is to be driven, such as  seeds: [1, 2, 3]");
  auto grid = parse_fields<ExperimentGrid>(*text, path);
  Status sensible = grid ? check_grid(*grid) : tl::unexpected(grid.error());
  if (sensible) return grid;
  if (sensible.error().place.source.empty()) sensible.error().place.source = path;
  return tl::unexpected(std::move(sensible.error()));
}

Status check_experiment_folder(const fs::path& folder, bool force) {
  std::error_code ignored;
  for (const fs::path& path : {folder / "experiment.json", folder / "lap-1"}) {
    if (!force && fs::exists(path, ignored))
      return fail(ErrorCode::Unwritable, "an experiment was written here already", {.source = path.string()},
                  "Give another folder with --output, or --force to write over it.");
  }
  return check_output_folder(folder);
}

Result<std::vector<ExperimentRun>> run_grid(const ExperimentGrid& grid, const fs::path& folder,
                                            const JobControl& control) {
  std::vector<ExperimentRun> runs;
  int lap = 0;
  for (const std::string& world : grid.worlds) {
    for (const std::string& robot : grid.robots) {
      for (const std::uint64_t seed : grid.seeds) {
        if (control.cancelled()) return runs;
        auto some =
            run_lap(grid, {world, robot, "", "", 0}, seed, folder / fmt::format("lap-{}", ++lap), control);
        if (!some) return tl::unexpected(some.error());
        runs.insert(runs.end(), some->begin(), some->end());
      }
    }
  }
  return runs;
}

Result<ExperimentReport> run_experiment(const ExperimentGrid& grid, const ExperimentJob& job,
                                        const JobControl& control) {
  const auto runs = run_grid(grid, job.output, control);
  if (!runs) return tl::unexpected(runs.error());
  ExperimentReport report{.summaries = summaries_of(*runs)};
  report.written =
      write_text_file(std::filesystem::path(job.output) / "experiment.json", report.summaries.dump(2) + "\n");
  report.all_finished =
      report.written && std::ranges::all_of(*runs, [](const ExperimentRun& run) { return run.finished; });
  return report;
}

}  // namespace waymark
