#pragma once

#include <string>
#include <vector>

#include "waymark/config/robot_file.hpp"
#include "waymark/geometry/se3.hpp"

namespace waymark {

/// A robot as a model in SDF 1.9 for Gazebo Fortress: a body of the size of its hull on four wheels (skid
/// steering), with the diff-drive plugin and its limits, a camera, an IMU, a lidar where it has one, and a
/// publisher of its true pose. Topics: /model/NAME/{cmd_vel,odometry,pose}, /camera, /camera_info, /imu,
/// /scan. What its file does not tell is that of a LIMO: 4 kg, wheels 0.6 of its length apart, friction 1.2.
/// `notes` gets what Gazebo's camera cannot do.
[[nodiscard]] std::string write_sdf_robot(const RobotDescription& robot, const SE3& world_T_base,
                                          std::vector<std::string>& notes);

/// How Waymark drives that model (share/gazebo): the text of a profile.
[[nodiscard]] std::string gazebo_profile_of(const RobotDescription& robot, const std::string& robot_file);

}  // namespace waymark
