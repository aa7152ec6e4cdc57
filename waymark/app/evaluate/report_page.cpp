#include "waymark/app/evaluate/report_page.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <map>
#include <set>
#include <system_error>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "waymark/app/common/file_kind.hpp"
#include "waymark/app/common/output_files.hpp"
#include "waymark/app/common/profile_table.hpp"
#include "waymark/app/common/trajectory_files.hpp"
#include "waymark/base/message_text.hpp"
#include "waymark/base/order_statistics.hpp"
#include "waymark/config/exchange/trajectory_file.hpp"
#include "waymark/config/text_file.hpp"
#include "waymark/config/yaml/map_file.hpp"
#include "waymark/config/yaml/robot_file.hpp"
#include "waymark/config/yaml/route_file.hpp"
#include "waymark/evaluation/dead_reckoning.hpp"
#include "waymark/evaluation/map_errors.hpp"
#include "waymark/evaluation/replay_judgement.hpp"
#include "waymark/evaluation/trajectory_scores.hpp"
#include "waymark/geometry/dense.hpp"
#include "waymark/pipeline/lap_mapper.hpp"
#include "waymark/plot/run_figures.hpp"
#include "waymark/recording/message_log.hpp"
#include "waymark/recording/sample_recorder.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;
using Rows = std::vector<std::vector<std::string>>;

// Comparison of drives, side by side.

template <class Stamped>
double rate_hz(const std::vector<Stamped>& samples) {
  if (samples.size() < 2) return 0;
  const double seconds = to_seconds(samples.back().stamp - samples.front().stamp);
  return seconds > 0 ? static_cast<double>(samples.size() - 1) / seconds : 0;
}

/// Totals over all detections in a drive.
struct DetectionTotals {
  std::size_t tags = 0;
  std::size_t with_two = 0;
  double longest_gap_s = 0;  ///< longest time without a detection
  std::vector<double> sides_px{};
};

DetectionTotals detection_totals(const std::vector<TagFrame>& frames) {
  DetectionTotals totals;
  SensorTime seen = frames.empty() ? SensorTime{} : frames.front().stamp;
  for (const TagFrame& frame : frames) {
    totals.tags += frame.detections.size();
    if (frame.detections.size() >= 2) ++totals.with_two;
    totals.longest_gap_s = std::max(totals.longest_gap_s, to_seconds(frame.stamp - seen));
    if (!frame.detections.empty()) seen = frame.stamp;
    for (const TagDetection& tag : frame.detections)
      totals.sides_px.push_back((tag.corners_px[1] - tag.corners_px[0]).norm());
  }
  return totals;
}

std::string number(double value, int digits) {
  return value > 0 ? fmt::format("{:.{}f}", value, digits) : "-";
}

/// Origin of the recording: "sim", "process:…", or another source. "-" if unknown.
std::string source_of(const DriveRun& drive) {
  const auto made = drive.lap.setup.metadata.find("waymark");
  if (made == drive.lap.setup.metadata.end()) return "-";
  const auto source = made->second.find("source");
  return source == made->second.end() ? "-" : source->second.substr(0, source->second.find(' '));
}

std::vector<std::string> row_of(const DriveRun& drive) {
  const DetectionTotals totals = detection_totals(drive.lap.frames);
  const auto frames = static_cast<double>(drive.lap.frames.size());
  const auto& odometry = drive.lap.odometry;
  double metres = 0;
  for (std::size_t i = 1; i < odometry.size(); ++i)
    metres += (odometry[i].odom_T_base.translation() - odometry[i - 1].odom_T_base.translation()).norm();
  const double seconds = odometry.size() < 2 ? 0 : to_seconds(odometry.back().stamp - odometry.front().stamp);
  std::vector<double> sigma_mm;
  for (const EstimatedPose& pose : drive.estimate) {
    if (pose.covariance) sigma_mm.push_back(1000 * std::sqrt(pose.covariance->topLeftCorner<2, 2>().trace()));
  }
  return {drive.file,
          source_of(drive),
          number(seconds, 1),
          number(metres, 2),
          number(seconds > 0 ? metres / seconds : 0, 2),
          number(rate_hz(odometry), 1),
          number(rate_hz(drive.lap.frames), 1),
          frames > 0 ? fmt::format("{:.2f}", static_cast<double>(totals.tags) / frames) : "-",
          frames > 0 ? fmt::format("{:.1f}", 100 * static_cast<double>(totals.with_two) / frames) : "-",
          frames > 0 ? fmt::format("{:.2f}", totals.longest_gap_s) : "-",
          number(median(totals.sides_px), 1),
          number(median(std::move(sigma_mm)), 1)};
}

}  // namespace

