#include "waymark/app/cli/parts.hpp"
#include "waymark/app/cli/robot_flags.hpp"
#include "waymark/app/commission/commission.hpp"
#include "waymark/app/live/robot_setup.hpp"

namespace waymark::cli {
namespace {

struct CommissionArgs {
  explicit CommissionArgs(CLI::App& verb) : app(verb), setup(verb, {}, true) {
    add_fields(verb, job);
    verb.add_flag("--json", json, "One JSON object instead of lines");
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
  refused.fields(not_a_process, {"yes"}, "a simulated robot needs no answers", "Leave it out.");
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
      .sentence = "First drive of a robot: check signs, axes, units and stops, and lift its speed limit",
      .help =
          R"(Drives at 0.1 m/s and 0.4 rad/s, first with lifted wheels, then 0.5 m and a quarter turn on the floor, and holds
what was commanded against odometry, wheels, gyro and tags: reversed signs, swapped axes, degrees for radians and
millimetres for metres are named with the key that mends them. The stops are tried as well: zero, `waymark stop`,
the space bar, no commands, a driving process that is killed, a pulled cable. Lifted wheels that fail are not put
on the floor. One line a check: ok, warn or fail.

The result is written into the robot's file (commissioned). Until a first drive has passed, a robot that is not
simulated is driven at 0.15 m/s at most by teach, replay and run; a change of its limits, wheels, topics or of
--robot makes the result void. docs/howto/first-drive.md goes through it.

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
