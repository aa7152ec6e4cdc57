#pragma once

#include <string>

#include "waymark/base/fields.hpp"
#include "waymark/robots/mbot/lcm_link.hpp"
#include "waymark/robots/mbot/mbot_bridge.hpp"
#include "waymark/robots/process/robot_wire.hpp"

namespace waymark {

struct MbotRobotOptions {
  std::string address{};  ///< address of the LCM network; kLcmDefaultAddress if empty
  MbotBridgeOptions bridge{};
  bool share_commands = false;  ///< drive even if another program sends commands
};

/// User settings for the robot process.
struct MbotRobotSettings {
  std::string address = kLcmDefaultAddress;
  std::string robot_file = "mbot";
  double tag_latency_s = to_seconds(MbotBridgeOptions{}.tag_latency);
  RobotWireSettings wire{};

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.address, JobField("address address ADDRESS",
                                 "Address of the robot's LCM network; ttl=1 reaches other computers")
                            .input());
    visit(self.robot_file, JobField("robot_file NAME", "Body and camera of the robot"));
    visit(self.tag_latency_s,
          JobField("tag_latency_s FLOAT", "Time from the exposure of an image to the stamp of its tags [s]",
                   0.0, 1.0));
    RobotWireSettings::fields(self.wire, visit);
  }
};

/// Runs the process for an MBot (docs/formats/robot-process.md): receives its messages over LCM and publishes
/// MBOT_VEL_CMD at least 25 times a second until the input ends, then zero. If no odometry arrives for 0.2 s,
/// it sends zero and reports this. It writes the hello 0.4 s after the first odometry; until then, nothing is
/// sent and the input is not read. Fails if no odometry arrives (the error lists the channels received) or if
/// another program commands the robot.
[[nodiscard]] Status run_mbot_robot(const MbotRobotOptions& options, const RobotWire& wire);

}  // namespace waymark
