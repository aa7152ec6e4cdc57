#include "waymark/app/world/world_from_recording.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include "waymark/app/common/file_kind.hpp"
#include "waymark/app/common/lap_input.hpp"
#include "waymark/app/common/output_files.hpp"
#include "waymark/app/common/profile_table.hpp"
#include "waymark/app/common/replay_setup.hpp"
#include "waymark/app/common/shell_word.hpp"
#include "waymark/base/order_statistics.hpp"
#include "waymark/config/exchange/trajectory_file.hpp"
#include "waymark/config/share.hpp"
#include "waymark/config/text_file.hpp"
#include "waymark/config/yaml/robot_file.hpp"
#include "waymark/config/yaml/world_file.hpp"
#include "waymark/evaluation/motion_blur.hpp"
#include "waymark/evaluation/pose_pairs.hpp"
#include "waymark/evaluation/recording_profile.hpp"
#include "waymark/recording/message_log.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;

/// A drive and the map made from it.
struct MappedDrive {
  MapFolder place{};
  RobotDescription robot;
  Trajectory trajectory{};  ///< trajectory stored with the map
  RecordedLap lap{};
  RecordingProfile profile{};
};

Result<RobotDescription> robot_of(const MapFolder& place, const WorldFromRecordingJob& job) {
  if (!job.robot.empty()) {
    const auto path = find_shared("robots", job.robot, "robot");
    return path ? or_wrong_kind(read_robot(*path), *path, FileUse::Robot) : tl::unexpected(path.error());
  }
  if (place.robot) return *place.robot;
  return fail(ErrorCode::NotFound, "the map folder contains no robot.yaml", {.source = job.map.string()},
              "Set `robot` to a .yaml file, or to a name that `waymark robots` lists.");
}

/// Distances [px] between the observed tag centres and those projected using the map and the trajectory. They
/// are infinite for tags that are not in the map or cannot be projected.
std::vector<double> observation_errors_px(const MappedDrive& drive) {
  constexpr Duration kMaxGap = std::chrono::milliseconds(500);
  std::vector<double> errors_px;
  for (const TagFrame& frame : drive.lap.frames) {
    const auto map_T_base = pose_at(drive.trajectory, frame.stamp, kMaxGap);
    if (!map_T_base) continue;
    const SE3 cam_T_map = (*map_T_base * drive.robot.model.base_T_cam).inverse();
    for (const TagDetection& seen : frame.detections) {
      if (!usable_corners(seen)) continue;
      const MappedTag* tag = drive.place.map.tags.find(seen.tag);
      const auto expected = tag == nullptr
                                ? std::nullopt
                                : drive.robot.camera.project(cam_T_map * tag->map_T_tag.translation());
      const Eigen::Vector2d middle =
          (seen.corners_px[0] + seen.corners_px[1] + seen.corners_px[2] + seen.corners_px[3]) / 4;
      errors_px.push_back(expected ? (*expected - middle).norm() : std::numeric_limits<double>::infinity());
    }
  }
  return errors_px;
}

/// Fails if the map and the trajectory are from a different drive. This is the case if the trajectory covers
/// a different time, or if the observed tags do not match the map. For recorded tag poses, which have no
/// pixel positions, only the time is checked.
Status check_place(const MappedDrive& drive, const WorldFromRecordingJob& job) {
  const auto mismatch = [&](const char* why) {
    return fail(ErrorCode::InvalidArgument, fmt::format("the map was not made from this recording: {}", why),
                {.source = job.recording},
                fmt::format("Make a map: waymark map {} -o map", shell_word(job.recording)));
  };
  const auto within_trajectory = [&](const auto& frame) {
    return !drive.trajectory.empty() && frame.stamp >= drive.trajectory.front().stamp &&
           frame.stamp <= drive.trajectory.back().stamp;
  };
  if (std::ranges::none_of(drive.lap.frames, within_trajectory) &&
      std::ranges::none_of(drive.lap.tag_poses, within_trajectory))
    return mismatch("its trajectory covers a different time");
  std::vector<double> errors_px = observation_errors_px(drive);
  const double max_error_px = 0.05 * drive.robot.camera.width_px();
  if (!errors_px.empty() && !(median(std::move(errors_px)) < max_error_px))
    return mismatch("its tags are inconsistent with the observations");
  return {};
}

Result<MappedDrive> read_drive(const WorldFromRecordingJob& job, const JobControl& control) {
  Result<MapFolder> place = read_map_folder(job.map);
  if (!place) return tl::unexpected(place.error());
  Result<RobotDescription> robot = robot_of(*place, job);
  if (!robot) return tl::unexpected(robot.error());
  Result<Trajectory> trajectory = read_trajectory(job.map / "trajectory.txt");
  if (!trajectory) return tl::unexpected(trajectory.error());
  Result<RecordedLap> lap = read_lap_file(job.recording, control);
  if (!lap) return tl::unexpected(lap.error());
  Result<RecordingProfile> profile = profile_of(job.recording, control);
  if (!profile) return tl::unexpected(profile.error());
  MappedDrive drive{std::move(*place), std::move(*robot), std::move(*trajectory), std::move(*lap),
                    std::move(*profile)};
  if (Status status = check_place(drive, job); !status) return tl::unexpected(status.error());
  return drive;
}

