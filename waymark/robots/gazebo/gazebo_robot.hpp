#pragma once

#include "waymark/base/fields.hpp"
#include "waymark/config/yaml/robot_file.hpp"
#include "waymark/robots/gazebo/gazebo_link.hpp"
#include "waymark/robots/gazebo/profile.hpp"
#include "waymark/robots/process/robot_wire.hpp"

namespace waymark {

struct GazeboRobotOptions {
  bool share_commands = false;  ///< drive although another program sends commands
};

/// What a user says of such a process.
struct GazeboRobotWords {
  std::string profile{};
  std::string robot_file{};  ///< empty: as the profile says
  RobotWireSettings wire{};

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(
        self.profile,
        JobField("profile profile PROFILE", "Profile: limo, or the path of a .yaml file").input().required());
    visit(self.robot_file,
          JobField("robot_file NAME", "Body and camera of the robot; unless given: as the profile says"));
    RobotWireSettings::fields(self.wire, visit);
  }
};

/// Is the process of a robot in Gazebo (docs/formats/robot-process.md): subscribes what its profile names,
/// publishes its commands, until the input ends; zero while odometry is missing, and at the end. The hello
/// comes 0.4 s after the first odometry; before it nothing is sent, and the input is not read. Fails, and
/// says what is published instead, when no odometry came, and when another program commands the robot.
[[nodiscard]] Status run_gazebo_robot(GazeboLink& link, const GazeboProfile& profile,
                                      const RobotDescription& robot, const RobotWire& wire,
                                      const GazeboRobotOptions& options = {});

/// The topics that are published, in words.
[[nodiscard]] std::string topics_in_words(const std::vector<GazeboTopic>& topics);

}  // namespace waymark
