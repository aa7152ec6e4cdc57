#include "waymark/app/cli/parts.hpp"
#include "waymark/app/cli/robot_flags.hpp"
#include "waymark/config/yaml/robot_file.hpp"
#include "waymark/robots/limo/limo_robot.hpp"

namespace waymark::cli {
namespace {

ExitCode limo_robot(const LimoRobotSettings& args, Console& console) {
  const auto robot = read_named_robot(args.robot_file);
  if (!robot) return fail_usage(robot.error(), console);
  const auto drive = args.drive.empty() ? drive_of(*robot) : parse_limo_drive(args.drive);
  if (!drive) return fail_usage(drive.error(), console);
  LimoRobotOptions options = args.options;
  options.drive = *drive;
  const Status status = run_limo_robot(*robot, options, standard_wire(console, args.listen_only));
  return status ? ExitCode::Ok : console.failed(status.error(), ExitCode::SomeFailed);
}

Verb limo_robot_verb() {
  return {
      .name = "robot",
      .sentence = "Run the process of a LIMO on a serial port; --robot limo:PORT starts it",
      .help =
          R"(Opens the serial port, writes LIMO's sensor data as JSON lines to standard output, reads commands from standard
input and sends them 25 times per second (docs/formats/robot-process.md). `waymark teach --robot limo:/dev/ttyTHS1`
starts it behind its watchdog. Started alone, it shows whether LIMO's data arrive and whether LIMO obeys:
docs/howto/limo.md.
Exit code: 0 its input ended; 1 no such port, LIMO does not answer or obey, or the cable was disconnected; 2 wrong
usage.

Example:
  waymark limo robot /dev/ttyTHS1 < /dev/null
)",
      .prepare = prepared_job(limo_robot)};
}

}  // namespace

Verb limo_verb() {
  return {.name = "limo",
          .sentence = "Drive AgileX LIMO on its serial port, without ROS: run a robot's process",
          .help = "Example:\n  waymark limo robot /dev/ttyTHS1 < /dev/null\n",
          .verbs = {limo_robot_verb()}};
}

}  // namespace waymark::cli