/// The map on a level floor at z = 0, with its route as the line to drive.
Result<World> world_of(const MappedDrive& drive, const std::string& name) {
  World world{.name = name, .anchor = drive.place.map.anchor, .path_closed = drive.place.route.closed};
  const SE3 floor_T_map = map_T_floor(drive.place.map.tags.floor).inverse();
  for (const auto& [id, tag] : drive.place.map.tags.tags) {
    if (id.family != world.anchor.family)
      return fail(
          ErrorCode::Unsupported,
          fmt::format(
              "{} is not from the anchor's family; all tags in a simulated world must be from one family",
              to_string(id)),
          {.source = drive.place.path.string()});
    world.tags.tags[id] = {.map_T_tag = floor_T_map * tag.map_T_tag, .size_m = tag.size_m};
  }
  constexpr double kPointEvery_m = 0.15;
  double next_m = 0;
  for (const RoutePoint& point : drive.place.route.points) {
    if (point.arc_length_m < next_m) continue;
    const Eigen::Vector2d& at = point.map_T_base.translation();
    world.path_m.emplace_back(
        (floor_T_map * Eigen::Vector3d(at.x(), at.y(), drive.place.map.tags.floor.z_m)).head<2>());
    next_m = point.arc_length_m + kPointEvery_m;
  }
  return world;
}

/// Data from the recording that are not in RecordedLap.
struct Remaining {
  std::vector<StampedCommand> commands{};
  std::vector<EdgeBlur> edges{};
};

Result<Remaining> read_remaining(const WorldFromRecordingJob& job, const std::vector<TagFrame>& frames,
                                 const JobControl& control) {
  const auto log = open_recording(job.recording, control);
  if (!log) return tl::unexpected(log.error());
  Remaining rest;
  const Status status = (*log)->visit_samples({}, [&](const Sample& sample) -> Status {
    if (Status wanted = control.go_on(); !wanted) return wanted;
    if (const auto* command = std::get_if<StampedCommand>(&sample)) rest.commands.push_back(*command);
    const auto* taken = std::get_if<CameraFrame>(&sample);
    if (taken == nullptr) return {};
    const auto frame = std::ranges::lower_bound(frames, taken->stamp, {}, &TagFrame::stamp);
    if (frame == frames.begin() || frame == frames.end() || std::next(frame) == frames.end()) return {};
    if (frame->stamp != taken->stamp || frame->camera != taken->camera) return {};
    const auto some = edge_blurs(taken->image, *std::prev(frame), *frame, *std::next(frame));
    rest.edges.insert(rest.edges.end(), some.begin(), some.end());
    return {};
  });
  if (!status) return tl::unexpected(status.error());
  return rest;
}

/// Stores estimated values in the robot's simulation options and lists them in the report.
class RobotEstimates {
 public:
  explicit RobotEstimates(WorldFromRecordingReport& report) : report_(report) {}

  void add(const std::string& key, const std::string& description, std::optional<double> value,
           double& option, double low, double high) {
    if (value) {
      value = std::clamp(*value, low, high);
      option = *value;
    }
    report_.quantities.push_back({"simulation." + key, description, value});
  }

 private:
  WorldFromRecordingReport& report_;
};

/// The rotation scale that makes the simulated odometry turn like the recorded odometry.
std::optional<double> rotation_scale(const SimulatedRobotOptions& robot, std::optional<double> yaw_scale) {
  if (!yaw_scale || robot.sensors.odometry == "truth") return std::nullopt;
  return (robot.sensors.odometry == "wheels" ? robot.dynamics.turn_gain : 1.0) / *yaw_scale;
}

/// Sets the simulation options of `robot` and lists the estimated quantities in the report.
void estimate_robot(const MappedDrive& drive, const Remaining& rest, SimulatedRobotOptions& robot,
                    WorldFromRecordingReport& report) {
  constexpr double kRangeQuantile = 0.995;
  const RecordingProfile& profile = drive.profile;
  robot = options_like(profile, robot);
  for (const ProfileRow& row : profile_table(profile, profile))
    report.quantities.push_back({row.key, row.text, row.recording});
  RobotEstimates estimates(report);
  estimates.add("tag_camera.max_range_m", "detection range [m]",
                observation_distance_m(drive.lap.frames, drive.place.map.tags, drive.robot.model.base_T_cam,
                                       drive.trajectory, kRangeQuantile),
                robot.tag_camera.max_range_m, 0.1, 1000);
  estimates.add("dynamics.turn_gain", "true / commanded yaw rate",
                turn_response(rest.commands, drive.trajectory, profile.command_delay_s.value_or(0)),
                robot.dynamics.turn_gain, 0.05, 2);
  const Calibration odometry = drive.place.odometry.value_or(Calibration{});
  const auto inverse = [](std::optional<double> value) { return value ? std::optional(1 / *value) : value; };
  const auto scale = inverse(odometry.observable_value("odometry_scale"));
  estimates.add("sensors.left_wheel_scale", "measured / true distance, left wheels", scale,
                robot.sensors.left_wheel_scale, 0.5, 2);
  estimates.add("sensors.right_wheel_scale", "measured / true distance, right wheels", scale,
                robot.sensors.right_wheel_scale, 0.5, 2);
  estimates.add("sensors.rotation_scale", "measured / true rotation of the odometry",
                rotation_scale(robot, odometry.observable_value("yaw_scale")), robot.sensors.rotation_scale,
                0.1, 10);
  estimates.add("dynamics.lateral_slip_s", "lateral velocity per speed and yaw rate [s]",
                odometry.observable_value("side_slip_s"), robot.dynamics.lateral_slip_s, -1, 1);
}