plot::PageTable side_by_side(const Runs& runs) {
  plot::PageTable table{
      .caption =
          "Data and detections of each robot, without ground truth: mean number of tags per image, median "
          "side of the black squares, and median standard deviation of the position (sigma)",
      .head = {"drive", "source", "duration [s]", "distance [m]", "speed [m/s]", "odometry [Hz]",
               "camera [Hz]", "tags", "two or more [%]", "longest gap [s]", "side [px]", "sigma [mm]"}};
  for (const DriveRun& drive : runs.drives) table.rows.push_back(row_of(drive));
  return table;
}

plot::PageTable sensors_side_by_side(const Runs& runs) {
  plot::PageTable table{
      .caption = "Behaviour of sensors and motors, measured in the same way for each recording",
      .head = {"quantity"}};
  std::vector<const DriveRun*> measured;
  for (const DriveRun& drive : runs.drives)
    if (drive.profile) measured.push_back(&drive);
  if (measured.size() < 2) return table;
  for (const DriveRun* drive : measured) table.head.push_back(drive->file);
  std::vector<std::vector<ProfileRow>> columns;
  columns.reserve(measured.size());
  for (const DriveRun* drive : measured)
    columns.push_back(profile_table(*measured.front()->profile, *drive->profile));
  // Collected from all drives, because the first may lack rows that others have.
  std::vector<std::string> keys;
  for (const std::vector<ProfileRow>& column : columns) {
    for (const ProfileRow& row : column) {
      if (std::ranges::find(keys, row.key) != keys.end()) continue;
      keys.push_back(row.key);
      table.rows.push_back({row.text});
    }
  }
  for (const std::vector<ProfileRow>& column : columns) {
    for (std::size_t i = 0; i < keys.size(); ++i) {
      const auto row = std::ranges::find(column, keys[i], &ProfileRow::key);
      const bool has_value = row != column.end() && row->simulation;
      table.rows[i].push_back(has_value ? fmt::format("{:.4g}", *row->simulation) : "-");
    }
  }
  return table;
}

// Section on one drive.
namespace {

/// More poses would not be distinguishable in a figure.
constexpr std::size_t kMaxDrawnPoses = 3000;

template <class Pose>
Trajectory thin(const std::vector<Pose>& poses) {
  const std::size_t step = poses.size() / kMaxDrawnPoses + 1;
  Trajectory kept;
  for (std::size_t i = 0; i < poses.size(); i += step) kept.push_back({poses[i].stamp, poses[i].map_T_base});
  return kept;
}

/// Tags in the map that the robot used, read from the recording. Empty if it contains no map.
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
  rows.push_back({"distance, by odometry", fmt::format("{:.2f} m", metres)});
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
  rows.push_back({"tags observed", std::to_string(seen.size())});
  rows.push_back(
      {"frames with two or more tags",
       fmt::format("{:.1f} %", 100 * static_cast<double>(with_two) / static_cast<double>(frames.size()))});
}

