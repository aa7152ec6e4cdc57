#include "waymark/app/cli/parts.hpp"
#include "waymark/app/cli/robot_flags.hpp"
#include "waymark/config/yaml/robot_file.hpp"
#include "waymark/robots/gazebo/gazebo_robot.hpp"

namespace waymark::cli {
namespace {

ExitCode gazebo_robot(const GazeboRobotSettings& args, Console& console) {
  const auto profile = find_gazebo_profile(args.profile);
  if (!profile) return fail_usage(profile.error(), console);
  const auto robot = read_named_robot(args.robot_file.empty() ? profile->robot : args.robot_file);
  if (!robot) return fail_usage(robot.error(), console);
  const auto link = open_gazebo();
  if (!link) return console.failed(link.error(), ExitCode::SomeFailed);
  const Status status =
      run_gazebo_robot(**link, *profile, *robot, standard_wire(console, args.wire.listen_only),
                       {.share_commands = args.wire.shares()});
  return status ? ExitCode::Ok : console.failed(status.error(), ExitCode::SomeFailed);
}

Verb gazebo_robot_verb() {
  return {
      .name = "robot",
      .sentence = "Run the process of a robot in Gazebo; --robot gazebo:PROFILE starts it",
      .help =
          R"(Subscribes to the topics of the profile and writes the messages as JSON lines to standard output; reads commands
from standard input and publishes them (docs/formats/robot-process.md). `waymark teach --robot gazebo:limo` starts it
behind its watchdog. Started alone, it shows whether robot data arrive. IGN_PARTITION and IGN_IP select the network,
as for Gazebo itself. It sends its hello after odometry has arrived, and no commands of another program for 0.4 s;
earlier input is ignored.

Exit code: 0 its input ended, 1 no odometry within 12 s, another program commands the robot, or no
module for Gazebo; 2 wrong usage.

Example:
  waymark gazebo robot limo < /dev/null
)",
      .prepare = prepared_job(gazebo_robot)};
}

ExitCode gazebo_topics(Console& console) {
  const auto link = open_gazebo();
  if (!link) return console.failed(link.error(), ExitCode::SomeFailed);
  const auto topics = (*link)->topics();
  for (const GazeboTopic& topic : topics) console.print(topic.name + " [" + topic.type + "]\n");
  if (!topics.empty()) return ExitCode::Ok;
  console.note((*link)->where() + ": no program publishes there");
  return ExitCode::SomeFailed;
}

Verb gazebo_topics_verb() {
  return {.name = "topics",
          .sentence = "List the topics that Gazebo publishes, with their types",
          .help = R"(IGN_PARTITION and IGN_IP select the network, as for Gazebo itself.
Exit code: 0 listed, 1 no program publishes, or no module for Gazebo.

Example:
  waymark gazebo topics
)",
          .prepare = prepared(gazebo_topics)};
}

}  // namespace

Verb gazebo_verb() {
  return {.name = "gazebo",
          .sentence = "Join the network of Gazebo: list topics, run a robot's process",
          .help = "Example:\n  waymark gazebo topics\n",
          .verbs = {gazebo_robot_verb(), gazebo_topics_verb()}};
}

}  // namespace waymark::cli
