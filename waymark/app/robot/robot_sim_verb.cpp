#include <utility>

#include "waymark/app/cli/parts.hpp"
#include "waymark/app/cli/robot_flags.hpp"
#include "waymark/app/robot/robot_sim.hpp"

namespace waymark::cli {
namespace {

struct RobotSimArgs : RobotSimWords {
  explicit RobotSimArgs(CLI::App& verb)
      : settings(verb), setup(verb), pictures(settings, Reach::Flags, false), network(verb) {
    add_fields(verb, static_cast<RobotSimWords&>(*this));
    verb.get_option("--plant")->check([](const std::string& given) {
      return plant_command(given) ? std::string()
                                  : "'" + given + "' is no process:CMD (docs/formats/robot-process.md)";
    });
  }

  Settings settings;
  SetupFlags setup;
  PictureFlags pictures;
  Ros2Flags network;
};

Status run_with(const RobotSimArgs& args, const RobotSetup& setup, Console& console) {
  const JobControl control = control_from(console);
  RobotSimJob job = args.job;
  job.wire = wire_of(args);
  job.mbot_generation = args.mbot_generation == "pi5" ? MbotGeneration::Pi5 : MbotGeneration::Jetson;
  Result<BusOptions> network;
  if (args.ros2) network = args.network.options("waymark_robot_sim");
  if (!network) return tl::unexpected(network.error());
  job.ros2 = *network;
  const auto print_port = [&](const std::string& path) { console.print(path + "\n"); };
  const auto plant = make_plant(job.wire, setup, control);
  return plant ? run_robot_sim(job, **plant, setup.simulated, print_port, control)
               : tl::unexpected(plant.error());
}

Status check_effects(const RobotSimArgs& args) {
  Refusals refused(args.settings.app());
  refused.flags(!args.job.process.lockstep, {"--pace"}, "without lockstep the robot goes by the clock",
                "Add --lockstep, or leave it out.");
  refused.all(!args.ros2, args.network, "this is about the network of ROS 2", "Add --ros2, or leave it out.");
  refused.flags(wire_of(args) == SimWire::Process, {"--plant"}, "a robot process may be driven as it is",
                "Name it as --robot, or add --ros2, --limo, --mbot or --gazebo.");
  return refused.status();
}

ExitCode robot_sim(const RobotSimArgs& args, Console& console) {
  Result<RobotSetup> setup = args.setup.make();
  if (setup && !args.plant.empty()) setup->process = *plant_command(args.plant);
  setup = args.pictures.apply(std::move(setup));
  if (!setup) return console.failed(setup.error(), ExitCode::Usage);
  Status status = check_effects(args);
  if (status && args.plant.empty()) status = fit_to_wire(wire_of(args), setup->simulated);
  if (!status) return console.failed(status.error(), ExitCode::Usage);
  status = run_with(args, *setup, console);
  return status ? ExitCode::Ok : fail_with(status.error(), console);
}

}  // namespace

Verb robot_sim_verb() {
  return {
      .name = "robot-sim",
      .sentence = "Run a simulated robot that speaks the protocol of robot processes",
      .help =
          R"(Writes what the robot senses as JSON lines on standard output and reads commands from standard input,
as docs/formats/robot-process.md says: to try the protocol, or as a robot for --robot process:CMD. It starts
where the world's line begins, in real time unless --lockstep, and ends when its input does. With --images
it sends pictures (JPEG), otherwise the corners of tags. It also sends the truth, for a judge. With --ros2 it is a
robot on the network instead, for --robot ros2:limo-sim (with --images) or ros2:limo-sim-tags, and for any ROS 2 program. With
--limo it is a LIMO on a serial port (docs/howto/limo.md), with --mbot an MBot on LCM (docs/howto/mbot.md). With
--gazebo it stands in for Gazebo, for --robot gazebo:PROFILE.

Exit code: 0 its input or a Ctrl-C ended it, 1 a picture could not be made, or another robot is there, 2 wrong usage.

Examples:
  waymark robot-sim --world circuit24 < /dev/null | head -3
  waymark teach --robot "process:waymark robot-sim --world circuit24 --lockstep" --world circuit24 -o lap.mcap
  waymark robot-sim --world circuit24 --images --ros2 --localhost
  waymark robot-sim --world circuit24 --robot-file limo-gazebo --images --gazebo limo
)",
      .prepare = prepared(robot_sim)};
}

}  // namespace waymark::cli
