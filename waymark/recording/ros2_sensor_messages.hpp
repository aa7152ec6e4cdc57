#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "waymark/recording/byte_io.hpp"
#include "waymark/recording/ros2_geometry_messages.hpp"

/// sensor_msgs.
namespace waymark::ros2 {

struct Imu {
  static constexpr std::string_view kType = "sensor_msgs/msg/Imu";
  Header header{};
  Quaternion orientation{};
  std::array<double, 9> orientation_covariance{-1};  ///< first element -1: no orientation
  Vector3 angular_velocity{};                        ///< [rad/s]
  std::array<double, 9> angular_velocity_covariance{};
  Vector3 linear_acceleration{};  ///< [m/s^2]
  std::array<double, 9> linear_acceleration_covariance{};
  WAYMARK_ROS2_FIELDS(self.header, self.orientation, self.orientation_covariance, self.angular_velocity,
                      self.angular_velocity_covariance, self.linear_acceleration,
                      self.linear_acceleration_covariance)
};

struct JointState {
  static constexpr std::string_view kType = "sensor_msgs/msg/JointState";
  Header header{};
  std::vector<std::string> name{};
  std::vector<double> position{};  ///< [rad]
  std::vector<double> velocity{};  ///< [rad/s]
  std::vector<double> effort{};
  WAYMARK_ROS2_FIELDS(self.header, self.name, self.position, self.velocity, self.effort)
};

struct RegionOfInterest {
  std::uint32_t x_offset = 0, y_offset = 0, height = 0, width = 0;
  bool do_rectify = false;
  WAYMARK_ROS2_FIELDS(self.x_offset, self.y_offset, self.height, self.width, self.do_rectify)
};

/// Pixel centres at integers, as ROS has them: c_x and c_y are half a pixel less than in CameraModel.
struct CameraInfo {
  static constexpr std::string_view kType = "sensor_msgs/msg/CameraInfo";
  Header header{};
  std::uint32_t height = 0, width = 0;
  std::string distortion_model{};
  std::vector<double> d{};
  std::array<double, 9> k{};
  std::array<double, 9> r{};
  std::array<double, 12> p{};
  std::uint32_t binning_x = 0, binning_y = 0;
  RegionOfInterest roi{};
  WAYMARK_ROS2_FIELDS(self.header, self.height, self.width, self.distortion_model, self.d, self.k, self.r,
                      self.p, self.binning_x, self.binning_y, self.roi)
};

struct Image {
  static constexpr std::string_view kType = "sensor_msgs/msg/Image";
  Header header{};
  std::uint32_t height = 0, width = 0;
  std::string encoding{};         ///< "mono8", "bgr8", … (sensor_msgs/image_encodings.hpp)
  std::uint8_t is_bigendian = 0;  ///< of 16-bit pixels
  std::uint32_t step = 0;         ///< [byte] from row to row
  Bytes data{};
  WAYMARK_ROS2_FIELDS(self.header, self.height, self.width, self.encoding, self.is_bigendian, self.step,
                      self.data)
};

struct CompressedImage {
  static constexpr std::string_view kType = "sensor_msgs/msg/CompressedImage";
  Header header{};
  std::string format{};  ///< "jpeg", "png", "bgr8; jpeg compressed bgr8", …
  Bytes data{};
  WAYMARK_ROS2_FIELDS(self.header, self.format, self.data)
};

/// ranges[i] lies in direction angle_min + i * angle_increment [rad] about z of the sensor.
struct LaserScan {
  static constexpr std::string_view kType = "sensor_msgs/msg/LaserScan";
  Header header{};
  float angle_min = 0, angle_max = 0, angle_increment = 0;  ///< [rad]
  float time_increment = 0, scan_time = 0;                  ///< [s] from ray to ray, from scan to scan
  float range_min = 0, range_max = 0;                       ///< [m]
  std::vector<float> ranges{};                              ///< [m]
  std::vector<float> intensities{};
  WAYMARK_ROS2_FIELDS(self.header, self.angle_min, self.angle_max, self.angle_increment, self.time_increment,
                      self.scan_time, self.range_min, self.range_max, self.ranges, self.intensities)
};

struct Joy {
  static constexpr std::string_view kType = "sensor_msgs/msg/Joy";
  Header header{};
  std::vector<float> axes{};
  std::vector<std::int32_t> buttons{};
  WAYMARK_ROS2_FIELDS(self.header, self.axes, self.buttons)
};

}  // namespace waymark::ros2
