#include "waymark/app/cli/verb.hpp"

namespace waymark::cli {
namespace {

/// The verb implied by a flag that belongs to a wire.
std::string wire_named_by(const std::vector<std::string>& words) {
  for (const char* wire : {"limo", "mbot", "gazebo", "ros2"})
    if (has_word(words, std::string("--") + wire)) return wire;
  return "process";
}

}  // namespace

Verb robot_sim_verb() {
  return {
      .name = "robot-sim",
      .sentence = "Run a simulated robot with the protocol of a real one",
      .help =
          R"(Runs the same robot in the same world on the chosen wire. The default is `robot-sim process`; --ros2, --limo, --mbot
ADDRESS or --gazebo PROFILE select the verb of that name. All wires except `process` run in real time, until Ctrl-C,
and accept your own simulation in place of Waymark's: --plant process:CMD.

Examples:
  waymark robot-sim --world circuit24 < /dev/null | head -3
  waymark teach --robot "process:waymark robot-sim --world circuit24 --lockstep" --world circuit24 -o lap.mcap
  waymark robot-sim ros2 --world circuit24 --images --localhost
  waymark robot-sim gazebo limo --world circuit24 --robot-file limo-gazebo
)",
      .verbs = {robot_sim_process_verb(), robot_sim_ros2_verb(), robot_sim_limo_verb(), robot_sim_mbot_verb(),
                robot_sim_gazebo_verb()},
      .usual_verb = wire_named_by};
}

}  // namespace waymark::cli
