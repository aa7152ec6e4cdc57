#include <algorithm>
#include <set>

#include <fmt/format.h>

#include "waymark/app/evaluate/report_page.hpp"
#include "waymark/config/map_file.hpp"
#include "waymark/evaluation/dead_reckoning.hpp"
#include "waymark/evaluation/trajectory_scores.hpp"
#include "waymark/plot/loop_figures.hpp"
#include "waymark/plot/run_figures.hpp"

namespace waymark {
namespace {

using Rows = std::vector<std::vector<std::string>>;

/// A path on paper needs no more poses.
constexpr std::size_t kMostPoses = 3000;

template <class Pose>
Trajectory thin(const std::vector<Pose>& poses) {
  const std::size_t step = poses.size() / kMostPoses + 1;
  Trajectory kept;
  for (std::size_t i = 0; i < poses.size(); i += step) kept.push_back({poses[i].stamp, poses[i].map_T_base});
  return kept;
}

/// The map the robot was driven by, when the recording holds it.
TagMap tags_of(const DriveRun& drive) {
  const auto text = drive.lap.attachments.find("map.yaml");
  if (text == drive.lap.attachments.end()) return {};
  const Result<MapFile> map = parse_map(text->second, drive.file + ": map.yaml");
  return map ? map->tags : TagMap{};
}

double distance_m(const std::vector<Odometry>& odometry) {
  double sum = 0;
  for (std::size_t i = 1; i < odometry.size(); ++i)
    sum += (odometry[i].odom_T_base.translation() - odometry[i - 1].odom_T_base.translation()).norm();
  return sum;
}

void add_making(const DriveRun& drive, Rows& rows) {
  const auto made = drive.lap.setup.metadata.find("waymark");
  if (made == drive.lap.setup.metadata.end()) return;
  for (const char* key : {"verb", "driver", "robot", "world", "seed", "version"}) {
    const auto value = made->second.find(key);
    if (value != made->second.end() && !value->second.empty()) rows.push_back({key, value->second});
  }
}

void add_motion(const DriveRun& drive, Rows& rows) {
  const auto& odometry = drive.lap.odometry;
  if (odometry.size() < 2) return;
  const double seconds = to_seconds(odometry.back().stamp - odometry.front().stamp);
  const double metres = distance_m(odometry);
  rows.push_back({"duration", fmt::format("{:.1f} s", seconds)});
  rows.push_back({"driven, by odometry", fmt::format("{:.2f} m", metres)});
  if (seconds > 0) rows.push_back({"mean speed", fmt::format("{:.2f} m/s", metres / seconds)});
}

void add_tags(const DriveRun& drive, Rows& rows) {
  const auto& frames = drive.lap.frames;
  if (frames.empty()) return;
  std::set<TagId> seen;
  std::size_t with_two = 0;
  for (const TagFrame& frame : frames) {
    if (frame.detections.size() >= 2) ++with_two;
    for (const TagDetection& detection : frame.detections) seen.insert(detection.tag);
  }
  rows.push_back({"frames", std::to_string(frames.size())});
  rows.push_back({"tags seen", std::to_string(seen.size())});
  rows.push_back(
      {"two tags or more in view",
       fmt::format("{:.1f} %", 100 * static_cast<double>(with_two) / static_cast<double>(frames.size()))});
}

void add_scores(const DriveRun& drive, Rows& rows) {
  const TrajectoryScoreOptions options;
  const auto pairs = pair_by_time(drive.estimate, drive.lap.truth,
                                  Duration(static_cast<std::int64_t>(options.max_gap_s * 1e9)));
  const Result<TrajectoryScores> scores = score_trajectory(pairs, AlignmentKind::None, options);
  if (!scores) return;
  rows.push_back({"estimate from the truth, rmse", fmt::format("{:.4f} m", scores->ate_m.rmse)});
  rows.push_back({"estimate from the truth, worst", fmt::format("{:.4f} m", scores->ate_m.max)});
  rows.push_back({"heading, rmse", fmt::format("{:.2f} deg", scores->heading_deg.rmse)});
  rows.push_back({"jumps", std::to_string(scores->jumps)});
  if (scores->consistency && scores->consistency->count > 0)
    rows.push_back(
        {"NEES (x, y, yaw: 3 is consistent)", fmt::format("{:.2f}", scores->consistency->nees_mean)});
}

/// Where dead reckoning would be, had it been told the start.
Trajectory placed_odometry(const DriveRun& drive) {
  const Trajectory wheels = wheel_odometry(drive.lap.odometry);
  if (!drive.lap.truth.empty()) return thin(placed_at(wheels, drive.lap.truth.front()));
  if (!drive.estimate.empty())
    return thin(placed_at(wheels, {drive.estimate.front().stamp, drive.estimate.front().map_T_base}));
  return thin(wheels);
}

plot::PageFigure floor_figure(const DriveRun& drive) {
  const std::vector<plot::PathLayer> layers = {
      {"truth", thin(drive.lap.truth), {}, plot::kTruthColor},
      {"odometry", placed_odometry(drive), {}, plot::kTaughtColor},
      {"estimate", thin(drive.estimate), tags_of(drive), plot::kEstimateColor}};
  return {.name = "floor",
          .figure = plot::path_figure("Seen from above", layers),
          .caption = "Odometry begins where the robot began."};
}

}  // namespace

plot::PageSection drive_section(const DriveRun& drive) {
  plot::PageSection section{.title = drive.file};
  Rows rows;
  add_making(drive, rows);
  add_motion(drive, rows);
  add_tags(drive, rows);
  if (!drive.estimate.empty() && !drive.lap.truth.empty()) add_scores(drive, rows);
  section.tables.push_back({.caption = "", .head = {}, .rows = std::move(rows)});
  if (!drive.lap.truth.empty() || !drive.estimate.empty() || !drive.lap.odometry.empty())
    section.figures.push_back(floor_figure(drive));
  if (!drive.lap.odometry.empty())
    section.figures.push_back(
        {"speed", plot::speed_figure("Speed", drive.lap.odometry), "By wheel odometry."});
  if (!drive.lap.frames.empty())
    section.figures.push_back({"tags_in_view", plot::tags_in_view_figure("Tags in view", drive.lap.frames),
                               "Below two the position is weakly known."});
  if (drive.estimate.empty()) return section;
  section.figures.push_back(
      {"error",
       plot::error_and_doubt_figure("Error and its standard deviation", drive.estimate, drive.lap.truth),
       "The error of a consistent estimate is below twice its standard deviation about 19 times out of 20."});
  if (!drive.lap.truth.empty())
    section.figures.push_back(
        {"heading", plot::heading_error_figure("Error of the heading", drive.estimate, drive.lap.truth), ""});
  return section;
}

}  // namespace waymark
