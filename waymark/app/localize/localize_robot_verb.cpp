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
    verb.add_flag("--json", json, "Print JSON lines instead of text");
  }

  Settings settings;
  LocalizeRobotJob job{};
  ViewerOptions view{};
  bool json = false;
  MethodFlags method;
};

ExitCode localize_driven(const LocalizeRobotArgs& args, Console& console) {
  LocalizeRobotJob job = args.job;
  if (const Status valid = args.method.apply(job.method, job.filter, job.anchor); !valid)
    return fail_usage(valid.error(), console);
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
      .sentence = "Localise a robot while another program drives it",
      .help =
          R"(Connects to the robot, listens, and prints its pose once per second until Ctrl-C; nothing is sent to the robot. With -o
FILE.mcap, every sample and the estimates are recorded: certain estimates on the topic /waymark/pose, uncertain ones on
/waymark/pose_uncertain. `waymark localize log FILE.mcap --no-adapt` reproduces them from the recording.
--view shows the robot in the browser; --publish-ros2 publishes it on ROS 2.

Tags are detected in the robot's images, unless the robot sends tags; --camera-source uses a camera on this computer
instead. The robot file (--robot-file) contains the camera mountings. A robot that waits for its commands (lockstep) is
not supported. For a recording, use `waymark localize log`, where --robot NAME is the name of a robot file.

With --json, the program prints one line per estimate, and at the end the same report as `waymark localize log`.

Exit code: 0 at least one certain estimate, 1 none, or a file or the robot was unusable, 2 wrong usage,
130 stopped by Ctrl-C (the recording is kept).

Examples:
  waymark localize --robot ros2:limo --map map --publish-ros2
  waymark localize --robot mbot: --map map --view -o live.mcap
)",
      .prepare = prepared(localize_driven),
      .report = report_of<EstimateMoment>};
}

}  // namespace waymark::cli
