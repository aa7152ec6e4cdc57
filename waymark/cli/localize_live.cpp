#include "waymark/cli/localize_live.hpp"

#include <algorithm>
#include <optional>

#include "waymark/cli/parts.hpp"
#include "waymark/cli/setup_flags.hpp"
#include "waymark/config/camera_file.hpp"
#include "waymark/jobs/localize_text.hpp"
#include "waymark/live/camera_address.hpp"
#include "waymark/live/localize_lines.hpp"
#include "waymark/live/localize_robot.hpp"
#include "waymark/live/robot_kinds.hpp"

namespace waymark::cli {
namespace {

ExitCode show(const LocalizeRobotReport& report, const LocalizeJob& job, bool json, Console& console) {
  console.print(json ? json_line(to_json(job, report.localized)) : to_text(report.localized));
  for (const std::string& problem : report.localized.problems) console.say(problem);
  for (const std::string& doubt : doubts_about(report.localized)) console.say(doubt);
  if (report.end.interrupted) return ExitCode::Interrupted;
  return report.localized.certain > 0 ? ExitCode::Ok : ExitCode::SomeFailed;
}

ExitCode localize_a_robot(const LocalizeLiveFlags& flags, const LocalizeJob& job, bool json,
                          Console& console) {
  const Result<RobotSetup> setup =
      load_listening_robot(job.robot, flags.robot_file, job.map, flags.camera_sources);
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
    console.print(json ? estimate_json(now, estimate) : estimate_line(to_seconds(now - *first), estimate));
  };
  JobControl control = control_from(console);
  control.cancelled = [&console] { return interrupted() || console.output_ended(); };
  const auto stop = listen_for_stop("localize " + job.robot, console);
  const Result<LocalizeRobotReport> report = localize_robot(*setup, live, control);
  if (!report) return fail_with(report.error(), console);
  return show(*report, job, json, console);
}

ExitCode localize_a_camera(const LocalizeLiveFlags& flags, const LocalizeJob& job, bool json,
                           Console& console) {
  if (flags.camera.empty())
    return console.failed({.code = ErrorCode::InvalidArgument,
                           .message = "the calibration of the camera is not known",
                           .place = {.key = "--camera"},
                           .hint = "`waymark calibrate camera` makes one."},
                          ExitCode::Usage);
  const Result<NamedCamera> calibration = read_camera(flags.camera);
  if (!calibration) return fail_with(calibration.error(), console);
  const auto camera = open_live_camera(job.logs.front());
  if (!camera) return fail_with(camera.error(), console);
  console.say((*camera)->description());
  JobControl control = control_from(console);
  control.cancelled = [&console] { return interrupted() || console.output_ended(); };
  const auto view = start_page(flags.view, (*camera)->description(), console);
  if (!view) return fail_with(view.error(), console);
  std::optional<SensorTime> first;
  SensorTime next{};
  LocalizeCameraJob live{.localize = job,
                         .camera = calibration->camera,
                         .images = flags.images,
                         .duration_s = flags.duration_s,
                         .feed = *view ? &(*view)->feed() : nullptr};
  live.on_moment = [&](const CameraMoment& moment) {
    if (!first) first = next = moment.stamp;
    if (moment.stamp < next) return;
    next = moment.stamp + std::chrono::duration_cast<Duration>(std::chrono::duration<double>(flags.every_s));
    console.print(json ? moment_json(moment) : moment_line(to_seconds(moment.stamp - *first), moment));
  };
  const auto report = localize_camera(**camera, live, control);
  if (!report) return fail_with(report.error(), console);
  console.say(fmt::format("{} pictures in {:.1f} s, the place known in {}", report->end.pictures,
                          report->end.seconds, report->known));
  if (report->end.stopped && interrupted()) return ExitCode::Interrupted;
  return report->known > 0 ? ExitCode::Ok : ExitCode::SomeFailed;
}

}  // namespace

void LocalizeLiveFlags::add_to(CLI::App& app) {
  add_option(app, "--robot-file NAME", robot_file,
             std::string("With --robot KIND:ADDRESS: body and camera of the robot: ") + kRobotNames +
                 ". Unless given: robot.yaml beside the map, or as the kind says");
  add_option(
      app, "--camera FILE", camera,
      "Calibration of a live camera without a robot (ROS camera_info, kalibr YAML or JSON of PhotonVision)");
  add_option(app, "--duration-s NUMBER", duration_s,
             "With a robot or a live camera: end after so many seconds. Unless given: at Ctrl-C",
             between(0.01, 1e6));
  add_option(app, "--every-s NUMBER", every_s,
             "With a robot or a live camera: time between the lines that are printed", kShown,
             between(0.01, 1e6), kMore);
  add_option(
      app, "--record-images HOW", images,
      "With -o and a robot or a live camera: also record the pictures: jpeg, or raw, ten times as large",
      one_of({"jpeg", "raw"}), kMore);
  add_option(app, "--camera-source ADDRESS", camera_sources,
             "Camera of this computer that gives the pictures of a robot which sends none: v4l2:/dev/video0, "
             "or NAME=ADDRESS where the robot's file names several",
             kMore);
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
