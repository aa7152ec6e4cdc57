#pragma once

#include <functional>
#include <memory>

#include "waymark/drivers/dds/bus.hpp"
#include "waymark/drivers/simulated/simulated_lap.hpp"

namespace waymark {

/// Runs a simulated robot in real time as a robot of ROS 2, until should_stop() says so: the topics,
/// qualities of service and frames of LIMO's driver and camera (share/ros2/limo.yaml), stamped by this
/// machine's clock; /truth/pose beside them. It obeys /cmd_vel (Twist) and stops when commands cease, as the
/// robot of the setup does. Without `scene_camera` it publishes corners of tags (/tag_detections) instead of
/// pictures.
[[nodiscard]] Status run_ros2_robot_sim(Bus& bus, const SimulatedSetup& setup, const SE2& start,
                                        std::unique_ptr<DetectingCamera> scene_camera,
                                        const std::function<bool()>& should_stop);

}  // namespace waymark
