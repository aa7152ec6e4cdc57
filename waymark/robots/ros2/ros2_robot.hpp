#pragma once

#include "waymark/base/fields.hpp"
#include "waymark/config/yaml/robot_file.hpp"
#include "waymark/robots/dds/bus.hpp"
#include "waymark/robots/process/robot_wire.hpp"
#include "waymark/robots/ros2/profile.hpp"

namespace waymark {

struct Ros2RobotOptions {
  bool share_commands = false;  ///< drive even if another program sends commands
};

/// User settings for the robot process.
struct Ros2RobotSettings {
  std::string profile{};
  std::string robot_file{};  ///< that of the profile if empty
  RobotWireSettings wire{};

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.profile, JobField("profile profile PROFILE",
                                 "Profile: limo, turtlebot3, limo-sim, or the path of a .yaml file")
                            .input()
                            .required());
    visit(self.robot_file,
          JobField("robot_file NAME", "Body and camera of the robot; default: the robot of the profile"));
    RobotWireSettings::fields(self.wire, visit);
  }
};

/// Runs the process for a robot with ROS 2 (docs/formats/robot-process.md): subscribes to the topics in the
/// profile and publishes commands until the input ends. It writes the hello 1.5 s after the first odometry;
/// until then, nothing is sent and the input is not read. Fails if no odometry arrives (the error describes
/// what was found on the network) or if another program commands the robot.
[[nodiscard]] Status run_ros2_robot(const Ros2Profile& profile, const RobotDescription& robot,
                                    const BusOptions& bus_options, const RobotWire& wire,
                                    const Ros2RobotOptions& options = {});

}  // namespace waymark
