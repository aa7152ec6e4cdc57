#include <algorithm>
#include <cmath>
#include <filesystem>
#include <variant>

#include "waymark/app/common/lap_input.hpp"
#include "waymark/app/common/robot_setup.hpp"
#include "waymark/app/localize/localize_log.hpp"
#include "waymark/base/angles.hpp"
#include "waymark/config/calibration_file.hpp"
#include "waymark/config/landmarks_file.hpp"
#include "waymark/config/robot_file.hpp"
#include "waymark/config/robot_motion_file.hpp"
#include "waymark/config/share.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/samples/camera_body.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;

bool is_observation(const Sample& sample) {
  return std::holds_alternative<TagFrame>(sample) || std::holds_alternative<TagPoseFrame>(sample) ||
         std::holds_alternative<RangeBearing>(sample);
}

bool is_wanted(const Sample& sample) {
  return is_observation(sample) || std::holds_alternative<Odometry>(sample) ||
         std::holds_alternative<ImuSample>(sample) || std::holds_alternative<TruthPose>(sample);
}

/// Tags of pictures, where a recording holds nothing else that was seen.
Status look_at_pictures(const std::string& path, const CameraChoice& frames, LocalizeInputs& inputs,
                        const JobControl& control) {
  Result<RecordedLap> lap = read_lap_files({path}, control, nullptr, frames);
  if (!lap) return tl::unexpected(lap.error());
  for (TagFrame& frame : lap->frames) inputs.samples.emplace_back(std::move(frame));
  return {};
}

Status read_log(const std::string& path, const CameraChoice& frames, LocalizeInputs& inputs,
                const JobControl& control) {
  const auto log = open_log(path, control.log_options());
  if (!log) return tl::unexpected(log.error());
  const Result<RecordingSetup> setup = (*log)->setup(frames);
  if (setup && setup->chosen.ambiguous) {
    Error error = *setup->chosen.ambiguous;
    error.place.source = path;
    return tl::unexpected(std::move(error));
  }
  bool seen = false;
  bool pictures = false;
  const LogSelection used = setup ? (*log)->topics_used(*setup) : LogSelection{};
  const Status status = (*log)->visit_samples(used, [&](Sample sample) -> Status {
    if (control.cancelled()) return fail(ErrorCode::Unreadable, "stopped", {.source = path});
    seen = seen || is_observation(sample);
    pictures = pictures || std::holds_alternative<CameraFrame>(sample);
    if (setup) turn_into_base(sample, setup->chosen);
    if (is_wanted(sample)) inputs.samples.push_back(std::move(sample));
    return {};
  });
  if (!status) return status;
  for (const LogProblem& problem : (*log)->problems()) {
    if (problem.kind == LogProblem::Kind::Damage) inputs.warnings.push_back(to_string(problem.error));
  }
  if (!seen && pictures) {
    if (Status looked = look_at_pictures(path, frames, inputs, control); !looked) return looked;
  }
  if (!setup) return {};
  for (const std::string& note : setup->chosen.notes) control.note("note: " + note);
  if (setup->camera || setup->base_T_cam || !setup->facts.frames.empty()) inputs.recorded = *setup;
  if (setup->camera) inputs.setup.sensor.camera = setup->camera;
  if (setup->base_T_cam) inputs.setup.sensor.base_T_sensor = *setup->base_T_cam;
  if (!setup->more_cameras.empty()) inputs.setup.sensor.more_cameras = setup->more_cameras;
  return {};
}

/// All of one drive: a robot counts its way once.
Status read_logs(const LocalizeJob& job, LocalizeInputs& inputs, const JobControl& control) {
  std::string with_odometry;
  for (const std::string& log : job.logs) {
    const auto before = static_cast<std::ptrdiff_t>(inputs.samples.size());
    if (Status status = read_log(log, job.frames, inputs, control); !status) return status;
    const bool moves = std::any_of(inputs.samples.begin() + before, inputs.samples.end(),
                                   [](const Sample& s) { return std::holds_alternative<Odometry>(s); });
    if (!moves) continue;
    if (!with_odometry.empty())
      return fail(ErrorCode::InvalidArgument, "two recordings with odometry, this one and " + with_odometry,
                  {.source = log}, "Several recordings must be of one drive; localise each drive by itself.");
    with_odometry = log;
  }
  return {};
}

