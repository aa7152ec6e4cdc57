#pragma once

#include <string>
#include <variant>
#include <vector>

#include <Eigen/Core>

#include "waymark/base/time.hpp"
#include "waymark/geometry/se2.hpp"
#include "waymark/geometry/se3.hpp"
#include "waymark/samples/tag_detection.hpp"

/// What a robot says and what it is told, as plain values with a stamp of the sensor's clock.
namespace waymark {

/// The tags found in one picture; an empty list says that the camera looked and saw none.
struct TagFrame {
  SensorTime stamp{};          ///< middle of the exposure
  std::string camera = "cam";  ///< which camera
  std::vector<TagDetection> detections{};
};

/// Where the wheels (and whatever the robot's own driver mixes in) say the robot went since it was switched
/// on.
struct Odometry {
  SensorTime stamp{};
  SE2 odom_T_base{};
  double speed_m_s = 0;       ///< along base x
  double yaw_rate_rad_s = 0;  ///< about base z
};

/// How far each side's wheels have turned since the robot was switched on.
struct WheelTicks {
  SensorTime stamp{};
  double left_rad = 0;
  double right_rad = 0;
};

struct ImuSample {
  SensorTime stamp{};
  Eigen::Vector3d angular_velocity_rad_s =
      Eigen::Vector3d::Zero();  ///< of base in an inertial frame, in base axes
  Eigen::Vector3d linear_acceleration_m_s2 = Eigen::Vector3d::Zero();  ///< specific force, in base axes
};

/// What the wheels are asked to do. All zero: stop.
struct VelocityCommand {
  double speed_m_s = 0;
  double yaw_rate_rad_s = 0;

  friend bool operator==(const VelocityCommand&, const VelocityCommand&) = default;
};

/// A command as it was given.
struct StampedCommand {
  SensorTime stamp{};
  VelocityCommand command{};
};

/// What only a simulator or a motion capture system knows. Never an input of an estimator.
struct TruthPose {
  SensorTime stamp{};
  SE3 map_T_base{};
};

/// Anything a source gives, in stamp order.
using Sample = std::variant<TagFrame, Odometry, WheelTicks, ImuSample, StampedCommand, TruthPose>;

/// The stamp of any sample.
[[nodiscard]] inline SensorTime stamp_of(const Sample& sample) {
  return std::visit([](const auto& value) { return value.stamp; }, sample);
}

}  // namespace waymark
