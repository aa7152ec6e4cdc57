#pragma once

#include "waymark/app/common/job_control.hpp"
#include "waymark/app/robot/plant.hpp"
#include "waymark/robots/dds/bus.hpp"
#include "waymark/robots/simulated/simulated_lap.hpp"

namespace waymark {

struct Ros2SimOptions {
  BusOptions network{};
};

/// Simulates a ROS 2 robot with the camera of the setup in real time, until the control cancels. Topics,
/// quality-of-service settings and frames are those of LIMO's driver and camera (share/ros2/limo.yaml).
/// Messages are timestamped by the clock of this machine; /truth/pose contains the ground truth. The robot
/// obeys /cmd_vel (Twist). A plant without images publishes tag corners (/tag_detections). Prints a single
/// note when it starts.
[[nodiscard]] Status run_ros2_robot_sim(Bus& bus, Plant& plant, const SimulatedSetup& setup,
                                        const JobControl& control);

}  // namespace waymark
