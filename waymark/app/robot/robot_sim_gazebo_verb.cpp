#include "waymark/app/cli/parts.hpp"
#include "waymark/app/cli/robot_sim_flags.hpp"

namespace waymark::cli {
namespace {

struct GazeboSimArgs {
  explicit GazeboSimArgs(CLI::App& verb) : flags(verb, PlantFlag::Shown, Images::Always) {
    add_fields(verb, options);
  }

  RobotSimFlags flags;
  GazeboSimOptions options{};
};

ExitCode run_gazebo(const GazeboSimArgs& args, Console& console) {
  return args.flags.run(SimWire(args.options), console);
}

}  // namespace

Verb robot_sim_gazebo_verb() {
  return {
      .name = "gazebo",
      .sentence = "Simulate a robot of Gazebo, in place of its server",
      .help =
          R"(Publishes the topics of the profile, like Gazebo's robot, and obeys its command topic, until Ctrl-C: for --robot
gazebo:PROFILE without a Gazebo server. Images are always rendered, since those topics carry them. IGN_PARTITION and
IGN_IP select the network, as for Gazebo itself. As in Gazebo, a command is valid until the next one.
Exit code: 0 ended by Ctrl-C, 1 another robot exists, an image could not be rendered, or no module for Gazebo, 2 wrong
usage.

Example:
  waymark robot-sim gazebo limo --world circuit24 --robot-file limo-gazebo
)",
      .prepare = prepared(run_gazebo)};
}

}  // namespace waymark::cli
