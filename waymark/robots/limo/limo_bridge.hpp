#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "waymark/base/time.hpp"
#include "waymark/robots/limo/limo_messages.hpp"

namespace waymark {

/// Estimates timestamps for periodic messages that have none from their arrival times. Delays (buffers in the
/// UART and the USB bridge, the scheduler) can only make a message late. The timestamps therefore follow the
/// earliest recent arrivals with a constant, estimated period. Olson describes the same idea for messages
/// with timestamps from the sender: "A passive solution to the sensor synchronization problem" (IROS 2010),
/// section III. Timestamps use the same clock as the arrivals, are never later than the arrival, and are
/// strictly increasing.
class FrameClock {
 public:
  /// `lost`: whether bytes before the message were unreadable, so that a message may be missing.
  [[nodiscard]] SensorTime stamp(Duration arrived, bool lost = false);
  /// The estimated period; `nullopt` until enough messages have arrived.
  [[nodiscard]] std::optional<double> period_s() const;

 private:
  void learn(double arrived_s);
  void correct(double late_s);

  int messages_ = 0;
  double first_s_ = 0;
  double period_s_ = 0;
  double beat_s_ = 0;        ///< estimated time of the newest message
  double least_late_s_ = 0;  ///< smallest lateness in the current window
  int in_window_ = 0;
  std::optional<SensorTime> newest_{};
};

/// Odometry for LIMO. The distance is integrated from the speed in the motion feedback (0x221; the unit is as
/// in LIMO's own driver). The heading is the yaw angle of the IMU (0x323), extrapolated to the time of the
/// feedback using the gyro (0x322). All yaw steps are used; LIMO's own driver drops steps below 0.1 degrees
/// per message, and thus slow turns. If there are no IMU messages, the wheels determine the heading. Frame
/// odom is the pose at the first feedback.
class LimoOdometry {
 public:
  void receive_angular_velocity(double yaw_rate_rad_s, SensorTime stamp);
  void receive_yaw(double yaw_rad, SensorTime stamp);
  /// `nullopt` if the speed changes by an implausible amount; such a step is accepted if the next feedback
  /// confirms it.
  [[nodiscard]] std::optional<Odometry> receive(const LimoMotion& motion, LimoDrive drive, SensorTime stamp);
  [[nodiscard]] bool has_imu(SensorTime now) const;

 private:
  [[nodiscard]] double heading_at(SensorTime stamp, double wheel_yaw_rate_rad_s, double dt_s);

  struct Measured {
    double value = 0;
    SensorTime stamp{};
  };
  std::optional<Measured> yaw_rate_{};
  std::optional<Measured> yaw_{};  ///< yaw of the IMU, unwrapped
  std::optional<double> unconfirmed_yaw_{};
  double odom_R_imu_rad_ = 0;
  bool by_imu_ = false;
  double heading_rad_ = 0;
  std::optional<double> unconfirmed_speed_m_s_{};
  std::optional<double> speed_m_s_{};
  std::optional<SensorTime> newest_{};
  SE2 odom_T_base_{};
};

/// Converts LIMO's frames to samples. Timestamps refer to this computer's steady clock and are smoothed by
/// one FrameClock for each message type. Pure.
class LimoBridge {
 public:
  explicit LimoBridge(double wheel_radius_m) : wheel_radius_m_(wheel_radius_m) {}

  /// `drive` is LIMO's drive. `lost`: whether bytes before this frame were unreadable.
  [[nodiscard]] std::vector<Sample> receive(const LimoFrame& frame, LimoDrive drive, Duration arrived,
                                            bool lost);
  /// Number of frames with a correct checksum but implausible values.
  [[nodiscard]] std::uint64_t rejected() const { return rejected_; }
  /// Whether the heading in the odometry comes from the IMU.
  [[nodiscard]] bool has_imu(SensorTime now) const { return odometry_.has_imu(now); }

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
  std::uint64_t rejected_ = 0;
};

}  // namespace waymark
