#include <cmath>
#include <iterator>

#include <fmt/format.h>

#include "waymark/cli/report_run.hpp"
#include "waymark/config/robot_file.hpp"
#include "waymark/evaluation/replay_judgement.hpp"
#include "waymark/plot/loop_figures.hpp"

namespace waymark::cli {
namespace {

/// Of the reference drive, for the clearance; a point when the recording does not say.
Hull hull_of(const DriveRun& drive) {
  const auto yaml = robot_yaml_of(drive.lap);
  if (!yaml) return {};
  const Result<RobotDescription> robot = parse_robot(*yaml, drive.file + ": robot.yaml");
  return robot ? robot->model.hull : Hull{};
}

TagMap true_tags(const DriveRun& drive) {
  const Result<std::optional<World>> world = true_world(drive.lap);
  return world && *world ? (*world)->tags : TagMap{};
}

std::vector<std::string> row(const std::string& name, const ReplayJudgement& judged) {
  return {name,
          fmt::format("{:.2f}", judged.distance_m),
          std::to_string(judged.laps_completed),
          fmt::format("{:.1f}", 1000 * judged.cross_track_rmse_m),
          fmt::format("{:.1f}", 1000 * judged.cross_track_p95_m),
          fmt::format("{:.1f}", 1000 * judged.cross_track_max_m),
          fmt::format("{:.2f}", judged.heading_rmse_deg),
          std::isfinite(judged.min_clearance_m) ? fmt::format("{:.3f}", judged.min_clearance_m) : "-"};
}

}  // namespace

std::optional<plot::PageSection> comparison_section(const Runs& runs) {
  const DriveRun* first = nullptr;
  plot::PageSection section{.title = "Drives compared"};
  plot::PageTable table{.head = {"drive", "driven [m]", "laps", "beside, rmse [mm]", "95 % [mm]",
                                 "worst [mm]", "heading [deg]", "nearest tag [m]"}};
  std::vector<plot::PathLayer> layers;
  for (const DriveRun& drive : runs.drives) {
    if (drive.lap.truth.empty()) continue;
    if (first == nullptr) {
      first = &drive;
      layers.push_back({drive.file, drive.lap.truth, true_tags(drive), plot::kTruthColor});
      continue;
    }
    const Result<ReplayJudgement> judged =
        judge_replay(drive.lap.truth, first->lap.truth, true_tags(*first), hull_of(*first));
    if (!judged) {
      section.words.push_back(fmt::format("{}: {}", drive.file, to_string(judged.error())));
      continue;
    }
    table.rows.push_back(row(drive.file, *judged));
    const auto color = plot::kPalette[layers.size() % std::size(plot::kPalette)];
    layers.push_back({drive.file, drive.lap.truth, {}, color});
    section.figures.push_back(
        {fmt::format("cross_track_{}", layers.size() - 1),
         plot::cross_track_figure(drive.file + " beside " + first->file, drive.lap.truth, first->lap.truth),
         ""});
  }
  if (table.rows.empty() && section.words.empty()) return std::nullopt;
  table.caption = "Beside the way of " + first->file + ", by truth alone";
  if (!table.rows.empty()) section.tables.push_back(std::move(table));
  if (layers.size() > 1)
    section.figures.insert(
        section.figures.begin(),
        plot::PageFigure{"drives", plot::path_figure("Taught and driven again", layers), ""});
  return section;
}

}  // namespace waymark::cli
