#include "waymark/app/cli/parts.hpp"
#include "waymark/app/cli/robot_flags.hpp"
#include "waymark/config/yaml/robot_file.hpp"
#include "waymark/robots/ros2/relay.hpp"
#include "waymark/robots/ros2/ros2_robot.hpp"

namespace waymark::cli {
namespace {

struct Ros2RobotArgs : Ros2RobotSettings {
  explicit Ros2RobotArgs(CLI::App& app) : network(app) {
    add_fields(app, static_cast<Ros2RobotSettings&>(*this));
  }

  Ros2Flags network;
};

ExitCode ros2_robot(const Ros2RobotArgs& args, Console& console) {
  const auto profile = find_ros2_profile(args.profile);
  if (!profile) return fail_usage(profile.error(), console);
  const auto robot = read_named_robot(args.robot_file.empty() ? profile->robot : args.robot_file);
  auto options = args.network.options("waymark_robot", profile->ros_distro);
  if (!robot) return fail_usage(robot.error(), console);
  if (!options) return fail_usage(options.error(), console);
  if (Status usable = use_interface_of(*profile, *options); !usable)
    return fail_usage(usable.error(), console);
  const Status status =
      run_ros2_robot(*profile, *robot, *options, standard_wire(console, args.wire.listen_only),
                     {.share_commands = args.wire.shares()});
  return status ? ExitCode::Ok : console.failed(status.error(), ExitCode::SomeFailed);
}

Verb ros2_robot_verb() {
  return {
      .name = "robot",
      .sentence = "Run the process of a ROS 2 robot; --robot ros2:PROFILE starts it",
      .help =
          R"(Subscribes to the topics of the profile and writes the messages as JSON lines to standard output; reads commands
from standard input and publishes them (docs/formats/robot-process.md). `waymark teach --robot ros2:limo` starts it
behind its watchdog. Started alone, it shows whether robot data arrive. It sends its hello after odometry has arrived,
and no commands of another program for 1.5 s; earlier input is ignored.

Exit code: 0 its input ended, 1 no odometry within 12 s, another program commands the robot, or no
module for ROS 2; 2 wrong usage.

Example:
  waymark ros2 robot limo < /dev/null
)",
      .prepare = prepared(ros2_robot)};
}

struct RelayArgs {
  explicit RelayArgs(CLI::App& app) : network(app) { add_fields(app, relay); }

  Ros2Flags network;
  RelayOptions relay{};
};

ExitCode relay(const RelayArgs& args, Console& console) {
  const auto options = args.network.options("waymark_relay");
  if (!options) return fail_usage(options.error(), console);
  if (Status possible = check_relay(args.relay); !possible) return fail_usage(possible.error(), console);
  const Status status = run_relay(
      args.relay, *options, [&](const std::string& words) { console.note(words); }, interrupted);
  return status ? ExitCode::Ok : console.failed(status.error(), ExitCode::SomeFailed);
}

Verb ros2_relay_verb() {
  return {
      .name = "relay",
      .sentence = "Relay velocity commands and stop the robot if they cease: a watchdog to run on the robot",
      .help =
          R"(For robots that keep driving if commands cease, such as TurtleBot3. It runs on the robot itself, relays commands
from one topic to another, and publishes zero, at least 25 times per second, if no command arrived for 0.25 s. A
second process publishes zero if the relay is killed. The profile's command_topic is then the --from topic.

Exit code: 0 ended by Ctrl-C, 1 the network failed, 2 wrong usage.

Example:
  waymark ros2 relay --from /waymark/cmd_vel --to /cmd_vel --stamped
)",
      .prepare = prepared(relay)};
}

}  // namespace

Verb ros2_verb() {
  return {.name = "ros2",
          .sentence = "Join a ROS 2 network without ROS: list topics, run a robot's process or a watchdog",
          .help = "Example:\n  waymark ros2 topic list\n",
          .verbs = {ros2_topic_verb(), ros2_robot_verb(), ros2_relay_verb()}};
}

}  // namespace waymark::cli
