#include <string>
#include <vector>

#include "waymark/app/cli/parts.hpp"
#include "waymark/app/live/cameras.hpp"
#include "waymark/app/live/viewers.hpp"
#include "waymark/app/localize/localize_live.hpp"
#include "waymark/app/localize/localize_log.hpp"

namespace waymark::cli {
namespace {

/// What is said of a robot, a camera or a video, and who watches.
struct LocalizeLiveFlags : LocalizeLive {
  ViewerOptions view{};
};

/// It also ends where nobody reads its lines any more.
JobControl control_of_lines(Console& console) {
  JobControl control = control_from(console);
  control.cancelled = [&console] { return interrupted() || console.output_ended(); };
  return control;
}

LocalizeLines lines_of(bool json, Console& console) {
  return {json, [&console](const std::string& line) { console.print(line); }};
}

/// Prints the report and what is doubtful about it; its exit code.
ExitCode show_localized(const LocalizeReport& report, const LocalizeJob& job, bool json,
                        const std::vector<std::string>& warnings, Console& console) {
  console.print(json ? json_line(to_json(job, report)) : to_text(report));
  for (const std::string& warning : warnings) console.say("warning: " + warning);
  for (const std::string& problem : report.problems) console.say(problem);
  for (const std::string& doubt : doubts_about(report)) console.say(doubt);
  return report.certain > 0 ? ExitCode::Ok : ExitCode::SomeFailed;
}

/// `waymark localize --robot KIND:ADDRESS`, until Ctrl-C.
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

/// `waymark localize v4l2:…`, until Ctrl-C.
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

/// `waymark localize walk.mp4`.
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

struct LocalizeArgs {
  explicit LocalizeArgs(CLI::App& verb)
      : settings(verb), filter(settings, "filter", "Filters"), anchor(settings, "anchor", "Method anchor") {
    add_fields(verb, job);
    add_option(verb, "--method NAME", method,
               "Localisation method: riekf (right-invariant extended Kalman filter), ekf (extended Kalman "
               "filter), anchor (nearest tag and odometry) or smoother (riekf with a backward pass)",
               kShown);
    verb.add_flag("--no-adapt", no_adapt,
                  "Keep the assumed noise instead of estimating the noise of motion and observations from "
                  "the recording");
    add_fields(verb, static_cast<LocalizeLive&>(live));
    add_fields(verb, live.view);
    verb.add_flag("--json", json, "One JSON object instead of words");
  }

  Settings settings;
  LocalizeJob job{};
  std::string method = "riekf";
  bool json = false;
  bool no_adapt = false;
  LocalizeLiveFlags live{};
  OptionFlags<RiekfOptions> filter;
  OptionFlags<AnchorOptions> anchor;
};

/// Options that the method does not use.
Status check_effects(const LocalizeArgs& args) {
  const bool by_anchor = args.method == "anchor";
  const char* no_filter = "the method anchor has no filter";
  const char* hint = "Leave it out, or choose another --method.";
  Refusals refused(args.settings.app());
  refused.options(by_anchor, args.filter, no_filter, hint);
  refused.flags(by_anchor, {"--no-adapt"}, no_filter, hint);
  refused.options(!by_anchor, args.anchor, "this is an option of the method anchor", hint);
  refused.options(args.method != "smoother", args.filter, "this is an option of the method smoother", hint,
                  "lag_s");
  return refused.status();
}

ExitCode localize_log(const LocalizeArgs& args, Console& console) {
  LocalizeJob job = args.job;
  const Result<LocalizationKind> method = parse_localization_method(args.method);
  if (!method) return fail_usage(method.error(), console);
  job.method = *method;
  Status flags = check_effects(args);
  if (flags) flags = args.filter.apply(job.filter);
  if (flags) flags = args.anchor.apply(job.anchor);
  if (!flags) return fail_usage(flags.error(), console);
  const Result<LocalizeInput> input = localize_input(job, given_on(args.settings.app()));
  if (!input) return fail_usage(input.error(), console);
  if (*input == LocalizeInput::Camera || *input == LocalizeInput::Video) {
    const char* why = "a camera without a robot has no filter";
    Refusals refused(args.settings.app());
    refused.options(true, args.filter, why, "Leave it out.");
    refused.options(true, args.anchor, why, "Leave it out.");
    if (!refused.status()) return fail_usage(refused.status().error(), console);
  }
  if (*input == LocalizeInput::Robot) return localize_a_robot(args.live, job, args.json, console);
  if (*input == LocalizeInput::Camera) return localize_a_camera(args.live, job, args.json, console);
  if (*input == LocalizeInput::Video) return localize_a_video(args.live, job, args.json, console);
  job.adapt = !args.no_adapt && !args.filter.given();  // what was asked for is kept
  const JobControl control = control_from(console);
  Result<LocalizeInputs> inputs = read_localize_inputs(job, control);
  if (!inputs) return fail_with(inputs.error(), console);
  // The robot's file may have said how it moves; what was asked for goes before.
  if (const Status asked = args.filter.apply(inputs->setup.filter); !asked)
    return fail_usage(asked.error(), console);
  const Result<LocalizeReport> report = localize(job, *inputs, control);
  if (!report) return fail_with(report.error(), console);
  return show_localized(*report, job, args.json, inputs->warnings, console);
}

}  // namespace

Verb localize_verb() {
  return {
      .name = "localize",
      .sentence =
          "Estimate where a robot or a camera is from a map of the tags: of a recording, a video or live",
      .help =
          R"(Reads what the robot saw and how it moved, and writes where it was: certain estimates on the topic
/waymark/pose, mere guesses on /waymark/pose_uncertain, and for each observation of a mapped tag on /waymark/nis how
well it agreed (normalised innovation squared). Tags that contradict all others are named and not used: swapped,
moved, of another size. `waymark evaluate` compares the output with a truth.

--robot KIND:ADDRESS localises a robot that somebody else drives, until Ctrl-C: nothing is sent to it. -o then records
every sample, too. A live camera without a robot, or the one that took a video, is where the tags of each picture say,
in six degrees of freedom.

Exit code: 0 it was known at some time where the robot is, 1 never, or a file was unusable (said in words),
2 wrong usage, 130 stopped by Ctrl-C (of a recording nothing is written then; of a running robot what was
recorded stays).

Examples:
  waymark localize lap.mcap --map map/map.yaml -o estimate.mcap
  waymark localize lcmlog --map landmarks.csv --robot mbot --json
  waymark localize --robot ros2:limo --map map --publish-ros2
  waymark localize v4l2:/dev/video0 --camera calibration.yaml --map map --view
  waymark localize walk.mp4 --camera calibration.yaml --map map -o walk.tum
  waymark localize ranges.csv odometry.csv --map landmarks.csv --sensor-pose 0.219 0 0
)",
      .prepare = prepared(localize_log)};
}

}  // namespace waymark::cli