Status read_robot_of(const LocalizeJob& job, LocalizeInputs& inputs) {
  std::string robot = job.robot;
  std::error_code ignored;
  const fs::path beside =
      (fs::is_directory(job.map, ignored) ? fs::path(job.map) : fs::path(job.map).parent_path()) /
      "robot.yaml";
  if (robot.empty() && !inputs.setup.sensor.camera && fs::exists(beside, ignored)) robot = beside.string();
  if (robot.empty()) return {};
  const auto path = find_shared("robots", robot);
  if (!path) return tl::unexpected(path.error());
  const Result<RobotDescription> description = read_robot(*path);
  if (!description) return tl::unexpected(description.error());
  for (std::string& words : disagreements(*description, inputs.recorded))
    inputs.warnings.push_back(std::move(words));
  inputs.setup.sensor = {description->camera, description->model.base_T_cam, description->more_cameras};
  const auto motion = read_robot_motion(*path);
  if (!motion) return tl::unexpected(motion.error());
  if (*motion) inputs.setup.filter.motion = **motion;
  return {};
}

}  // namespace

void take_calibrated(const Calibration& calibration, RiekfOptions& filter) {
  const auto take = [&](const char* name, double& value) {
    if (const auto known = calibration.known(name)) value = *known;
  };
  take("odometry_scale", filter.odometry_scale);
  take("yaw_gain", filter.yaw_gain);
  take("gyro_gain", filter.gyro_gain);
  take("gyro_bias_rad_s", filter.gyro_bias_rad_s);
  take("camera_latency_s", filter.camera_latency_s);
  take("readout_s", filter.camera_readout_s);
  take("corner_sigma_px", filter.corner_sigma_px);
  take("sight_scale", filter.sight_scale);
}

namespace {

Status read_calibration_of(const LocalizeJob& job, LocalizeInputs& inputs) {
  if (job.calibration.empty()) return {};
  const Result<Calibration> calibration = read_calibration(job.calibration);
  if (!calibration) return tl::unexpected(calibration.error());
  if (calibration->camera) inputs.setup.sensor.camera = calibration->camera;
  SE3& base_T_sensor = inputs.setup.sensor.base_T_sensor;
  if (inputs.planar_sensor) {
    const auto known = [&](const char* name, double given) {
      return calibration->known(name).value_or(given);
    };
    const SE2 given = project_to_plane(base_T_sensor);
    base_T_sensor = lift(SE2(known("mounting_x_m", given.x()), known("mounting_y_m", given.y()),
                             known("mounting_yaw_rad", given.yaw())));
  } else {
    base_T_sensor = calibrated_mounting(base_T_sensor, *calibration);
  }
  take_calibrated(*calibration, inputs.setup.filter);
  return {};
}

/// What cannot work is said before anything runs.
Status check_inputs(const LocalizeJob& job, LocalizeInputs& inputs) {
  const auto count = [&](auto is) { return std::ranges::count_if(inputs.samples, is); };
  if (inputs.samples.empty())
    return fail(ErrorCode::NotFound, "the recording holds nothing to localise with: no tags, no motion",
                {.source = job.logs.front()}, "`waymark info` shows what it holds.");
  inputs.observations = static_cast<std::size_t>(count(is_observation));
  if (inputs.observations == 0)
    return fail(ErrorCode::NotFound, "the recording holds no tags and no landmarks that were seen",
                {.source = job.logs.front()}, "`waymark info` shows what it holds.");
  const bool corners = count([](const Sample& s) { return std::holds_alternative<TagFrame>(s); }) > 0;
  if (corners && !inputs.setup.sensor.camera)
    return fail(ErrorCode::NotFound,
                "nobody says what the camera is like: not the recording, not the map's folder",
                {.source = job.logs.front()}, "Give --robot with a file that has a camera.");
  if (corners && job.robot.empty() && !inputs.recorded.base_T_cam && inputs.recorded.chosen.mounting_error) {
    Error error = *inputs.recorded.chosen.mounting_error;
    error.message = "the recording does not say where the camera sits: " + error.message;
    error.place.source = job.logs.front();
    return tl::unexpected(std::move(error));
  }
  if (corners && inputs.setup.tags.tags.empty())
    return fail(ErrorCode::InvalidArgument,
                "corners need a map with poses of tags, and this one has points only", {.source = job.map});
  return {};
}

/// What does not come from the recording or the robot: options and map.
Result<LocalizeInputs> read_map_of(const LocalizeJob& job) {
  LocalizeInputs inputs;
  if (!std::ranges::all_of(job.start, [](double x) { return std::isfinite(x); }))
    return fail(ErrorCode::InvalidArgument, "a place is three finite numbers", {.key = "--start"},
                "Give x y in metres and yaw in degrees.");
  if (!std::ranges::all_of(job.sensor_pose, [](double x) { return std::isfinite(x); }))
    return fail(ErrorCode::InvalidArgument, "a place is three finite numbers", {.key = "--sensor-pose"},
                "Give x y in metres and yaw in degrees.");
  inputs.setup.filter = job.filter;
  inputs.setup.anchor = job.anchor;
  inputs.setup.method = job.method;
  Result<LandmarksFile> map = read_landmarks(job.map, job.tag_size_m);
  if (!map) return tl::unexpected(map.error());
  inputs.setup.landmarks = std::move(map->landmarks);
  inputs.setup.tags = std::move(map->tags);
  const bool sizes_known = std::ranges::none_of(
      inputs.setup.tags.tags, [&](const auto& tag) { return tag.second.size_m == job.tag_size_m; });
  if (job.tag_size_m && (sizes_known || map->format == "waymark"))
    inputs.warnings.emplace_back(
        "--tag-size-m is not used: the map says itself how large its tags are, or has points only");
  return inputs;
}

/// Mounting of a sensor in the plane, and the calibration over it.
Status take_mounting(const LocalizeJob& job, LocalizeInputs& inputs) {
  if (job.sensor_pose.size() == 3) {
    inputs.planar_sensor = true;
    inputs.setup.sensor.base_T_sensor =
        lift(SE2(job.sensor_pose[0], job.sensor_pose[1], to_radians(job.sensor_pose[2])));
  }
  return read_calibration_of(job, inputs);
}

}  // namespace