void add_scores(const DriveRun& drive, Rows& rows) {
  const TrajectoryScoreOptions options;
  const auto pairs = pair_by_time(drive.estimate, drive.lap.truth,
                                  Duration(static_cast<std::int64_t>(options.max_gap_s * 1e9)));
  const Result<TrajectoryScores> scores = score_trajectory(pairs, AlignmentKind::None, options);
  if (!scores) return;
  rows.push_back({"position error, RMSE", fmt::format("{:.4f} m", scores->ate_m.rmse)});
  rows.push_back({"position error, maximum", fmt::format("{:.4f} m", scores->ate_m.max)});
  rows.push_back({"heading error, RMSE", fmt::format("{:.2f} deg", scores->heading_deg.rmse)});
  rows.push_back({"jumps", std::to_string(scores->jumps)});
  if (scores->consistency && scores->consistency->count > 0)
    rows.push_back({"NEES (x, y, yaw; expected: 3)", fmt::format("{:.2f}", scores->consistency->nees_mean)});
}

/// Dead reckoning that starts at the first pose of the ground truth or, without one, of the estimate. If
/// neither is available, it starts at the origin.
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
      {"odometry", placed_odometry(drive), {}, plot::kOdometryColor},
      {"estimate", thin(drive.estimate), tags_of(drive), plot::kEstimateColor}};
  return {.name = "floor",
          .figure = plot::path_figure("Seen from above", layers),
          .caption = "The odometry starts at the first pose of the robot."};
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
        {"speed", plot::speed_figure("Speed", drive.lap.odometry), "From wheel odometry."});
  if (!drive.lap.frames.empty())
    section.figures.push_back({"tags_in_view", plot::tags_in_view_figure("Tags in view", drive.lap.frames),
                               "With fewer than two tags the position is uncertain."});
  if (drive.estimate.empty()) return section;
  section.figures.push_back(
      {"error",
       plot::error_and_uncertainty_figure("Error and its standard deviation", drive.estimate,
                                          drive.lap.truth),
       "The error of a consistent estimate is below twice its standard deviation about 19 times out of 20."});
  if (!drive.lap.truth.empty())
    section.figures.push_back(
        {"heading", plot::heading_error_figure("Heading error", drive.estimate, drive.lap.truth), ""});
  return section;
}

