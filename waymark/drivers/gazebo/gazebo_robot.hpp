#pragma once

#include <chrono>

#include "waymark/config/robot_file.hpp"
#include "waymark/drivers/bridge/robot_talk.hpp"
#include "waymark/drivers/gazebo/gazebo_link.hpp"
#include "waymark/drivers/gazebo/profile.hpp"

namespace waymark {

struct GazeboRobotOptions {
  Duration report_after = std::chrono::seconds(3);  ///< without odometry: what was found is said
  Duration give_up_after = std::chrono::seconds(12);
};

/// Is the process of a robot in Gazebo (docs/formats/robot-process.md): subscribes what its profile names,
/// publishes its commands, until the input ends; zero while odometry is missing, and at the end. The hello
/// comes with the first odometry; fails, and says what is published instead, when none came.
[[nodiscard]] Status run_gazebo_robot(GazeboLink& link, const GazeboProfile& profile,
                                      const RobotDescription& robot, const RobotWire& wire,
                                      const GazeboRobotOptions& options = {});

/// The topics that are published, in words.
[[nodiscard]] std::string topics_in_words(const std::vector<GazeboTopic>& topics);

}  // namespace waymark
