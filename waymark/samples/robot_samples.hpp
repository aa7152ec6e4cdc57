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

/// Samples from a robot and commands to it, as plain values stamped on the sensor clock.
namespace waymark {

/// The tags detected in one image; an empty list means that none were detected.
struct TagFrame {
  SensorTime stamp{};          ///< middle of the exposure
  std::string camera = "cam";  ///< name of the camera
  std::vector<TagDetection> detections{};
};

/// Number of detections without usable corners.
[[nodiscard]] inline std::size_t count_unreliable(const std::vector<TagFrame>& frames) {
  std::size_t count = 0;
  for (const TagFrame& frame : frames) count += count_unreliable(frame.detections);
  return count;
}

/// A grey image.
struct CameraFrame {
  SensorTime stamp{};          ///< middle of the exposure
  std::string camera = "cam";  ///< name of the camera
  Image image{};
};

/// The pose of a tag as estimated by the robot's own software, for logs that contain no corners.
struct SeenTagPose {
  TagId tag{};
  SE3 cam_T_tag{};  ///< tag frame: centre, x right, y down, z into the tag
};

/// All tag poses from one image.
struct TagPoseFrame {
  SensorTime stamp{};
  std::string camera = "cam";
  std::vector<SeenTagPose> tags{};
};

/// Range and bearing of a numbered landmark, in the plane of the sensor.
struct RangeBearing {
  SensorTime stamp{};
  std::int64_t landmark = 0;
  double range_m = 0;
  double bearing_rad = 0;  ///< counter-clockwise from the sensor's x axis
};

/// Pose since the robot was switched on, and velocity. They are measured by the wheels and any other sensors
/// that the robot's driver fuses.
struct Odometry {
  SensorTime stamp{};
  SE2 odom_T_base{};
  double speed_m_s = 0;       ///< along base x
  double yaw_rate_rad_s = 0;  ///< about base z
};

/// Rotation of the wheels on each side since the robot was switched on.
struct WheelTicks {
  SensorTime stamp{};
  double left_rad = 0;
  double right_rad = 0;
};

struct ImuSample {
  SensorTime stamp{};
  Eigen::Vector3d angular_velocity_rad_s =
      Eigen::Vector3d::Zero();  ///< of the base relative to an inertial frame, in base axes
  Eigen::Vector3d linear_acceleration_m_s2 = Eigen::Vector3d::Zero();  ///< specific force, in base axes
};

/// One revolution of a planar lidar. ranges_m[i] is measured in direction angle_min_rad + i *
/// angle_increment_rad about the sensor's z axis. A range outside [range_min_m, range_max_m] (or NaN) means
/// that there was no return.
struct LaserScan {
  SensorTime stamp{};  ///< at the first ray
  double angle_min_rad = 0;
  double angle_increment_rad = 0;
  double time_increment_s = 0;  ///< between consecutive rays
  double range_min_m = 0;
  double range_max_m = 0;
  std::vector<float> ranges_m{};
};

/// Sticks and buttons of a gamepad.
struct GamepadState {
  SensorTime stamp{};
  std::vector<float> axes{};            ///< -1 to 1
  std::vector<std::int32_t> buttons{};  ///< 1 if pressed
};

/// Velocity command to the wheels; all zero to stop.
struct VelocityCommand {
  double speed_m_s = 0;
  double yaw_rate_rad_s = 0;

  friend bool operator==(const VelocityCommand&, const VelocityCommand&) = default;
};

/// A command with its stamp.
struct StampedCommand {
  SensorTime stamp{};
  VelocityCommand command{};
};

/// Ground truth from a simulator or a motion capture system. It is never an input of an estimator.
struct TruthPose {
  SensorTime stamp{};
  SE3 map_T_base{};
};

/// Any sample from a source, in stamp order.
using Sample = std::variant<TagFrame, Odometry, WheelTicks, ImuSample, StampedCommand, TruthPose, CameraFrame,
                            TagPoseFrame, RangeBearing, LaserScan, GamepadState>;

/// The stamp of any sample.
[[nodiscard]] inline SensorTime stamp_of(const Sample& sample) {
  return std::visit([](const auto& value) { return value.stamp; }, sample);
}

}  // namespace waymark
