#include "waymark/app/cli/parts.hpp"
#include "waymark/app/cli/robot_flags.hpp"
#include "waymark/app/commission/commission.hpp"
#include "waymark/app/live/robot_setup.hpp"

namespace waymark::cli {
namespace {

struct CommissionArgs {
  explicit CommissionArgs(CLI::App& verb) : app(verb), setup(verb, {}, true) {
    add_fields(verb, job);
    verb.add_flag("--json", json, "Print one JSON object instead of lines");
  }

  const CLI::App& app;
  SetupFlags setup;
  CommissionJob job{};
  bool json = false;
};

ExitCode commission_robot(const CommissionArgs& args, Console& console) {
  Result<RobotSetup> setup = args.setup.make();
  if (!setup) return fail_usage(setup.error(), console);
  const bool not_a_process = setup->process.empty();
  if (not_a_process) setup->ground.robot = "sim";
  const bool simulated = setup->ground.robot == "sim";
  Refusals refused(args.app);
  refused.fields(not_a_process, {"yes"}, "has no effect on a simulated robot", "Omit `yes`.");
  refuse_seed(!simulated, refused);
  Status started = refused.status();
  if (started && not_a_process) started = become_the_robot(*setup, args.setup.as_words(), {.lockstep = true});
  if (!started) return fail_usage(started.error(), console);
  const auto stop = listen_for_stop("first drive of " + setup->simulated.model.name, console);
  const JobControl control = control_from(console);
  const auto report =
      commission(*setup, args.job,
                 args.job.yes || simulated ? CommissionPerson{} : person_at_terminal(control), control);
  if (!report) return fail_with(report.error(), console);
  console.print(args.json ? json_line(fields(*report)) : to_text(*report));
  if (report->interrupted) return ExitCode::Interrupted;
  return report->passed ? ExitCode::Ok : ExitCode::SomeFailed;
}

}  // namespace

Verb commission_verb() {
  return {
      .name = "commission",
      .sentence = "First drive of a robot: check signs, axes, units and stops, then remove its speed limit",
      .help =
          R"(Drives at 0.1 m/s and 0.4 rad/s, first with lifted wheels, then 0.5 m and a quarter turn on the floor. Compares
the commands with odometry, wheels, gyro and tags. Reports reversed signs, swapped axes, degrees instead of
radians and millimetres instead of metres, with the key to correct. Also tests the stops: zero command,
`waymark stop`, space bar, no commands, killed driving process, pulled cable. If a check with lifted wheels fails,
the robot is not driven on the floor. Prints one line per check: ok, warn or fail.
The result is written into the robot's file (commissioned). Until a first drive has passed, teach, replay and run
limit the speed of a real robot to 0.15 m/s. A change of its limits, wheels, topics or of --robot invalidates the
result. docs/howto/first-drive.md is a step-by-step guide.

Exit code: 0 passed, 1 did not pass, or the robot could not be driven, 2 wrong usage, 130 stopped by Ctrl-C.

Examples:
  waymark commission --robot "process:python3 my_robot.py" --robot-file my_robot.yaml --tag-size-m 0.16
  waymark commission --robot ros2:limo --skip-lifted
  waymark commission --world circuit24
)",
      .prepare = prepared(commission_robot),
      .report = report_of<CommissionReport>};
}

}  // namespace waymark::cli
