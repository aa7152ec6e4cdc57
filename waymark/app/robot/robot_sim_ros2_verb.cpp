#include "waymark/app/cli/parts.hpp"
#include "waymark/app/cli/robot_sim_flags.hpp"

namespace waymark::cli {
namespace {

struct Ros2SimArgs {
  explicit Ros2SimArgs(CLI::App& verb) : flags(verb), network(verb) { add_choice(verb, "--ros2"); }

  RobotSimFlags flags;
  Ros2Flags network;
};

ExitCode run_ros2(const Ros2SimArgs& args, Console& console) {
  const auto wire = args.network.options("waymark_robot_sim").map([](const BusOptions& network) {
    return SimWire(Ros2SimOptions{network});
  });
  return args.flags.run(wire, console);
}

}  // namespace

Verb robot_sim_ros2_verb() {
  return {
      .name = "ros2",
      .sentence = "A robot on the network of ROS 2, as LIMO is with its driver and camera",
      .help =
          R"(Publishes the topics of ROS 2 that LIMO's driver and camera publish, and obeys /cmd_vel (Twist), in real time, until
Ctrl-C. It is the robot of --robot ros2:limo-sim (with --images), of --robot ros2:limo-sim-tags (without: the corners
of tags), and of any ROS 2 program. /truth/pose is the truth, for a judge.

Exit code: 0 ended by Ctrl-C, 1 a picture could not be made, or no module for ROS 2, 2 wrong usage.

Examples:
  waymark robot-sim ros2 --world circuit24 --images --localhost
  waymark robot-sim ros2 --localhost --plant "process:python3 my_simulation.py" --world world.yaml --robot-file robot.yaml
)",
      .prepare = prepared(run_ros2)};
}

}  // namespace waymark::cli
