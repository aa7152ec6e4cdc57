#include "waymark/app/cli/parts.hpp"
#include "waymark/app/cli/robot_sim_flags.hpp"

namespace waymark::cli {
namespace {

struct GazeboSimArgs {
  explicit GazeboSimArgs(CLI::App& verb) : flags(verb, PlantFlag::Shown, Pictures::Always) {
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
      .sentence = "A robot of Gazebo: stands in for its server",
      .help =
          R"(Publishes the topics that the profile names, as Gazebo's robot does, and obeys its command topic, until Ctrl-C: for
--robot gazebo:PROFILE, where there is no Gazebo server. Those topics carry pictures, which are always rendered. IGN_PARTITION
and IGN_IP say where it publishes, as for Gazebo itself. As in Gazebo the last command counts until the next one comes.

Exit code: 0 ended by Ctrl-C, 1 another robot is there, a picture could not be made, or no module for Gazebo, 2 wrong usage.

Example:
  waymark robot-sim gazebo limo --world circuit24 --robot-file limo-gazebo
)",
      .prepare = prepared(run_gazebo)};
}

}  // namespace waymark::cli
