#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include <CLI/App.hpp>
#include <CLI/Validators.hpp>

#include "waymark/cli/gazebo_sim_flags.hpp"
#include "waymark/cli/interrupt.hpp"
#include "waymark/cli/limo_sim_flags.hpp"
#include "waymark/cli/mbot_sim_flags.hpp"
#include "waymark/cli/picture_flags.hpp"
#include "waymark/cli/plant_flags.hpp"
#include "waymark/cli/ros2_flags.hpp"
#include "waymark/cli/setup_flags.hpp"
#include "waymark/cli/verb.hpp"
#include "waymark/drivers/dds/open_bus.hpp"
#include "waymark/live/ros2_robot_sim.hpp"
#include "waymark/live/simulated_process.hpp"

namespace waymark::cli {
namespace {

struct RobotSimArgs {
  explicit RobotSimArgs(CLI::App& verb)
      : app(verb),
        settings(verb),
        setup(verb),
        pictures(verb, settings, Reach::Flags, false),
        network(verb),
        limo(verb),
        mbot(verb),
        gazebo(verb),
        plant(verb) {}

  const CLI::App& app;
  Settings settings;
  SetupFlags setup;
  PictureFlags pictures;
  Ros2Flags network;
  LimoSimFlags limo;
  MbotSimFlags mbot;
  GazeboSimFlags gazebo;
  PlantFlags plant;
  SimulatedProcessOptions options{};
  bool ros2 = false;
};

Status speak_ros2(const RobotSimArgs& args, Plant& plant, const SimulatedSetup& setup) {
  const auto options = args.network.options("waymark_robot_sim");
  if (!options) return tl::unexpected(options.error());
  const auto bus = open_bus(*options);
  if (!bus) return tl::unexpected(bus.error());
  return run_ros2_robot_sim(**bus, plant, setup, interrupted);
}

Status speak_limo(const RobotSimArgs& args, Plant& plant, const SimulatedSetup& setup, Console& console) {
  const auto on_port = [&console](const std::string& path) {
    console.print(path + "\n");
    (void)std::fflush(stdout);
  };
  LimoSimOptions options = args.limo.options;
  options.seed = setup.robot.seed;
  return run_limo_robot_sim(plant, setup, options, on_port, interrupted);
}

/// The types of lines that the wire cannot do without.
std::vector<std::string> needed(const RobotSimArgs& args) {
  if (args.gazebo.chosen()) return {"image"};
  return args.mbot.chosen() ? std::vector<std::string>{"detections"} : std::vector<std::string>();
}

Status speak(const RobotSimArgs& args, Plant& plant, const SimulatedSetup& setup, Console& console) {
  if (args.limo.chosen) return speak_limo(args, plant, setup, console);
  if (args.mbot.chosen()) return args.mbot.run(plant, setup);
  if (args.gazebo.chosen()) return args.gazebo.run(plant, setup.camera);
  if (args.ros2) return speak_ros2(args, plant, setup);
  return run_simulated_process(plant, setup, args.options, interrupted);
}

ExitCode robot_sim(const RobotSimArgs& args, Console& console) {
  Result<RobotSetup> setup = args.setup.make();
  if (setup) setup->process = args.plant.process();
  Status status = setup ? args.pictures.apply(*setup) : tl::unexpected(setup.error());
  if (status && !args.options.lockstep)
    status = refuse_flag(args.app, "--pace", "without lockstep the robot goes by the clock",
                         "Add --lockstep, or leave it out.");
  if (status && !args.limo.chosen && !args.mbot.chosen() && !args.gazebo.chosen() && !args.ros2)
    status = refuse_flag(args.app, "--plant", "a robot process may be driven as it is",
                         "Name it as --robot, or add --ros2, --limo, --mbot or --gazebo.");
  if (status && !args.plant.chosen()) status = args.gazebo.apply(setup->simulated);
  if (!status) return console.failed(status.error(), ExitCode::Usage);
  const auto plant = args.plant.make(*setup, needed(args), console);
  if (!plant) return console.failed(plant.error(), ExitCode::SomeFailed);
  status = speak(args, **plant, setup->simulated, console);
  return status ? ExitCode::Ok : console.failed(status.error(), ExitCode::SomeFailed);
}

Run prepare_robot_sim(CLI::App& app) {
  const auto args = std::make_shared<RobotSimArgs>(app);
  app.add_flag("--lockstep", args->options.lockstep,
               "Lockstep: simulated time advances with each answer, as fast as the machine allows and with "
               "the same samples every time")
      ->excludes("--limo", "--mbot", "--gazebo");
  app.add_flag("--ros2", args->ros2,
               "Publish topics of ROS 2 as LIMO does, and obey /cmd_vel, in real time; until Ctrl-C")
      ->excludes("--lockstep", "--limo", "--mbot", "--gazebo");
  app.add_option(
         "--pace", args->options.pace,
         "Maximum real-time factor with --lockstep: simulated seconds per second; 0: as fast as possible")
      ->check(CLI::Range(0.0, 100.0))
      ->capture_default_str()
      ->type_name("FLOAT");
  return [args](Console& console) { return robot_sim(*args, console); };
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

Exit code: 0 its input ended, 1 a picture could not be made, 2 wrong usage.

Examples:
  waymark robot-sim --world circuit24 < /dev/null | head -3
  waymark teach --robot "process:waymark robot-sim --world circuit24 --lockstep" --world circuit24 -o lap.mcap
  waymark robot-sim --world circuit24 --images --ros2 --localhost
  waymark robot-sim --world circuit24 --robot-file limo-gazebo --images --gazebo limo
)",
      .prepare = prepare_robot_sim,
      .verbs = {}};
}

}  // namespace waymark::cli
