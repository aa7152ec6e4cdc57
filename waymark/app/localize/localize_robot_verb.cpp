#include "waymark/app/cli/localize_parts.hpp"
#include "waymark/app/cli/parts.hpp"
#include "waymark/app/live/viewers.hpp"
#include "waymark/app/localize/localize_lines.hpp"
#include "waymark/app/localize/localize_robot.hpp"

namespace waymark::cli {
namespace {

struct LocalizeRobotArgs {
  explicit LocalizeRobotArgs(CLI::App& verb) : settings(verb), method(settings) {
    add_fields(verb, job);
    add_fields(verb, view);
    verb.add_flag("--json", json, "JSON lines instead of words");
  }

  Settings settings;
  LocalizeRobotJob job{};
  ViewerOptions view{};
  bool json = false;
  MethodFlags method;
};

ExitCode localize_driven(const LocalizeRobotArgs& args, Console& console) {
  LocalizeRobotJob job = args.job;
  if (const Status sound = args.method.apply(job.method, job.filter, job.anchor); !sound)
    return fail_usage(sound.error(), console);
  job.asked = [&args](RiekfOptions& filter) { return args.method.apply(filter); };
  const Result<RobotSetup> setup = load_listening_robot(job);
  if (!setup) return fail_usage(setup.error(), console);
  const auto view = LivePage::open(args.view, *setup, control_from(console));
  if (!view) return fail_with(view.error(), console);
  if (*view) job.feed = &(*view)->feed();
  job.on_report = [lines = EstimateLines(args.json, [&console](const std::string& line) {
                     console.print(line);
                   })](SensorTime now, const std::optional<LocalizationEstimate>& estimate) mutable {
    lines.take(now, estimate);
  };
  const auto stop = listen_for_stop("localize " + job.robot, console);
  const Result<LocalizeRobotReport> report = localize_robot(*setup, job, control_of_lines(console));
  if (!report) return fail_with(report.error(), console);
  const ExitCode code = show_localized(report->localized, args.json, {}, console);
  return report->end.interrupted ? ExitCode::Interrupted : code;
}

}  // namespace

Verb localize_robot_verb() {
  return {
      .name = "robot",
      .sentence = "Localise a robot while somebody else drives it",
      .help =
          R"(Connects to the robot, listens, and prints once a second where it is, until Ctrl-C: nothing is sent to it.
With -o FILE.mcap every sample is recorded with the estimates: certain ones on the topic /waymark/pose, mere guesses on
/waymark/pose_uncertain. `waymark localize log FILE.mcap --no-adapt` estimates the same from the recording.
--view shows the robot in the browser, --publish-ros2 on the network of ROS 2.

Tags are found in the robot's pictures, unless the robot sends tags; --camera-source gives the pictures of a camera of
this computer. The robot's file (--robot-file) describes where its cameras sit. A robot that waits for its commands
(lockstep) cannot be listened to. A recording of a drive is for `waymark localize log`, where --robot NAME is the name of
a robot's file.

With --json: a line for each estimate, and at the end the report that `waymark localize log` prints.

Exit code: 0 the place of the robot was known at some time, 1 never, or a file or the robot was unusable, 2 wrong usage,
130 stopped by Ctrl-C (what was recorded stays).

Examples:
  waymark localize --robot ros2:limo --map map --publish-ros2
  waymark localize --robot mbot: --map map --view -o live.mcap
)",
      .prepare = prepared(localize_driven),
      .report = report_of<EstimateMoment>};
}

}  // namespace waymark::cli
