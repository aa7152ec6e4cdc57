#pragma once

#include "waymark/app/common/job_control.hpp"
#include "waymark/app/robot/plant.hpp"
#include "waymark/robots/dds/bus.hpp"
#include "waymark/robots/simulated/simulated_lap.hpp"

namespace waymark {

struct Ros2SimOptions {
  BusOptions network{};
};

/// Runs a plant in real time as a robot of ROS 2 with the setup's camera, until the control cancels it: the
/// topics, qualities of service and frames of LIMO's driver and camera (share/ros2/limo.yaml), stamped by
/// this machine's clock; notes once that it does; /truth/pose beside them. It obeys /cmd_vel (Twist). A plant
/// without pictures has its corners of tags published (/tag_detections).
[[nodiscard]] Status run_ros2_robot_sim(Bus& bus, Plant& plant, const SimulatedSetup& setup,
                                        const JobControl& control);

}  // namespace waymark
