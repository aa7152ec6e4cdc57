#pragma once

#include <optional>

#include "waymark/robots/limo/limo_messages.hpp"

namespace waymark {

/// Odometry of LIMO: the way from the speed of the motion feedback (0x221), whose unit its own driver proves;
/// the heading from the yaw angle of its IMU (0x323), every step of it (LIMO's own driver drops steps below
/// 0.1 degrees a message, and with them slow turns), moved to the moment of the feedback by the gyro (0x322).
/// While no IMU is heard the heading comes from the wheels. Frame odom is where and how the robot stood when
/// it was first heard.
class LimoOdometry {
 public:
  void receive_angular_velocity(double yaw_rate_rad_s, SensorTime stamp);
  void receive_yaw(double yaw_rad, SensorTime stamp);
  /// Nothing where the speed leaps as no robot does: it waits for the next feedback to say so, too.
  [[nodiscard]] std::optional<Odometry> receive(const LimoMotion& motion, LimoDrive drive, SensorTime stamp);
  [[nodiscard]] bool hears_imu(SensorTime now) const;

 private:
  [[nodiscard]] double heading_at(SensorTime stamp, double wheel_yaw_rate_rad_s, double dt_s);

  struct Measured {
    double value = 0;
    SensorTime stamp{};
  };
  std::optional<Measured> yaw_rate_{};
  std::optional<Measured> yaw_{};  ///< of the IMU, without leaps at half a turn
  std::optional<double> doubtful_yaw_{};
  double odom_R_imu_rad_ = 0;
  bool by_imu_ = false;
  double heading_rad_ = 0;
  std::optional<double> doubtful_speed_m_s_{};
  std::optional<double> speed_m_s_{};
  std::optional<SensorTime> newest_{};
  SE2 odom_T_base_{};
};

}  // namespace waymark