// Section on one map.
namespace {

std::string millimetres(double metres) { return fmt::format("{:.1f}", 1000 * metres); }

/// Standard deviation of the tag centre in the direction in which it is largest.
std::string sigma_mm(const MappedTag& tag) {
  if (!tag.covariance) return "-";
  const double variance_m2 = symmetric_eigenvalues<3>(tag.covariance->topLeftCorner<3, 3>())[2];
  return millimetres(std::sqrt(std::max(0.0, variance_m2)));
}

/// Data from the lap with which a map was made, used to evaluate the map.
struct LapEvidence {
  std::optional<World> world{};
  std::optional<MappedLap> chain{};  ///< the map before optimisation
  std::map<TagId, TagReprojection> residuals{};
};

/// Residuals are only computed for the first camera.
std::vector<TagFrame> frames_of_first_camera(const RecordedLap& lap) {
  std::vector<TagFrame> frames = lap.frames;
  std::erase_if(frames, [&](const TagFrame& frame) {
    const auto& others = lap.setup.more_cameras;
    return std::ranges::find(others, frame.camera, &MountedCamera::name) != others.end();
  });
  return frames;
}

LapEvidence evidence_of(const MapRun& run, const DriveRun& drive, const JobControl& control) {
  LapEvidence evidence;
  if (Result<std::optional<World>> world = true_world(drive.lap); world) evidence.world = std::move(*world);
  const auto& setup = drive.lap.setup;
  if (setup.camera && setup.base_T_cam)
    evidence.residuals = tag_reprojection(frames_of_first_camera(drive.lap), run.map.tags, run.trajectory,
                                          *setup.camera, *setup.base_T_cam);
  const Result<TeachSetup> teach = setup_of(drive.lap, {});
  if (!teach) return evidence;
  control.progress({"chaining the tags in " + drive.file});
  Result<MappedLap> chain =
      map_lap({drive.lap.frames, drive.lap.odometry}, *teach, {.method = MapMethod::Chain});
  if (chain) evidence.chain = std::move(*chain);
  return evidence;
}

plot::PageTable tag_table(const MapRun& run, const LapEvidence& evidence) {
  plot::PageTable table{.caption = "Tags",
                        .head = {"tag", "x [m]", "y [m]", "z [m]", "size [m]", "observations", "sigma [mm]",
                                 "residual [px]", "worst [px]", "distances [m]", "error [mm]"}};
  for (const auto& [id, tag] : run.map.tags.tags) {
    const Eigen::Vector3d& p = tag.map_T_tag.translation();
    const auto seen = run.map.observations.find(id);
    const auto residual = evidence.residuals.find(id);
    const bool known = residual != evidence.residuals.end();
    const MappedTag* truth = evidence.world ? evidence.world->tags.find(id) : nullptr;
    table.rows.push_back(
        {to_string(id), fmt::format("{:.3f}", p.x()), fmt::format("{:.3f}", p.y()),
         fmt::format("{:.3f}", p.z()), fmt::format("{:.3f}", tag.size_m),
         seen == run.map.observations.end() ? "-" : std::to_string(seen->second), sigma_mm(tag),
         known ? fmt::format("{:.2f}", residual->second.rms_px) : "-",
         known ? fmt::format("{:.2f}", residual->second.largest_px) : "-",
         known ? fmt::format("{:.1f} to {:.1f}", residual->second.nearest_m, residual->second.farthest_m)
               : "-",
         truth == nullptr ? "-" : millimetres((p - truth->map_T_tag.translation()).norm())});
  }
  return table;
}

std::vector<std::string> error_row(const char* name, const TagMap& map, const Trajectory& trajectory,
                                   const LapEvidence& evidence, const Trajectory& truth) {
  const TagMapErrors tags = tag_map_errors(map, evidence.world->tags);
  const TrajectoryErrors of_path = trajectory_errors(trajectory, truth);
  return {name,
          millimetres(tags.rmse_m),
          millimetres(tags.max_m),
          fmt::format("{:.3f}", tags.orientation_rmse_deg),
          millimetres(of_path.rmse_m),
          millimetres(of_path.max_m)};
}

/// Whether the map and the world have the same frame, judging by the anchor.
bool same_frame(const MapRun& run, const LapEvidence& evidence) {
  const MappedTag* truth = evidence.world ? evidence.world->tags.find(run.map.anchor) : nullptr;
  const MappedTag* mapped = run.map.tags.find(run.map.anchor);
  return truth != nullptr && mapped != nullptr && in_frame_of_truth(mapped->map_T_tag, truth->map_T_tag);
}

void add_before_and_after(const MapRun& run, const DriveRun& drive, const LapEvidence& evidence,
                          plot::PageSection& section) {
  if (!evidence.chain) return;
  const bool truth = same_frame(run, evidence);
  if (truth) {
    section.tables.push_back(
        {.caption = "Errors relative to ground truth, in the frame of the anchor, not aligned",
         .head = {"", "tags, RMSE [mm]", "worst [mm]", "rotation [deg]", "trajectory, RMSE [mm]",
                  "worst [mm]"},
         .rows = {error_row("before (chain)", evidence.chain->map, evidence.chain->trajectory, evidence,
                            drive.lap.truth),
                  error_row("after", run.map.tags, run.trajectory, evidence, drive.lap.truth)}});
  }
  std::vector<plot::PathLayer> layers;
  if (truth) layers.push_back({"truth", drive.lap.truth, evidence.world->tags, plot::kTruthColor});
  layers.push_back({"before (chain)", evidence.chain->trajectory, evidence.chain->map, plot::kTaughtColor});
  layers.push_back({"after", run.trajectory, run.map.tags, plot::kEstimateColor});
  section.figures.push_back({"before_after", plot::path_figure("Before and after optimisation", layers),
                             "The chain connects tags observed in the same frame; the optimised map jointly "
                             "fits all corners, wheel odometry and the floor."});
}

}  // namespace

