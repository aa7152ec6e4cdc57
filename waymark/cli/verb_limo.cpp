#include <memory>
#include <string>

#include <CLI/App.hpp>

#include "waymark/cli/setup_flags.hpp"
#include "waymark/cli/standard_wire.hpp"
#include "waymark/cli/verb.hpp"
#include "waymark/config/share.hpp"
#include "waymark/drivers/limo/limo_robot.hpp"

namespace waymark::cli {
namespace {

struct LimoRobotArgs {
  LimoRobotOptions options{};
  std::string robot_file = "limo";
  std::string drive{};
  bool listen_only = false;
};

ExitCode limo_robot(LimoRobotArgs args, Console& console) {
  const auto path = find_shared("robots", args.robot_file);
  const auto robot = path ? read_robot(*path) : tl::unexpected(path.error());
  if (!robot) return console.failed(robot.error(), ExitCode::Usage);
  const auto drive = args.drive.empty() ? drive_of(*robot) : parse_limo_drive(args.drive);
  if (!drive) return console.failed(drive.error(), ExitCode::Usage);
  args.options.drive = *drive;
  const Status status = run_limo_robot(*robot, args.options, standard_wire(console, args.listen_only));
  return status ? ExitCode::Ok : console.failed(status.error(), ExitCode::SomeFailed);
}

Run prepare_limo_robot(CLI::App& app) {
  const auto args = std::make_shared<LimoRobotArgs>();
  app.add_option("port", args->options.port, "Serial port of LIMO's mainboard, for example /dev/ttyTHS1")
      ->required()
      ->type_name("PORT");
  app.add_option("--robot-file", args->robot_file,
                 std::string("Body and camera of the robot: ") + kRobotNames)
      ->capture_default_str()
      ->type_name("NAME");
  app.add_option(
         "--drive", args->drive,
         "Drive of LIMO: differential, ackermann, mecanum (LIMO is told so) or tracked. Unless given: "
         "as the robot's file says")
      ->type_name("NAME");
  app.add_option(
         "--beside", args->options.beside,
         "Named pipe with further lines of a robot process, stamped by this machine's steady clock: a "
         "lidar, a camera with a detector of its own")
      ->type_name("FIFO");
  app.add_flag("--simulated", args->options.simulated,
               "A simulated LIMO is at the other end: it needs no first drive (`waymark commission`)");
  add_listen_flag(app, args->listen_only);
  return [args](Console& console) { return limo_robot(*args, console); };
}

Verb limo_robot_verb() {
  return {
      .name = "robot",
      .sentence = "Be the process of a LIMO on a serial port: what --robot limo:PORT starts",
      .help =
          R"(Holds the serial port, writes what LIMO senses as JSON lines on standard output, reads commands from standard input
and sends them 25 times a second (docs/formats/robot-process.md). `waymark teach --robot limo:/dev/ttyTHS1` starts
it behind its watchdog. Alone it shows whether LIMO is heard and obeys: docs/howto/limo.md.

Exit code: 0 its input ended; 1 no such port, LIMO does not answer or obey, or the cable was cut; 2 wrong usage.

Example:
  waymark limo robot /dev/ttyTHS1 < /dev/null
)",
      .prepare = prepare_limo_robot,
      .verbs = {}};
}

}  // namespace

Verb limo_verb() {
  return {.name = "limo",
          .sentence = "Drive AgileX LIMO by its serial port, without ROS: a robot's process",
          .help = "Example:\n  waymark limo robot /dev/ttyTHS1 < /dev/null\n",
          .prepare = {},
          .verbs = {limo_robot_verb()}};
}

}  // namespace waymark::cli
