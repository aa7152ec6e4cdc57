#include "waymark/cli/localize_live.hpp"

#include "waymark/cli/parts.hpp"
#include "waymark/jobs/localize_text.hpp"
#include "waymark/live/camera_address.hpp"
#include "waymark/live/localize_live.hpp"

namespace waymark::cli {
namespace {

/// It also ends where nobody reads its lines any more.
JobControl control_of_lines(Console& console) {
  JobControl control = control_from(console);
  control.cancelled = [&console] { return interrupted() || console.output_ended(); };
  return control;
}

LocalizeLines lines_of(bool json, Console& console) {
  return {json, [&console](const std::string& line) { console.print(line); }};
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
  LocalizeRobotJob live = described_robot(flags, job, lines_of(json, console));
  if (*view) live.feed = &(*view)->feed();
  const auto stop = listen_for_stop("localize " + job.robot, console);
  const Result<LocalizeRobotReport> report = localize_robot(*setup, live, control_of_lines(console));
  if (!report) return fail_with(report.error(), console);
  const ExitCode code = show_localized(report->localized, job, json, {}, console);
  return report->end.interrupted ? ExitCode::Interrupted : code;
}

ExitCode localize_a_camera(const LocalizeLiveFlags& flags, const LocalizeJob& job, bool json,
                           Console& console) {
  Result<LocalizeCameraJob> live = described_live_camera(flags, job, lines_of(json, console));
  if (!live) return fail_with(live.error(), console);
  const auto camera = open_live_camera(job.logs.front());
  if (!camera) return fail_with(camera.error(), console);
  console.say((*camera)->description());
  const auto view = LivePage::open(flags.view, (*camera)->description(), control_from(console));
  if (!view) return fail_with(view.error(), console);
  if (*view) live->feed = &(*view)->feed();
  const auto report = localize_camera(**camera, *live, control_of_lines(console));
  if (!report) return fail_with(report.error(), console);
  console.say(to_text(*report));
  if (report->end.stopped && interrupted()) return ExitCode::Interrupted;
  return report->known > 0 ? ExitCode::Ok : ExitCode::SomeFailed;
}

ExitCode localize_a_video(const LocalizeLiveFlags& flags, const LocalizeJob& job, bool json,
                          Console& console) {
  const Result<LocalizeVideoJob> video = described_video(flags, job, lines_of(json, console));
  if (!video) return fail_with(video.error(), console);
  const auto report = localize_video(*video, control_from(console));
  if (!report) return fail_with(report.error(), console);
  for (const VideoProblem& problem : report->video.problems) console.say(to_string(problem.error));
  console.say(to_text(*report));
  return report->known > 0 ? ExitCode::Ok : ExitCode::SomeFailed;
}

}  // namespace waymark::cli
