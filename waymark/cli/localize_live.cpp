#include "waymark/cli/localize_live.hpp"

#include <optional>

#include "waymark/base/counted.hpp"
#include "waymark/cli/parts.hpp"
#include "waymark/cli/setup_flags.hpp"
#include "waymark/jobs/localize_text.hpp"
#include "waymark/jobs/localize_video.hpp"
#include "waymark/live/camera_address.hpp"
#include "waymark/live/localize_camera.hpp"
#include "waymark/live/localize_lines.hpp"
#include "waymark/live/localize_robot.hpp"

namespace waymark::cli {
namespace {

Result<DescribedCamera> camera_of(const LocalizeLiveFlags& flags) {
  if (flags.camera.file.empty())
    return fail(ErrorCode::InvalidArgument, "the calibration of the camera is not known", {.key = "--camera"},
                "`waymark calibrate camera` makes one.");
  return read_camera(flags.camera);
}

}  // namespace

ExitCode show_localized(const LocalizeReport& report, const LocalizeJob& job, bool json,
                        const std::vector<std::string>& warnings, Console& console) {
  console.print(json ? json_line(to_json(job, report)) : to_text(report));
  for (const std::string& warning : warnings) console.say("warning: " + warning);
  for (const std::string& problem : report.problems) console.say(problem);
  for (const std::string& doubt : doubts_about(report)) console.say(doubt);
  return report.certain > 0 ? ExitCode::Ok : ExitCode::SomeFailed;
}

ExitCode localize_a_robot(const LocalizeLiveFlags& flags, const LocalizeJob& job, bool json,
                          Console& console) {
  Result<RobotSetup> setup = load_listening_robot(job.robot, flags.robot_file, job.map, flags.camera_sources);
  if (!setup) return fail_usage(setup.error(), console);
  setup->pictures = flags.pictures;
  const auto view = LivePage::open(flags.view, *setup, control_from(console));
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
  const ExitCode code = show_localized(report->localized, job, json, {}, console);
  return report->end.interrupted ? ExitCode::Interrupted : code;
}

ExitCode localize_a_camera(const LocalizeLiveFlags& flags, const LocalizeJob& job, bool json,
                           Console& console) {
  const Result<DescribedCamera> calibration = camera_of(flags);
  if (!calibration) return fail_with(calibration.error(), console);
  const auto camera = open_live_camera(job.logs.front());
  if (!camera) return fail_with(camera.error(), console);
  console.say((*camera)->description());
  JobControl control = control_from(console);
  control.cancelled = [&console] { return interrupted() || console.output_ended(); };
  const auto view = LivePage::open(flags.view, (*camera)->description(), control_from(console));
  if (!view) return fail_with(view.error(), console);
  MomentLines lines(flags.every_s, json, [&](const std::string& line) { console.print(line); });
  LocalizeCameraJob live{.localize = job,
                         .camera = calibration->camera,
                         .images = flags.images,
                         .duration_s = flags.duration_s,
                         .feed = *view ? &(*view)->feed() : nullptr};
  live.on_moment = [&](const CameraMoment& moment) { lines.take(moment); };
  const auto report = localize_camera(**camera, live, control);
  if (!report) return fail_with(report.error(), console);
  console.say(fmt::format("{} in {:.1f} s, the place known in {}", counted(report->end.pictures, "picture"),
                          report->end.seconds, report->known));
  if (report->end.stopped && interrupted()) return ExitCode::Interrupted;
  return report->known > 0 ? ExitCode::Ok : ExitCode::SomeFailed;
}

ExitCode localize_a_video(const LocalizeLiveFlags& flags, const LocalizeJob& job, bool json,
                          Console& console) {
  const Result<DescribedCamera> camera = camera_of(flags);
  if (!camera) return fail_with(camera.error(), console);
  MomentLines lines(flags.every_s, json, [&](const std::string& line) { console.print(line); });
  const LocalizeVideoJob video{.localize = job,
                               .camera = camera->camera,
                               .readout_s = camera->readout_s,
                               .on_moment = [&](const CameraMoment& moment) { lines.take(moment); }};
  const auto report = localize_video(video, control_from(console));
  if (!report) return fail_with(report.error(), console);
  for (const VideoProblem& problem : report->video.problems) console.say(to_string(problem.error));
  console.say(
      fmt::format("{}, the place known in {}", counted(report->video.pictures, "picture"), report->known));
  return report->known > 0 ? ExitCode::Ok : ExitCode::SomeFailed;
}

Result<LocalizeInput> localize_input(const CLI::App& app, const LocalizeJob& job) {
  const Result<LocalizeInput> input = localize_kind(job, app.count("--camera") > 0);
  if (!input) return input;
  const bool robot = *input == LocalizeInput::Robot;
  const bool camera = *input == LocalizeInput::Camera;
  const bool video = *input == LocalizeInput::Video;
  const char* leave_out = "Leave it out.";
  Refusals refused(app);
  refused.flags(!robot,
                {"--robot-file", "--camera-source", "--detector", "--search-every", "--search-strips"},
                "this is about a robot that is there", "Add --robot KIND:ADDRESS.");
  refused.flags(app.count("--search-every") == 0, {"--search-strips"}, kSearchedWholly, kSearchEvery);
  refused.flags(!robot && !camera, {"--duration-s", "--record-images", "--view", "--publish-ros2"},
                "this is about a robot or a camera that is there", leave_out);
  refused.flags(*input == LocalizeInput::Recording, {"--every-s"},
                "this is about a robot, a camera or a video", leave_out);
  refused.flags(!camera && !video, {"--camera", "--camera-name", "--camera-size"},
                "this is about a live camera or a video", "--robot describes a robot's camera.");
  refused.flags(!video, {"--readout-ms"}, "this is about a video",
                "For a robot's camera it is --set filter.camera_readout_s=0.015.");
  refused.flags(*input != LocalizeInput::Recording,
                {"--no-adapt", "--base-frame", "--camera-frame", "--camera-topic", "--odometry-topic",
                 "--imu-topic", "--sensor-pose"},
                "this is about recordings", leave_out);
  refused.flags(camera || video, {"--robot", "--calibration", "--start", "--method"},
                "a camera without a robot is where the tags of one picture say", leave_out);
  refused.flags((robot || camera) && job.output.empty(), {"--record-images"}, "nothing is recorded",
                "Add -o FILE.mcap.");
  if (!refused.status()) return tl::unexpected(refused.status().error());
  return input;
}

}  // namespace waymark::cli
