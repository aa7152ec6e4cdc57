#pragma once

#include <string>

#include "waymark/geometry/se3.hpp"

namespace waymark {

/// The box around the robot in base axes: x in [-rear, front], |y| <= width / 2, z in [0, height].
struct Hull {
  double front_m = 0;
  double rear_m = 0;
  double width_m = 0;
  double height_m = 0;
};

/// Motion limits of a robot.
struct MotionLimits {
  double speed_m_s = 0;
  double yaw_rate_rad_s = 0;
  double acceleration_m_s2 = 0;
  double yaw_acceleration_rad_s2 = 0;
};

/// Geometry and limits of a robot, as needed by several rooms. Base frame: x forward, y left, z up, on the
/// floor.
struct RobotModel {
  std::string name{};
  Hull hull{};
  MotionLimits limits{};
  double wheel_radius_m = 0;
  double track_m = 0;  ///< distance between left and right wheels
  SE3 base_T_cam{};    ///< optical frame: x right, y down, z forward
};

}  // namespace waymark
