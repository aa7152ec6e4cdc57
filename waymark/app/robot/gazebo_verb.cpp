#include "waymark/app/cli/parts.hpp"
#include "waymark/app/cli/robot_flags.hpp"
#include "waymark/config/yaml/robot_file.hpp"
#include "waymark/robots/gazebo/gazebo_robot.hpp"

namespace waymark::cli {
namespace {

ExitCode gazebo_robot(const GazeboRobotWords& args, Console& console) {
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
      .sentence = "Be the process of a robot in Gazebo: what --robot gazebo:PROFILE starts",
      .help =
          R"(Subscribes the topics of the profile and writes what comes as JSON lines on standard output; reads commands from
standard input and publishes them (docs/formats/robot-process.md). `waymark teach --robot gazebo:limo` starts it behind
its watchdog. Alone it shows whether a robot is heard. IGN_PARTITION and IGN_IP say where it looks, as for Gazebo itself.

The hello comes when odometry was heard and no commands of another program for 0.4 s; the input counts from then on.

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
  console.say((*link)->where() + ": nobody publishes anything there");
  return ExitCode::SomeFailed;
}

Verb gazebo_topics_verb() {
  return {.name = "topics",
          .sentence = "List the topics that Gazebo publishes, with their types",
          .help = R"(Looks where IGN_PARTITION and IGN_IP say, as Gazebo itself does.

Exit code: 0 listed, 1 nobody publishes anything, or no module for Gazebo.

Example:
  waymark gazebo topics
)",
          .prepare = prepared(gazebo_topics)};
}

}  // namespace

Verb gazebo_verb() {
  return {.name = "gazebo",
          .sentence = "Join the network of Gazebo: its topics, a robot's process",
          .help = "Example:\n  waymark gazebo topics\n",
          .verbs = {gazebo_robot_verb(), gazebo_topics_verb()}};
}

}  // namespace waymark::cli
