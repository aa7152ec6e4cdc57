#pragma once

#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include <Eigen/Core>

#include "waymark/base/time.hpp"
#include "waymark/geometry/se2.hpp"
#include "waymark/geometry/se3.hpp"
#include "waymark/image/image.hpp"
#include "waymark/samples/tag_detection.hpp"

/// What a robot says and what it is told, as plain values with a stamp of the sensor's clock.
namespace waymark {

/// The tags found in one picture; an empty list says that the camera looked and saw none.
struct TagFrame {
  SensorTime stamp{};          ///< middle of the exposure
  std::string camera = "cam";  ///< which camera
  std::vector<TagDetection> detections{};
};

/// A picture, grey.
struct CameraFrame {
  SensorTime stamp{};          ///< middle of the exposure
  std::string camera = "cam";  ///< which camera
  Image image{};
};

/// A tag as the robot's own software placed it before the camera, where a log has no corners.
struct SeenTagPose {
  TagId tag{};
  SE3 cam_T_tag{};  ///< tag frame: centre, x right, y down, z into the tag
};

/// All of one picture.
struct TagPoseFrame {
  SensorTime stamp{};
  std::string camera = "cam";
  std::vector<SeenTagPose> tags{};
};

/// Distance and direction of a landmark with a number, in the plane of the sensor.
struct RangeBearing {
  SensorTime stamp{};
  std::int64_t landmark = 0;
  double range_m = 0;
  double bearing_rad = 0;  ///< counter-clockwise from the sensor's x axis
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

/// One turn of a planar lidar: ranges_m[i] lies in direction angle_min_rad + i * angle_increment_rad about
/// the sensor's z axis. What is not in [range_min_m, range_max_m] (or not a number) saw nothing.
struct LaserScan {
  SensorTime stamp{};  ///< of the first ray
  double angle_min_rad = 0;
  double angle_increment_rad = 0;
  double time_increment_s = 0;  ///< from ray to ray
  double range_min_m = 0;
  double range_max_m = 0;
  std::vector<float> ranges_m{};
};

/// Sticks and buttons of a gamepad.
struct GamepadState {
  SensorTime stamp{};
  std::vector<float> axes{};            ///< -1 to 1
  std::vector<std::int32_t> buttons{};  ///< 1 pressed
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
using Sample = std::variant<TagFrame, Odometry, WheelTicks, ImuSample, StampedCommand, TruthPose, CameraFrame,
                            TagPoseFrame, RangeBearing, LaserScan, GamepadState>;

/// The stamp of any sample.
[[nodiscard]] inline SensorTime stamp_of(const Sample& sample) {
  return std::visit([](const auto& value) { return value.stamp; }, sample);
}

}  // namespace waymark
