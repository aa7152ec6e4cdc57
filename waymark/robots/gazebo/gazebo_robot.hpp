#pragma once

#include "waymark/base/fields.hpp"
#include "waymark/config/yaml/robot_file.hpp"
#include "waymark/robots/gazebo/gazebo_link.hpp"
#include "waymark/robots/gazebo/profile.hpp"
#include "waymark/robots/process/robot_wire.hpp"

namespace waymark {

struct GazeboRobotOptions {
  bool share_commands = false;  ///< drive even if another program sends commands
};

/// User settings for the robot process.
struct GazeboRobotSettings {
  std::string profile{};
  std::string robot_file{};  ///< that of the profile if empty
  RobotWireSettings wire{};

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(
        self.profile,
        JobField("profile profile PROFILE", "Profile: limo, or the path of a .yaml file").input().required());
    visit(self.robot_file,
          JobField("robot_file NAME", "Body and camera of the robot; default: the robot of the profile"));
    RobotWireSettings::fields(self.wire, visit);
  }
};

/// Runs the process for a robot in Gazebo (docs/formats/robot-process.md): subscribes to the topics in the
/// profile and publishes commands until the input ends. Publishes zero while odometry is missing, and at the
/// end. Writes the hello 0.4 s after the first odometry; until then, nothing is sent and the input is not
/// read. Fails if no odometry arrives (the error lists the topics found) or if another program commands the
/// robot.
[[nodiscard]] Status run_gazebo_robot(GazeboLink& link, const GazeboProfile& profile,
                                      const RobotDescription& robot, const RobotWire& wire,
                                      const GazeboRobotOptions& options = {});

/// Lists up to 30 topics with their types, for use in messages.
[[nodiscard]] std::string topic_list_text(const std::vector<GazeboTopic>& topics);

}  // namespace waymark