plot::PageSection map_section(const MapRun& run, const DriveRun* drive, const JobControl& control) {
  plot::PageSection section{.title = (run.folder / "map.yaml").string()};
  plot::PageTable facts{
      .rows = {{"tags", std::to_string(run.map.tags.tags.size())}, {"anchor", to_string(run.map.anchor)}}};
  for (const auto& [key, value] : run.map.provenance) {
    if (!key.starts_with("content"))
      facts.rows.push_back({key, value});  // hashes, by which a lap is recognised
  }
  if (run.route)
    facts.rows.push_back(
        {"route", fmt::format("{:.2f} m, {}", run.route->length_m, run.route->closed ? "closed" : "open")});
  section.tables.push_back(std::move(facts));
  const LapEvidence evidence = drive != nullptr ? evidence_of(run, *drive, control) : LapEvidence{};
  if (drive == nullptr)
    section.words.emplace_back(
        "The recording of this map was not given, so residuals and the comparison are missing.");
  if (drive != nullptr) add_before_and_after(run, *drive, evidence, section);
  section.tables.push_back(tag_table(run, evidence));
  const std::vector<plot::PathLayer> layers = {{"map", run.trajectory, run.map.tags, plot::kEstimateColor}};
  section.figures.push_back({"map", plot::path_figure("Map", layers), ""});
  if (drive != nullptr && same_frame(run, evidence) && !run.trajectory.empty())
    section.figures.push_back(
        {"map_error",
         plot::trajectory_error_figure("Error of the mapped trajectory", run.trajectory, drive->lap.truth),
         ""});
  return section;
}

