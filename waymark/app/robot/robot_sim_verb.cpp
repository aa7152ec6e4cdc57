#include "waymark/app/cli/verb.hpp"

namespace waymark::cli {
namespace {

/// By the flag that names the wire.
std::string wire_named_by(const std::vector<std::string>& words) {
  for (const char* wire : {"limo", "mbot", "gazebo", "ros2"})
    if (has_word(words, std::string("--") + wire)) return wire;
  return "process";
}

}  // namespace

Verb robot_sim_verb() {
  return {
      .name = "robot-sim",
      .sentence = "Run a simulated robot that speaks as a real one does",
      .help =
          R"(The same robot in the same world, on the wire of your choice. A line that names none is read as `robot-sim process`;
with --ros2, --limo, --mbot ADDRESS or --gazebo PROFILE as the verb of that name. Each wire but the first runs in real
time, until Ctrl-C, and takes a simulation of your own in place of Waymark's: --plant process:CMD.

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
