#pragma once

#include "waymark/app/common/job_control.hpp"
#include "waymark/app/robot/plant.hpp"
#include "waymark/robots/dds/bus.hpp"
#include "waymark/robots/simulated/simulated_lap.hpp"

namespace waymark {

struct Ros2SimOptions {
  BusOptions network{};
};

/// Runs a plant in real time as a ROS 2 robot with the setup's camera, until the control cancels. Topics,
/// qualities of service and frames are those of LIMO's driver and camera (share/ros2/limo.yaml). They are
/// stamped by this machine's clock; /truth/pose is the ground truth. The robot obeys /cmd_vel (Twist). For a
/// plant without images it publishes tag corners (/tag_detections). Notes its start once.
[[nodiscard]] Status run_ros2_robot_sim(Bus& bus, Plant& plant, const SimulatedSetup& setup,
                                        const JobControl& control);

}  // namespace waymark
