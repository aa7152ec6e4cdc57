#pragma once

#include "waymark/config/robot_file.hpp"
#include "waymark/drivers/bridge/robot_talk.hpp"
#include "waymark/drivers/dds/bus.hpp"
#include "waymark/drivers/process/robot_wire.hpp"
#include "waymark/drivers/ros2/profile.hpp"

namespace waymark {

struct Ros2RobotOptions {
  Duration report_after = std::chrono::seconds(3);  ///< without odometry: what was found is said
  Duration give_up_after = std::chrono::seconds(12);
};

/// Is the process of a robot that speaks ROS 2 (docs/formats/robot-process.md): subscribes what its profile
/// names, publishes its commands, until the input ends. The hello comes with the first odometry; fails, and
/// says what is on the network instead, when none came.
[[nodiscard]] Status run_ros2_robot(const Ros2Profile& profile, const RobotDescription& robot,
                                    const BusOptions& bus_options, const RobotWire& wire,
                                    const Ros2RobotOptions& options = {});

}  // namespace waymark