std::string camera_settings(const BlurFit& fit) {
  return fmt::format(
      "# Estimated from the blur of {} tag edges. Use with --config of teach, replay and demo.\n"
      "camera: {{exposure_ms: {:.2f}, lens_sigma_px: {:.2f}}}\n",
      fit.edges, 1e3 * fit.exposure_s, fit.still_sigma_px);
}

Status write_files(const WorldFromRecordingJob& job, const RobotDescription& robot,
                   const std::optional<BlurFit>& blur, WorldFromRecordingReport& report) {
  Result<StagedFolder> folder = StagedFolder::open(job.folder);
  if (!folder) return tl::unexpected(folder.error());
  std::vector<std::pair<std::string, std::string>> files = {{"world.yaml", to_yaml(report.world)},
                                                            {"robot.yaml", to_yaml(robot)}};
  if (blur) files.emplace_back("camera.yaml", camera_settings(*blur));
  for (const auto& [name, text] : files) {
    if (Status status = write_text_file(folder->path() / name, text); !status)
      return folder->failed(status.error());
    report.files.push_back(name);
  }
  const auto moved = folder->put_in_place({});
  return moved ? Status() : tl::unexpected(moved.error());
}

}  // namespace

Result<WorldFromRecordingReport> world_from_recording(const WorldFromRecordingJob& job,
                                                      const JobControl& control) {
  if (Status status = check_new_folder(job.folder); !status) return tl::unexpected(status.error());
  const Result<MappedDrive> drive = read_drive(job, control);
  if (!drive) return tl::unexpected(drive.error());
  Result<World> world = world_of(*drive, fs::path(job.recording).stem().string());
  if (!world) return tl::unexpected(world.error());
  const Result<Remaining> rest = read_remaining(job, drive->lap.frames, control);
  if (!rest) return tl::unexpected(rest.error());
  WorldFromRecordingReport report{.world = std::move(*world)};
  RobotDescription robot = drive->robot;
  for (const Error& problem : drive->lap.setup.problems) report.warnings.push_back(to_string(problem));
  estimate_robot(*drive, *rest, robot.simulation, report);
  const std::optional<BlurFit> blur = fit_exposure(rest->edges);
  report.quantities.push_back({"camera.exposure_ms", "exposure time, from the blur of tag edges [ms]",
                               blur ? std::optional(1e3 * blur->exposure_s) : std::nullopt});
  report.quantities.push_back({"camera.lens_sigma_px", "blur of the lens [px]",
                               blur ? std::optional(blur->still_sigma_px) : std::nullopt});
  if (Status status = control.go_on(); !status) return tl::unexpected(status.error());
  if (Status status = write_files(job, robot, blur, report); !status) return tl::unexpected(status.error());
  return report;
}

std::string to_text(const WorldFromRecordingReport& report, const fs::path& folder) {
  std::string text =
      fmt::format("{}: {} tags, {} of {} points\n", folder.string(), report.world.tags.tags.size(),
                  report.world.path_closed ? "a closed line" : "an open line", report.world.path_m.size());
  for (const RecordedQuantity& quantity : report.quantities)
    text += fmt::format("{:<46}{:>12}\n", quantity.text,
                        quantity.value ? fmt::format("{:.4g}", *quantity.value) : "not determined");
  const bool camera = std::ranges::find(report.files, "camera.yaml") != report.files.end();
  const auto file = [&](const char* name) { return shell_word((folder / name).string()); };
  return text + fmt::format("Drive in it: waymark teach --world {} --robot-file {}{} -o sim.mcap\n",
                            file("world.yaml"), file("robot.yaml"),
                            camera ? " --images --config " + file("camera.yaml") : "");
}

ReportFields fields(const WorldFromRecordingReport& report) {
  ReportFields quantities;
  for (const RecordedQuantity& quantity : report.quantities)
    quantities.push_back({quantity.key, {}, quantity.value});
  return {
      {"files", "Names of the files in the folder", report.files},
      {"tags", "Number of tags", report.world.tags.tags.size()},
      {"path_closed", "Whether the line is closed", report.world.path_closed},
      {"warnings", "Warnings about the recording and the map", report.warnings},
      {"quantities", "Value by key of `waymark simulate`, robot.yaml or camera.yaml; null if not determined",
       quantities}};
}

}  // namespace waymark
