#pragma once

#include <string>

#include "waymark/drivers/mbot/mbot_bridge.hpp"
#include "waymark/drivers/process/robot_wire.hpp"

namespace waymark {

struct MbotRobotOptions {
  std::string address{};  ///< of the LCM network; empty: the usual one
  MbotBridgeOptions bridge{};
  bool share_commands = false;                      ///< drive although another program sends commands
  Duration report_after = std::chrono::seconds(3);  ///< without odometry: what was heard is said
  Duration give_up_after = std::chrono::seconds(12);
};

/// Is the process of an MBot (docs/formats/robot-process.md): hears its messages on LCM and publishes
/// MBOT_VEL_CMD at least 25 times a second, until the input ends; then zero. Zero also, and words, while no
/// odometry came for 0.2 s. The hello comes 0.4 s after the first odometry; before it nothing is sent, and
/// the input is not read. Fails, and says what was heard instead, when no odometry came, and when another
/// program commands the robot.
[[nodiscard]] Status run_mbot_robot(const MbotRobotOptions& options, const RobotWire& wire);

}  // namespace waymark
