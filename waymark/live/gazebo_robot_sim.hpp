#pragma once

#include <functional>
#include <memory>

#include "waymark/drivers/gazebo/gazebo_link.hpp"
#include "waymark/drivers/gazebo/profile.hpp"
#include "waymark/drivers/simulated/simulated_lap.hpp"

namespace waymark {

/// Runs a simulated robot on the network of Gazebo, until should_stop() says so: it publishes what a profile
/// subscribes (pictures, calibration, odometry, IMU, lidar, poses, clock), stamped with simulated time that
/// runs as fast as real time or slower, and obeys its commands as Gazebo's diff-drive plugin does: the last
/// one counts until the next comes.
[[nodiscard]] Status run_gazebo_robot_sim(GazeboLink& link, const GazeboProfile& profile,
                                          const SimulatedSetup& setup, const SE2& start,
                                          std::unique_ptr<DetectingCamera> scene_camera,
                                          const std::function<bool()>& should_stop);

}  // namespace waymark
