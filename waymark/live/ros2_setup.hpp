#pragma once

#include <cstdint>
#include <string>

#include "waymark/live/robot_setup.hpp"

namespace waymark {

/// A robot that speaks ROS 2: load_setup() with the robot that its profile names where `robot_file` is empty,
/// and this program again as `waymark ros2 robot PROFILE` as its process. Fails on a profile that is not
/// there or makes no sense.
[[nodiscard]] Result<RobotSetup> load_ros2_setup(const std::string& profile, const std::string& world,
                                                 const std::string& robot_file, std::uint64_t seed);

}  // namespace waymark
