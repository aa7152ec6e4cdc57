#pragma once

#include <string>

#include "waymark/base/fields.hpp"
#include "waymark/robots/mbot/lcm_link.hpp"
#include "waymark/robots/mbot/mbot_bridge.hpp"
#include "waymark/robots/process/robot_wire.hpp"

namespace waymark {

struct MbotRobotOptions {
  std::string address{};  ///< of the LCM network; empty: the usual one
  MbotBridgeOptions bridge{};
  bool share_commands = false;  ///< drive although another program sends commands
};

/// What a user says of such a process.
struct MbotRobotWords {
  std::string address = kLcmDefaultAddress;
  std::string robot_file = "mbot";
  double tag_latency_s = to_seconds(MbotBridgeOptions{}.tag_latency);
  RobotWireSettings wire{};

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.address, JobField("address address ADDRESS",
                                 "Address of the robot's LCM network; ttl=1: beyond this machine")
                            .input());
    visit(self.robot_file, JobField("robot_file NAME", "Body and camera of the robot"));
    visit(self.tag_latency_s,
          JobField("tag_latency_s FLOAT", "Time from the exposure of a picture to the stamp of its tags [s]",
                   0.0, 1.0));
    RobotWireSettings::fields(self.wire, visit);
  }
};

/// Is the process of an MBot (docs/formats/robot-process.md): hears its messages on LCM and publishes
/// MBOT_VEL_CMD at least 25 times a second, until the input ends; then zero. Zero also, and words, while no
/// odometry came for 0.2 s. The hello comes 0.4 s after the first odometry; before it nothing is sent, and
/// the input is not read. Fails, and says what was heard instead, when no odometry came, and when another
/// program commands the robot.
[[nodiscard]] Status run_mbot_robot(const MbotRobotOptions& options, const RobotWire& wire);

}  // namespace waymark
