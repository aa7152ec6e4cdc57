#pragma once

#include <cstdint>
#include <vector>

#include "waymark/robots/limo/frame_clock.hpp"
#include "waymark/robots/limo/limo_odometry.hpp"

namespace waymark {

/// Turns the frames that LIMO sends into samples. Stamps are of the steady clock of this machine, smoothed to
/// the even beat of the robot. Pure.
class LimoBridge {
 public:
  explicit LimoBridge(double wheel_radius_m) : wheel_radius_m_(wheel_radius_m) {}

  /// `drive`: how its wheels are mounted; `lost`: bytes before this frame were not understood.
  [[nodiscard]] std::vector<Sample> receive(const LimoFrame& frame, LimoDrive drive, Duration arrived,
                                            bool lost);
  /// Frames with a right checksum and numbers that no LIMO means.
  [[nodiscard]] std::uint64_t refused() const { return refused_; }
  /// Of the odometry: whether its heading is that of the IMU.
  [[nodiscard]] bool hears_imu(SensorTime now) const { return odometry_.hears_imu(now); }

 private:
  [[nodiscard]] std::vector<Sample> imu(const LimoFrame& frame, SensorTime stamp);

  double wheel_radius_m_;
  LimoOdometry odometry_{};
  FrameClock motion_clock_{};
  FrameClock odometer_clock_{};
  FrameClock gyro_clock_{};
  FrameClock yaw_clock_{};
  bool lost_motion_ = false;
  bool lost_odometer_ = false;
  bool lost_gyro_ = false;
  bool lost_yaw_ = false;
  Eigen::Vector3d acceleration_m_s2_ = Eigen::Vector3d::Zero();
  std::uint64_t refused_ = 0;
};

}  // namespace waymark
