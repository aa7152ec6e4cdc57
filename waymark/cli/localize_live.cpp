#include "waymark/cli/localize_live.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>
#include <utility>

#include <fmt/format.h>
#include <CLI/App.hpp>
#include <CLI/Validators.hpp>
#include <nlohmann/json.hpp>

#include "waymark/base/angles.hpp"
#include "waymark/cli/console_control.hpp"
#include "waymark/cli/failure.hpp"
#include "waymark/cli/interrupt.hpp"
#include "waymark/cli/localize_camera.hpp"
#include "waymark/cli/options_flags.hpp"
#include "waymark/cli/setup_flags.hpp"
#include "waymark/cli/stop_request.hpp"
#include "waymark/jobs/json_line.hpp"
#include "waymark/jobs/localize_text.hpp"
#include "waymark/live/localize_robot.hpp"
#include "waymark/live/robot_kinds.hpp"

namespace waymark::cli {
namespace {

/// A robot's file beside the map goes before that of the kind.
Result<RobotSetup> setup_of(const LocalizeLiveFlags& flags, const LocalizeJob& job) {
  namespace fs = std::filesystem;
  std::error_code ignored;
  const fs::path map = job.map;
  const fs::path beside = (fs::is_directory(map, ignored) ? map : map.parent_path()) / "robot.yaml";
  std::string file = flags.robot_file;
  if (file.empty() && fs::exists(beside, ignored)) file = beside.string();
  auto setup = load_kind(job.robot, {}, file, 1);
  if (!setup || !*setup) return setup ? std::move(*setup) : tl::unexpected(Error{});
  if (Status added = add_live_cameras(flags.camera_sources, **setup); !added)
    return tl::unexpected(added.error());
  only_listen(**setup);
  return std::move(*setup);
}

std::string line_of(double since_s, const std::optional<LocalizationEstimate>& estimate) {
  if (!estimate)
    return fmt::format("{:8.1f} s: not known: no tags of the map were seen, or the robot is silent\n",
                       since_s);
  const SE2& pose = estimate->map_T_base;
  return fmt::format(
      "{:8.1f} s: x {:.3f} m, y {:.3f} m, heading {:.1f} deg, within {:.3f} m and {:.2f} deg{}\n", since_s,
      pose.x(), pose.y(), to_degrees(pose.yaw()), estimate->position_sigma_m(),
      to_degrees(std::sqrt(estimate->covariance(2, 2))), estimate->certain ? "" : ", a guess");
}

std::string json_of(SensorTime now, const std::optional<LocalizationEstimate>& estimate) {
  nlohmann::ordered_json json{{"now_s", to_seconds(now.time_since_epoch())}, {"pose", nullptr}};
  if (!estimate) return json_line(json);
  const SE2& pose = estimate->map_T_base;
  json["pose"] = {{"stamp_s", to_seconds(estimate->stamp.time_since_epoch())},
                  {"x_m", pose.x()},
                  {"y_m", pose.y()},
                  {"yaw_rad", pose.yaw()},
                  {"position_sigma_m", estimate->position_sigma_m()},
                  {"yaw_sigma_rad", std::sqrt(estimate->covariance(2, 2))},
                  {"certain", estimate->certain}};
  return json_line(json);
}

ExitCode show(const LocalizeRobotReport& report, const LocalizeJob& job, bool json, Console& console) {
  console.print(json ? json_line(to_json(job, report.localized)) : to_text(report.localized));
  for (const std::string& problem : report.localized.problems) console.say(problem);
  for (const std::string& doubt : doubts_about(report.localized)) console.say(doubt);
  if (report.end.interrupted) return ExitCode::Interrupted;
  return report.localized.certain > 0 ? ExitCode::Ok : ExitCode::SomeFailed;
}

ExitCode localize_a_robot(const LocalizeLiveFlags& flags, const LocalizeJob& job, bool json,
                          Console& console) {
  const Result<RobotSetup> setup = setup_of(flags, job);
  if (!setup) return fail_usage(setup.error(), console);
  const auto view = start_page(flags.view, *setup, console);
  if (!view) return fail_with(view.error(), console);
  std::optional<SensorTime> first;
  LocalizeRobotJob live{.localize = job, .images = flags.images, .feed = *view ? &(*view)->feed() : nullptr};
  live.session.report_every =
      std::chrono::duration_cast<Duration>(std::chrono::duration<double>(flags.every_s));
  if (flags.duration_s > 0) live.session.most_s = flags.duration_s;
  live.on_report = [&](SensorTime now, const std::optional<LocalizationEstimate>& estimate) {
    if (!first) first = now;
    console.print(json ? json_of(now, estimate) : line_of(to_seconds(now - *first), estimate));
  };
  JobControl control = control_from(console);
  control.cancelled = [&console] { return interrupted() || console.output_ended(); };
  const auto stop = hear_stop("localize " + job.robot, console);
  const Result<LocalizeRobotReport> report = localize_robot(*setup, live, control);
  if (!report) return fail_with(report.error(), console);
  return show(*report, job, json, console);
}

}  // namespace

void LocalizeLiveFlags::add_to(CLI::App& app) {
  app.add_option("--robot-file", robot_file,
                 std::string("With --robot KIND:ADDRESS: body and camera of the robot: ") + kRobotNames +
                     ". Unless given: robot.yaml beside the map, or as the kind says")
      ->type_name("NAME");
  app.add_option("--camera", camera,
                 "Calibration of a live camera without a robot (ROS camera_info, kalibr YAML or JSON of "
                 "PhotonVision)")
      ->type_name("FILE");
  app.add_option("--duration-s", duration_s,
                 "With a robot or a live camera: end after so many seconds. Unless given: at Ctrl-C")
      ->check(CLI::Range(0.01, 1e6))
      ->type_name("NUMBER");
  app.add_option("--every-s", every_s,
                 "With a robot or a live camera: time between the lines that are printed")
      ->capture_default_str()
      ->check(CLI::Range(0.01, 1e6))
      ->type_name("NUMBER")
      ->group(kMoreGroup);
  app.add_option("--record-images", images,
                 "With -o and a robot or a live camera: also record the pictures: jpeg, or raw, ten times as "
                 "large")
      ->check(CLI::IsMember({"jpeg", "raw"}))
      ->type_name("HOW")
      ->group(kMoreGroup);
  app.add_option("--camera-source", camera_sources,
                 "Camera of this computer that gives the pictures of a robot which sends none: "
                 "v4l2:/dev/video0, or NAME=ADDRESS where the robot's file names several")
      ->type_name("ADDRESS")
      ->group(kMoreGroup);
  add_flags(app, view);
}

Result<bool> is_live(const CLI::App& app, const LocalizeJob& job) {
  const bool robot = is_robot_kind(job.robot);
  const bool camera = std::ranges::any_of(job.logs, is_camera_address);
  const char* leave_out = "Leave it out.";
  Status status;
  if (robot && !job.logs.empty())
    status =
        fail(ErrorCode::InvalidArgument, "a robot that is there is localised, and a recording is named, too",
             {.source = job.logs.front()}, "Leave one of them out; --robot NAME describes a robot.");
  if (camera && job.logs.size() > 1)
    status = fail(ErrorCode::InvalidArgument, "a live camera is the only input", {},
                  "Run the program once for each camera.");
  if (!robot && job.logs.empty())
    status = fail(ErrorCode::InvalidArgument, "there is nothing to localise", {},
                  "Name a recording, or a robot that is there: --robot ros2:limo.");
  for (const char* flag : {"--robot-file", "--camera-source"})
    if (status && !robot)
      status = refuse_flag(app, flag, "this is about a robot that is there", "Add --robot KIND:ADDRESS.");
  for (const char* flag : {"--duration-s", "--every-s", "--record-images", "--view", "--publish-ros2"})
    if (status && !robot && !camera)
      status = refuse_flag(app, flag, "this is about a robot or a camera that is there", leave_out);
  if (status && !camera)
    status = refuse_flag(app, "--camera", "this is about a live camera without a robot",
                         "--robot describes a robot's camera.");
  for (const char* flag : {"--no-adapt", "--base-frame", "--camera-frame", "--camera-topic",
                           "--odometry-topic", "--imu-topic", "--sensor-pose"})
    if (status && (robot || camera)) status = refuse_flag(app, flag, "this is about recordings", leave_out);
  for (const char* flag : {"--robot", "--calibration", "--start", "--method"})
    if (status && camera)
      status =
          refuse_flag(app, flag, "a camera without a robot is where the tags of one picture say", leave_out);
  if (status && (robot || camera) && job.output.empty())
    status = refuse_flag(app, "--record-images", "nothing is recorded", "Add -o FILE.mcap.");
  if (!status) return tl::unexpected(status.error());
  return robot || camera;
}

ExitCode localize_live(const LocalizeLiveFlags& flags, const LocalizeJob& job, bool json, Console& console) {
  if (!job.logs.empty()) return localize_a_camera(flags, job, json, console);
  return localize_a_robot(flags, job, json, console);
}

}  // namespace waymark::cli
