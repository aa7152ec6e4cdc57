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
      .sentence = "Simulate a robot on the ROS 2 network, like LIMO with its driver and camera",
      .help =
          R"(Publishes the ROS 2 topics of LIMO's driver and camera, and obeys /cmd_vel (Twist), in real time, until Ctrl-C. It
serves --robot ros2:limo-sim (with --images), --robot ros2:limo-sim-tags (tag corners, without --images), and any
ROS 2 program. /truth/pose is the ground truth.
Exit code: 0 ended by Ctrl-C, 1 an image could not be rendered, or no module for ROS 2, 2 wrong usage.

Examples:
  waymark robot-sim ros2 --world circuit24 --images --localhost
  waymark robot-sim ros2 --localhost --plant "process:python3 my_simulation.py" --world world.yaml --robot-file robot.yaml
)",
      .prepare = prepared(run_ros2)};
}

}  // namespace waymark::cli
