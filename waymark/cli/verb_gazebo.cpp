#include <memory>
#include <string>

#include <CLI/App.hpp>

#include "waymark/cli/standard_wire.hpp"
#include "waymark/cli/verb.hpp"
#include "waymark/config/share.hpp"
#include "waymark/drivers/gazebo/gazebo_robot.hpp"

namespace waymark::cli {
namespace {

struct GazeboRobotArgs {
  std::string profile{};
  std::string robot_file{};
  bool share_commands = false;
  bool listen_only = false;
};

ExitCode gazebo_robot(const GazeboRobotArgs& args, Console& console) {
  const auto profile = find_gazebo_profile(args.profile);
  if (!profile) return console.failed(profile.error(), ExitCode::Usage);
  const auto path = find_shared("robots", args.robot_file.empty() ? profile->robot : args.robot_file);
  const auto robot = path ? read_robot(*path) : tl::unexpected(path.error());
  if (!robot) return console.failed(robot.error(), ExitCode::Usage);
  const auto link = open_gazebo();
  if (!link) return console.failed(link.error(), ExitCode::SomeFailed);
  const Status status = run_gazebo_robot(**link, *profile, *robot, standard_wire(console, args.listen_only),
                                         {.share_commands = args.share_commands || args.listen_only});
  return status ? ExitCode::Ok : console.failed(status.error(), ExitCode::SomeFailed);
}

Run prepare_gazebo_robot(CLI::App& app) {
  const auto args = std::make_shared<GazeboRobotArgs>();
  app.add_option("profile", args->profile, "Profile: limo, or the path of a .yaml file")
      ->required()
      ->type_name("PROFILE");
  app.add_option("--robot-file", args->robot_file,
                 "Body and camera of the robot; unless given: as the profile says")
      ->type_name("NAME");
  add_share_commands_flag(app, args->share_commands);
  add_listen_flag(app, args->listen_only);
  return [args](Console& console) { return gazebo_robot(*args, console); };
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
      .prepare = prepare_gazebo_robot,
      .verbs = {}};
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

Run prepare_gazebo_topics(CLI::App& /*no flags*/) {
  return [](Console& console) { return gazebo_topics(console); };
}

Verb gazebo_topics_verb() {
  return {.name = "topics",
          .sentence = "List the topics that Gazebo publishes, with their types",
          .help = R"(Looks where IGN_PARTITION and IGN_IP say, as Gazebo itself does.

Exit code: 0 listed, 1 nobody publishes anything, or no module for Gazebo.

Example:
  waymark gazebo topics
)",
          .prepare = prepare_gazebo_topics,
          .verbs = {}};
}

}  // namespace

Verb gazebo_verb() {
  return {.name = "gazebo",
          .sentence = "Join the network of Gazebo: its topics, a robot's process",
          .help = "Example:\n  waymark gazebo topics\n",
          .prepare = {},
          .verbs = {gazebo_robot_verb(), gazebo_topics_verb()}};
}

}  // namespace waymark::cli