// Comparison of drives on the same route.
namespace {

/// Hull of the robot that made the drive, used for the clearance. A point if unknown.
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

/// The driven trajectory: ground truth if available, else the estimate. Empty if neither is known.
struct DrivenTrajectory {
  Trajectory poses{};
  bool truth = false;
};

DrivenTrajectory driven_trajectory(const DriveRun& drive) {
  if (!drive.lap.truth.empty()) return {drive.lap.truth, true};
  DrivenTrajectory driven;
  for (const EstimatedPose& pose : drive.estimate) driven.poses.push_back({pose.stamp, pose.map_T_base});
  return driven;
}

std::string name_of(const DriveRun& drive, const DrivenTrajectory& driven) {
  return driven.truth ? drive.file : drive.file + " (estimate)";
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
  DrivenTrajectory first_driven;
  plot::PageSection section{.title = "Drives compared"};
  section.tables.push_back(side_by_side(runs));
  if (plot::PageTable sensors = sensors_side_by_side(runs); !sensors.rows.empty())
    section.tables.push_back(std::move(sensors));
  plot::PageTable table{.head = {"drive", "distance [m]", "laps", "cross-track RMSE [mm]", "95 % [mm]",
                                 "worst [mm]", "heading RMSE [deg]", "tag clearance [m]"}};
  std::vector<plot::PathLayer> layers;
  for (const DriveRun& drive : runs.drives) {
    DrivenTrajectory driven = driven_trajectory(drive);
    if (driven.poses.empty()) continue;
    if (first == nullptr) {
      first = &drive;
      first_driven = std::move(driven);
      layers.push_back(
          {name_of(drive, first_driven), first_driven.poses, true_tags(drive), plot::kTruthColor});
      continue;
    }
    const std::string name = name_of(drive, driven);
    const Result<ReplayJudgement> judged =
        judge_replay(driven.poses, first_driven.poses, true_tags(*first), hull_of(*first));
    if (!judged) {
      section.words.push_back(fmt::format("{}: {}", name, to_string(judged.error())));
      continue;
    }
    table.rows.push_back(row(name, *judged));
    const auto color = plot::kPalette[layers.size() % std::size(plot::kPalette)];
    layers.push_back({name, driven.poses, {}, color});
    section.figures.push_back(
        {fmt::format("cross_track_{}", layers.size() - 1),
         plot::cross_track_figure(name + " relative to " + name_of(*first, first_driven), driven.poses,
                                  first_driven.poses),
         ""});
  }
  if (!table.rows.empty()) {
    table.caption = "Compared with the trajectory of " + name_of(*first, first_driven) +
                    ": ground truth, unless marked as an estimate";
    section.tables.push_back(std::move(table));
  }
  if (layers.size() > 1)
    section.figures.insert(
        section.figures.begin(),
        plot::PageFigure{"drives", plot::path_figure("Taught and repeated trajectories", layers), ""});
  return section;
}

// The whole page.
namespace {

Status add_drive(const std::string& file, Runs& runs, const JobControl& control) {
  Result<RecordedLap> lap = read_lap_file(file, control);
  if (!lap) {
    Error error = lap.error();
    if (error.place.source.empty()) error.place.source = file;
    return tl::unexpected(std::move(error));
  }
  for (const Error& problem : lap->setup.problems) runs.warnings.push_back(file + ": " + to_string(problem));
  DriveRun drive{.file = file, .lap = std::move(*lap)};
  if (Result<EstimatedTrajectory> estimate = read_estimate(file, topics::kEstimate, control); estimate)
    drive.estimate = std::move(*estimate);
  if (Result<RecordingProfile> profile = profile_of(file, silent(control)); profile)
    drive.profile = std::move(*profile);
  runs.drives.push_back(std::move(drive));
  return {};
}

Status add_map(const fs::path& folder, Runs& runs) {
  Result<MapFile> map = read_map(folder / "map.yaml");
  if (!map) return tl::unexpected(map.error());
  MapRun run{.folder = folder, .map = std::move(*map)};
  std::error_code ignored;
  if (fs::exists(folder / "route.yaml", ignored)) {
    Result<Route> route = read_route(folder / "route.yaml");
    if (!route) return tl::unexpected(route.error());
    run.route = std::move(*route);
  }
  if (fs::exists(folder / "trajectory.txt", ignored)) {
    Result<Trajectory> trajectory = read_trajectory(folder / "trajectory.txt");
    if (!trajectory) return tl::unexpected(trajectory.error());
    run.trajectory = std::move(*trajectory);
  }
  runs.maps.push_back(std::move(run));
  return {};
}

/// The recordings in a folder in the order they were made, oldest first.
std::vector<std::string> recordings_in(const fs::path& folder) {
  std::vector<std::pair<fs::file_time_type, std::string>> found;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    if (entry.is_regular_file(error) && is_recording(kind_of(entry.path())))
      found.emplace_back(entry.last_write_time(error), entry.path().string());
  }
  std::ranges::sort(found);
  std::vector<std::string> files;
  files.reserve(found.size());
  for (auto& [time, file] : found) files.push_back(std::move(file));
  return files;
}

Status add_folder(const fs::path& folder, Runs& runs, const JobControl& control) {
  std::error_code ignored;
  const std::size_t before = runs.drives.size() + runs.maps.size();
  for (const fs::path& place : {folder, folder / "map"}) {
    if (!fs::exists(place / "map.yaml", ignored)) continue;
    if (Status status = add_map(place, runs); !status) return status;
  }
  for (const std::string& file : recordings_in(folder)) {
    if (Status status = control.go_on(); !status) return status;
    if (Status status = add_drive(file, runs, control); !status) return status;
  }
  if (runs.drives.size() + runs.maps.size() > before) return {};
  return fail(ErrorCode::NotFound, "the folder contains neither a recording nor a map",
              {.source = folder.string()},
              "Give a folder written by `waymark demo` or `waymark map`, or recordings.");
}

/// A report may replace an older report, but no other file unless `force` is set.
Status check_output(const fs::path& output, bool force) {
  const std::string suffix = output.extension().string();
  if (suffix != ".html" && suffix != ".htm")
    return fail(ErrorCode::InvalidArgument, "the file name of a report must end in .html or .htm",
                {.source = output.string(), .key = "`output`"});
  std::error_code ignored;
  if (!force && fs::is_regular_file(output, ignored)) {
    std::string head(4096, '\0');
    std::ifstream(output, std::ios::binary).read(head.data(), static_cast<std::streamsize>(head.size()));
    if (head.find(plot::kPageMark) == std::string::npos)
      return fail(ErrorCode::Unwritable, "the file already exists and was not written by `waymark report`",
                  {.source = output.string()},
                  "Choose another `output`, or set `force` to replace the file.");
  }
  return check_output_file(output);
}

}  // namespace