Result<LocalizeInputs> read_localize_inputs(const LocalizeJob& job, const RobotDescription& robot,
                                            const std::string& robot_yaml) {
  Result<LocalizeInputs> inputs = read_map_of(job);
  if (!inputs) return inputs;
  inputs->setup.sensor = {robot.camera, robot.model.base_T_cam, robot.more_cameras};
  const auto motion = parse_robot_motion(robot_yaml, robot.model.name + ".yaml");
  if (!motion) return tl::unexpected(motion.error());
  if (*motion) inputs->setup.filter.motion = **motion;
  if (Status status = take_mounting(job, *inputs); !status) return tl::unexpected(status.error());
  if (inputs->setup.tags.tags.empty())
    return fail(ErrorCode::InvalidArgument,
                "a camera needs a map with poses of tags, and this one has points only", {.source = job.map},
                "Give a map that `waymark map` made.");
  return inputs;
}

Result<LocalizeInputs> read_localize_inputs(const LocalizeJob& job, const JobControl& control) {
  Result<LocalizeInputs> read = read_map_of(job);
  if (!read) return read;
  LocalizeInputs& inputs = *read;
  Status status = read_logs(job, inputs, control);
  if (!status) return tl::unexpected(status.error());
  status = read_robot_of(job, inputs);
  if (status) status = take_mounting(job, inputs);
  if (status) status = check_inputs(job, inputs);
  if (!status) return tl::unexpected(status.error());
  const bool poses = std::ranges::any_of(
      inputs.samples, [](const Sample& s) { return std::holds_alternative<TagPoseFrame>(s); });
  if (poses && !inputs.planar_sensor && !inputs.setup.sensor.camera && job.robot.empty()) {
    // The axes of a camera that looks ahead from above the middle of the base: all that can be guessed.
    inputs.setup.sensor.base_T_sensor =
        SE3(body_R_optical(), inputs.setup.sensor.base_T_sensor.translation());
    inputs.mounting_guessed = true;
    inputs.warnings.emplace_back(
        "nobody says where the camera sits: taken as above the middle of the base (--robot says more)");
  }
  const bool ranges = std::ranges::any_of(
      inputs.samples, [](const Sample& s) { return std::holds_alternative<RangeBearing>(s); });
  if (ranges && job.sensor_pose.empty() && job.robot.empty() && job.calibration.empty()) {
    inputs.mounting_guessed = true;
    inputs.warnings.emplace_back(
        "nobody says where the sensor sits that measures ranges: taken as the middle of the base "
        "(--sensor-pose says more)");
  }
  std::ranges::stable_sort(inputs.samples, {}, stamp_of);
  return read;
}

}  // namespace waymark
