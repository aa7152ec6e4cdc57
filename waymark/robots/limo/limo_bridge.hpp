#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "waymark/base/time.hpp"
#include "waymark/robots/limo/limo_messages.hpp"

namespace waymark {

/// Stamps of messages that a robot sends at even times and that carry none, by when they arrive. What delays
/// a message (the UART's and the USB bridge's buffers, this machine's scheduler) only ever makes it late, so
/// the stamps follow the earliest arrivals of the last messages on an even beat, whose period is learned.
/// The same idea with stamps of the sender: Olson, "A passive solution to the sensor synchronization problem"
/// (IROS 2010), section III. Stamps are on the clock of the arrivals, never after the arrival, and always
/// grow.
class FrameClock {
 public:
  /// `lost`: something before it was not understood, so that a message may be missing.
  [[nodiscard]] SensorTime stamp(Duration arrived, bool lost = false);
  /// Of the messages; nothing while too few came.
  [[nodiscard]] std::optional<double> period_s() const;

 private:
  void learn(double arrived_s);
  void correct(double late_s);

  int messages_ = 0;
  double first_s_ = 0;
  double period_s_ = 0;
  double beat_s_ = 0;        ///< of the newest message
  double least_late_s_ = 0;  ///< in the window that runs
  int in_window_ = 0;
  std::optional<SensorTime> newest_{};
};

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
