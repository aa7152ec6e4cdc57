#include <utility>

#include "waymark/cli/parts.hpp"
#include "waymark/cli/picture_flags.hpp"
#include "waymark/cli/ros2_flags.hpp"
#include "waymark/cli/setup_flags.hpp"
#include "waymark/live/robot_sim.hpp"

namespace waymark::cli {
namespace {

struct RobotSimArgs {
  explicit RobotSimArgs(CLI::App& verb)
      : settings(verb), setup(verb), pictures(settings, Reach::Flags, false), network(verb) {
    add_wires(verb);
    verb.add_flag(
            "--lockstep", job.process.lockstep,
            "Lockstep: simulated time advances with each answer, as fast as the machine allows and with "
            "the same samples every time")
        ->excludes("--limo", "--mbot", "--gazebo");
    verb.add_flag("--ros2", ros2,
                  "Publish topics of ROS 2 as LIMO does, and obey /cmd_vel, in real time; until Ctrl-C")
        ->excludes("--lockstep", "--limo", "--mbot", "--gazebo");
    add_option(
        verb, "--pace FLOAT", job.process.pace,
        "Maximum real-time factor with --lockstep: simulated seconds per second; 0: as fast as possible",
        between(0.0, 100.0), kShown);
  }
  void add_wires(CLI::App& verb);
  [[nodiscard]] SimWire wire() const {
    if (limo) return SimWire::Limo;
    if (!job.mbot_address.empty()) return SimWire::Mbot;
    if (!job.gazebo_profile.empty()) return SimWire::Gazebo;
    return ros2 ? SimWire::Ros2 : SimWire::Process;
  }

  Settings settings;
  SetupFlags setup;
  PictureFlags pictures;
  Ros2Flags network;
  RobotSimJob job{};
  std::string plant;
  std::string mbot_generation = "jetson";
  bool limo = false;
  bool ros2 = false;
};

/// The flags of what is not ROS 2.
void RobotSimArgs::add_wires(CLI::App& verb) {
  CLI::Option* const of_limo = verb.add_flag("--limo", limo,
                                             "Be a LIMO on a serial port, in real time, until Ctrl-C: a "
                                             "pseudo-terminal, whose path is printed");
  add_option(verb, "--beside FIFO", job.limo.beside,
             "Named pipe for what is not on LIMO's wire: camera, lidar, truth, as lines for `waymark limo "
             "robot --beside`")
      ->needs(of_limo);
  const auto add_fault = [&](const char* names, double& probability, const char* sentence) {
    add_option(verb, names, probability, sentence, between(0.0, 1.0), kShown, kMore)->needs(of_limo);
  };
  add_fault("--wire-noise FLOAT", job.limo.faults.noise,
            "Probability of each byte of LIMO's wire to become another one");
  add_fault("--wire-dropped FLOAT", job.limo.faults.dropped,
            "Probability of each byte of LIMO's wire to be lost");
  add_fault("--wire-torn FLOAT", job.limo.faults.torn,
            "Probability of each frame of LIMO's wire to lose its end");
  add_option(verb, "--mbot ADDRESS", job.mbot_address,
             "Be an MBot on LCM at this address, in real time, until Ctrl-C: udpm://239.255.76.67:7667?ttl=0")
      ->excludes("--limo");
  add_option(verb, "--mbot-generation NAME", mbot_generation,
             "Publisher of tags of the MBot: jetson (quaternions x, y, z, w) or pi5 (w, x, y, z; no stamps)",
             one_of({"jetson", "pi5"}), kShown, kMore)
      ->needs("--mbot");
  add_option(verb, "--gazebo PROFILE", job.gazebo_profile,
             "Publish the topics of Gazebo that this profile names, as Gazebo's robot does, and obey its "
             "command topic, until Ctrl-C: limo, or the path of a .yaml file")
      ->excludes("--limo", "--mbot");
  add_option(verb, "--plant ROBOT", plant,
             "Simulation behind the wire instead of Waymark's: process:CMD, a program that speaks the "
             "protocol of robot processes. World and robot file say which camera, wheels and tags it has",
             kMore)
      ->check([](const std::string& given) {
        return plant_command(given) ? std::string()
                                    : "'" + given + "' is no process:CMD (docs/formats/robot-process.md)";
      });
}

Status run_with(const RobotSimArgs& args, const RobotSetup& setup, Console& console) {
  const JobControl control = control_from(console);
  RobotSimJob job = args.job;
  job.wire = args.wire();
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
  refused.flags(args.wire() == SimWire::Process, {"--plant"}, "a robot process may be driven as it is",
                "Name it as --robot, or add --ros2, --limo, --mbot or --gazebo.");
  return refused.status();
}

ExitCode robot_sim(const RobotSimArgs& args, Console& console) {
  Result<RobotSetup> setup = args.setup.make();
  if (setup && !args.plant.empty()) setup->process = *plant_command(args.plant);
  setup = args.pictures.apply(std::move(setup));
  if (!setup) return console.failed(setup.error(), ExitCode::Usage);
  Status status = check_effects(args);
  if (status && args.plant.empty()) status = fit_to_wire(args.wire(), setup->simulated);
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