Result<Runs> read_runs(const std::vector<std::string>& paths, const JobControl& control) {
  Runs runs;
  for (const std::string& path : paths) {
    std::error_code ignored;
    Status status = control.go_on();
    if (!status) return tl::unexpected(status.error());
    if (fs::is_directory(path, ignored))
      status = add_folder(path, runs, control);
    else if (kind_of(path) == FileKind::Map && fs::path(path).filename() == "map.yaml")
      status = add_map(fs::path(path).parent_path(), runs);
    else
      status = add_drive(path, runs, control);
    if (!status) return tl::unexpected(status.error());
  }
  return runs;
}

const DriveRun* drive_of(const MapRun& map, const Runs& runs) {
  const auto& provenance = map.map.provenance;
  const auto named = std::ranges::find(provenance, "recording", &std::pair<std::string, std::string>::first);
  if (named == provenance.end()) return nullptr;
  const auto made_of = [&](const DriveRun& drive) {
    return fs::path(drive.file).filename().string() == named->second;
  };
  const auto drive = std::ranges::find_if(runs.drives, made_of);
  return drive == runs.drives.end() ? nullptr : &*drive;
}

Result<plot::Page> report_page(const Runs& runs, const JobControl& control) {
  plot::Page page{.title = "Waymark report"};
  for (const DriveRun& drive : runs.drives) {
    plot::PageSection section = drive_section(drive);
    if (!section.figures.empty()) page.sections.push_back(std::move(section));
  }
  for (const MapRun& map : runs.maps) page.sections.push_back(map_section(map, drive_of(map, runs), control));
  if (auto section = comparison_section(runs)) page.sections.push_back(std::move(*section));
  if (page.sections.empty())
    return fail(ErrorCode::NotFound, "these files contain no tags, odometry or poses to draw", {},
                "`waymark info FILE` lists the contents of a recording.");
  page.subtitle = fmt::format("{}, {}. Ground truth green, odometry blue, estimate red.",
                              counted(runs.drives.size(), "drive"), counted(runs.maps.size(), "map"));
  return page;
}

Result<std::string> html_of(const plot::Page& page, const JobControl& control) {
  const Result<std::string> html = plot::to_html(page);
  return html ? Result<std::string>(control.for_users(*html)) : html;
}

Result<ReportSummary> write_report(const std::vector<std::string>& paths, const fs::path& output, bool force,
                                   const JobControl& control) {
  if (Status status = check_output(output, force); !status) return tl::unexpected(status.error());
  const Result<Runs> runs = read_runs(paths, control);
  if (!runs) return tl::unexpected(runs.error());
  for (const std::string& warning : runs->warnings) control.note("warning: " + warning);
  const Result<plot::Page> page = report_page(*runs, control);
  const Result<std::string> html = page ? html_of(*page, control) : tl::unexpected(page.error());
  if (!html) return tl::unexpected(html.error());
  if (Status status = control.go_on(); !status) return tl::unexpected(status.error());
  if (Status status = write_text_file(output, *html); !status) return tl::unexpected(status.error());
  return ReportSummary{.sections = page->sections.size(), .bytes = html->size()};
}

std::vector<plot::PageFigure> figures_of(const plot::Page& page) {
  std::vector<plot::PageFigure> figures;
  std::map<std::string, int> taken;
  for (const plot::PageSection& section : page.sections) {
    for (plot::PageFigure figure : section.figures) {
      figure.caption = section.title;
      if (const int number = ++taken[figure.name]; number > 1) figure.name += fmt::format("_{}", number);
      figures.push_back(std::move(figure));
    }
  }
  return figures;
}

}  // namespace waymark
