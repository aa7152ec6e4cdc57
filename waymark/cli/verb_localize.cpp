#include <memory>
#include <string>

#include <CLI/App.hpp>
#include <nlohmann/json.hpp>

#include "waymark/cli/console_control.hpp"
#include "waymark/cli/failure.hpp"
#include "waymark/cli/frame_flags.hpp"
#include "waymark/cli/interrupt.hpp"
#include "waymark/cli/options_flags.hpp"
#include "waymark/cli/verb.hpp"
#include "waymark/jobs/json_line.hpp"
#include "waymark/jobs/localize_text.hpp"

namespace waymark::cli {
namespace {

struct LocalizeArgs {
  explicit LocalizeArgs(CLI::App& verb)
      : app(verb),
        settings(verb),
        filter(verb, settings, "filter", "Filters"),
        anchor(verb, settings, "anchor", "Method anchor") {}

  const CLI::App& app;
  Settings settings;
  LocalizeJob job{};
  std::string method = "riekf";
  bool json = false;
  bool no_adapt = false;
  OptionFlags<RiekfOptions> filter;
  OptionFlags<AnchorOptions> anchor;
};

/// Options that the method does not use.
Status check_effects(const LocalizeArgs& args) {
  const char* hint = "Leave it out, or choose another --method.";
  if (args.method == "anchor") {
    const char* why = "the method anchor has no filter";
    const Status status = refuse(args.filter, why, hint);
    return status ? refuse_flag(args.app, "--no-adapt", why, hint) : status;
  }
  Status status = refuse(args.anchor, "this is an option of the method anchor", hint);
  if (status && args.method != "smoother")
    status = refuse(args.filter, "this is an option of the method smoother", hint, "lag_s");
  return status;
}

ExitCode localize_log(const LocalizeArgs& args, Console& console) {
  LocalizeJob job = args.job;
  const Result<LocalizationKind> method = parse_localization_method(args.method);
  if (!method) return console.failed(method.error(), ExitCode::Usage);
  job.method = *method;
  Status flags = check_effects(args);
  if (flags) flags = args.filter.apply(job.filter);
  if (flags) flags = args.anchor.apply(job.anchor);
  if (!flags) return fail_usage(flags.error(), console);
  job.adapt = !args.no_adapt && !args.filter.given();  // what was asked for is kept
  const JobControl control = control_from(console);
  Result<LocalizeInputs> inputs = read_localize_inputs(job, control);
  if (!inputs)
    return console.failed(inputs.error(),
                          interrupted() ? ExitCode::Interrupted : exit_code_of(inputs.error()));
  // The robot's file may have said how it moves; what was asked for goes before.
  if (const Status asked = args.filter.apply(inputs->setup.filter); !asked)
    return fail_usage(asked.error(), console);
  const Result<LocalizeReport> report = localize(job, *inputs, control);
  if (!report)
    return console.failed(report.error(),
                          interrupted() ? ExitCode::Interrupted : exit_code_of(report.error()));
  console.print(args.json ? json_line(to_json(job, *report)) : to_text(*report));
  for (const std::string& warning : inputs->warnings) console.say("warning: " + warning);
  for (const std::string& problem : report->problems) console.say(problem);
  for (const std::string& doubt : doubts_about(*report)) console.say(doubt);
  return report->certain > 0 ? ExitCode::Ok : ExitCode::SomeFailed;
}

Run prepare_localize(CLI::App& app) {
  const auto args = std::make_shared<LocalizeArgs>(app);
  LocalizeJob& job = args->job;
  app.add_option("LOG", job.logs, "Recordings of one drive: MCAP, rosbag2, ROS 1, LCM, CSV tables")
      ->required()
      ->type_name("");
  app.add_option("--map", job.map,
                 "Map of the tags: map.yaml or its folder, apriltags_poses.yaml of the Robotics Academy, CSV "
                 "with id, x, y, or a field layout of WPILib")
      ->required()
      ->type_name("FILE");
  app.add_option("--robot", job.robot,
                 "Camera and its mounting: a robot's file, or a name. Unless given: the recording's, or "
                 "those of robot.yaml beside the map")
      ->type_name("FILE");
  add_frame_flags(app, job.frames);
  app.add_option("--calibration", job.calibration, "Calibration of this robot (calibration.yaml)")
      ->type_name("FILE");
  app.add_option("--method", args->method,
                 "Localisation method: riekf (right-invariant extended Kalman filter), ekf (extended Kalman "
                 "filter), anchor (nearest tag and odometry) or smoother (riekf with a backward pass)")
      ->capture_default_str()
      ->type_name("NAME");
  app.add_option(
         "-o,--output", job.output,
         "Record the estimates (.mcap), or write the certain ones as poses, one a line (.txt, .tum: TUM)")
      ->type_name("FILE");
  app.add_option("--tag-size-m", job.tag_size_m, "Tag size where the map has none (0.24 for the Academy's)")
      ->type_name("NUMBER");
  app.add_option("--sensor-pose", job.sensor_pose,
                 "Mounting of the range sensor on the robot: x y [m], yaw [deg]")
      ->expected(3)
      ->type_name("NUMBER");
  app.add_option("--start", job.start, "Initial pose of the robot, if it is known: x y [m], yaw [deg]")
      ->expected(3)
      ->type_name("NUMBER");
  app.add_flag(
      "--no-adapt", args->no_adapt,
      "Keep the assumed noise instead of estimating the noise of motion and observations from the recording");
  app.add_flag("--json", args->json, "One JSON object instead of words");
  return [args](Console& console) { return localize_log(*args, console); };
}

}  // namespace

Verb localize_verb() {
  return {
      .name = "localize",
      .sentence = "Estimate the trajectory of a robot from its recording and a map of the tags",
      .help =
          R"(Reads what the robot saw and how it moved, and writes where it was: certain estimates on the topic
/waymark/pose, mere guesses on /waymark/pose_uncertain, and for each observation of a mapped tag on /waymark/nis how
well it agreed (normalised innovation squared). Tags that contradict all others are named and not used: swapped,
moved, of another size. `waymark evaluate` compares the output with a truth.

Exit code: 0 it was known at some time where the robot is, 1 never, or a file was unusable (said in words),
2 wrong usage, 130 stopped by Ctrl-C (nothing is written then).

Examples:
  waymark localize lap.mcap --map map/map.yaml -o estimate.mcap
  waymark localize lcmlog --map landmarks.csv --robot mbot --json
  waymark localize ranges.csv odometry.csv --map landmarks.csv --sensor-pose 0.219 0 0
)",
      .prepare = prepare_localize,
      .verbs = {}};
}

}  // namespace waymark::cli
