#include <cmath>
#include <iterator>
#include <utility>

#include <fmt/format.h>

#include "waymark/app/evaluate/report_side_by_side.hpp"
#include "waymark/config/robot_file.hpp"
#include "waymark/evaluation/replay_judgement.hpp"
#include "waymark/plot/loop_figures.hpp"

namespace waymark {
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

/// Where it drove: the truth, or the estimate; empty when it does not say.
struct Way {
  Trajectory poses{};
  bool truth = false;
};

Way way_of(const DriveRun& drive) {
  if (!drive.lap.truth.empty()) return {drive.lap.truth, true};
  Way way;
  for (const EstimatedPose& pose : drive.estimate) way.poses.push_back({pose.stamp, pose.map_T_base});
  return way;
}

std::string name_of(const DriveRun& drive, const Way& way) {
  return way.truth ? drive.file : drive.file + " (its estimate)";
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
  if (runs.drives.size() < 2) return std::nullopt;
  const DriveRun* first = nullptr;
  Way first_way;
  plot::PageSection section{.title = "Drives compared"};
  section.tables.push_back(side_by_side(runs));
  if (plot::PageTable sensors = sensors_side_by_side(runs); !sensors.rows.empty())
    section.tables.push_back(std::move(sensors));
  plot::PageTable table{.head = {"drive", "driven [m]", "laps", "beside, rmse [mm]", "95 % [mm]",
                                 "worst [mm]", "heading [deg]", "nearest tag [m]"}};
  std::vector<plot::PathLayer> layers;
  for (const DriveRun& drive : runs.drives) {
    Way way = way_of(drive);
    if (way.poses.empty()) continue;
    if (first == nullptr) {
      first = &drive;
      first_way = std::move(way);
      layers.push_back({name_of(drive, first_way), first_way.poses, true_tags(drive), plot::kTruthColor});
      continue;
    }
    const std::string name = name_of(drive, way);
    const Result<ReplayJudgement> judged =
        judge_replay(way.poses, first_way.poses, true_tags(*first), hull_of(*first));
    if (!judged) {
      section.words.push_back(fmt::format("{}: {}", name, to_string(judged.error())));
      continue;
    }
    table.rows.push_back(row(name, *judged));
    const auto color = plot::kPalette[layers.size() % std::size(plot::kPalette)];
    layers.push_back({name, way.poses, {}, color});
    section.figures.push_back(
        {fmt::format("cross_track_{}", layers.size() - 1),
         plot::cross_track_figure(name + " beside " + name_of(*first, first_way), way.poses, first_way.poses),
         ""});
  }
  if (!table.rows.empty()) {
    table.caption = "Beside the way of " + name_of(*first, first_way) +
                    "; by the truth, except where an estimate is named";
    section.tables.push_back(std::move(table));
  }
  if (layers.size() > 1)
    section.figures.insert(
        section.figures.begin(),
        plot::PageFigure{"drives", plot::path_figure("Taught and driven again", layers), ""});
  return section;
}

}  // namespace waymark
