#include "waymark/robots/limo/limo_bridge.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>
#include <utility>

namespace waymark {
namespace {

constexpr int kLearning = 32;         ///< number of messages before the estimated period is used
constexpr int kWindow = 16;           ///< number of messages whose earliest arrival corrects phase and period
constexpr double kPhaseShare = 0.25;  ///< fraction of the lateness found in a window that corrects the phase
constexpr double kPeriodShare = 0.1;  ///< fraction of the drift within a window that corrects the period
constexpr double kMaxGapPeriods = 25;  ///< a longer silence restarts the estimate
constexpr double kMinPeriod_s = 5e-4;  ///< a shorter period results from a backlog of messages
constexpr double kMissing = 0.6;  ///< if even the earliest message is this late, one is missing [periods]

SensorTime time_of(double seconds) {
  return SensorTime(Duration(static_cast<std::int64_t>(std::round(seconds * 1e9))));
}

}  // namespace

std::optional<double> FrameClock::period_s() const {
  return messages_ < kLearning ? std::nullopt : std::optional(period_s_);
}

void FrameClock::learn(double arrived_s) {
  if (messages_ == 0) first_s_ = arrived_s;
  beat_s_ = arrived_s;
  if (messages_ > 0) period_s_ = (arrived_s - first_s_) / messages_;
}

void FrameClock::correct(double late_s) {
  least_late_s_ = in_window_ == 0 ? late_s : std::min(least_late_s_, late_s);
  if (late_s < 0) {  // a message cannot arrive before it was sent
    beat_s_ += late_s;
    least_late_s_ -= late_s;
    period_s_ += kPeriodShare * late_s / kWindow;
  }
  if (++in_window_ < kWindow) return;
  in_window_ = 0;
  if (least_late_s_ > kMissing * period_s_) {
    beat_s_ += std::round(least_late_s_ / period_s_) * period_s_;
    return;
  }
  beat_s_ += kPhaseShare * least_late_s_;
  period_s_ += kPeriodShare * least_late_s_ / kWindow;
}

SensorTime FrameClock::stamp(Duration arrived, bool lost) {
  const double arrived_s = to_seconds(arrived);
  const bool useless = period_s_ < kMinPeriod_s || arrived_s - beat_s_ > kMaxGapPeriods * period_s_;
  if (messages_ >= kLearning && useless) messages_ = 0;
  if (messages_ < kLearning) {
    learn(arrived_s);
  } else {
    const double beats = lost ? std::round((arrived_s - beat_s_) / period_s_) : 1;
    beat_s_ += std::max(1.0, beats) * period_s_;
    correct(arrived_s - beat_s_);
  }
  ++messages_;
  SensorTime stamp = time_of(std::min(beat_s_, arrived_s));
  if (newest_) stamp = std::max(stamp, *newest_ + Duration(1));
  newest_ = stamp;
  return stamp;
}

namespace {

constexpr Duration kImuAge = std::chrono::milliseconds(200);
constexpr double kMaxSpeedStep_m_s = 0.5;  ///< between two feedback messages
constexpr double kMaxYawStep_rad = 0.35;   ///< between two yaw messages
constexpr double kMaxStep_s = 0.5;

double turned(double from_rad, double to_rad) {
  return std::remainder(to_rad - from_rad, 2 * std::numbers::pi);
}

double wheel_yaw_rate(const LimoMotion& motion, LimoDrive drive) {
  return drive == LimoDrive::Ackermann ? motion.speed_m_s * curvature_of_steering(motion.steering_rad)
                                       : motion.yaw_rate_rad_s;
}

}  // namespace

void LimoOdometry::receive_angular_velocity(double yaw_rate_rad_s, SensorTime stamp) {
  yaw_rate_ = Measured{yaw_rate_rad_s, stamp};
}

void LimoOdometry::receive_yaw(double yaw_rad, SensorTime stamp) {
  const bool sudden =
      yaw_ && stamp - yaw_->stamp < kImuAge && std::abs(turned(yaw_->value, yaw_rad)) > kMaxYawStep_rad;
  if (sudden && !(unconfirmed_yaw_ && std::abs(turned(*unconfirmed_yaw_, yaw_rad)) < kMaxYawStep_rad)) {
    unconfirmed_yaw_ = yaw_rad;
    return;
  }
  // A confirmed step is a reset of the IMU, not motion of the robot.
  if (sudden) odom_R_imu_rad_ -= turned(yaw_->value, yaw_rad);
  unconfirmed_yaw_.reset();
  yaw_ = Measured{yaw_ ? yaw_->value + turned(yaw_->value, yaw_rad) : yaw_rad, stamp};
}

bool LimoOdometry::has_imu(SensorTime now) const { return yaw_ && now - yaw_->stamp < kImuAge; }

double LimoOdometry::heading_at(SensorTime stamp, double wheel_yaw_rate_rad_s, double dt_s) {
  if (!has_imu(stamp)) {
    by_imu_ = false;
    return heading_rad_ + wheel_yaw_rate_rad_s * dt_s;
  }
  const double rate = yaw_rate_ ? yaw_rate_->value : wheel_yaw_rate_rad_s;
  const double imu_rad = yaw_->value + rate * to_seconds(stamp - yaw_->stamp);
  if (!by_imu_) odom_R_imu_rad_ = heading_rad_ + wheel_yaw_rate_rad_s * dt_s - imu_rad;
  by_imu_ = true;
  return imu_rad + odom_R_imu_rad_;
}

std::optional<Odometry> LimoOdometry::receive(const LimoMotion& motion, LimoDrive drive, SensorTime stamp) {
  const double speed_m_s = motion.speed_m_s;
  const bool sudden = speed_m_s_ && std::abs(speed_m_s - *speed_m_s_) > kMaxSpeedStep_m_s;
  if (sudden &&
      !(unconfirmed_speed_m_s_ && std::abs(speed_m_s - *unconfirmed_speed_m_s_) < kMaxSpeedStep_m_s)) {
    unconfirmed_speed_m_s_ = speed_m_s;
    return std::nullopt;
  }
  unconfirmed_speed_m_s_.reset();
  const double dt_s = newest_ ? std::min(to_seconds(stamp - *newest_), kMaxStep_s) : 0;
  const double wheels_rad_s = wheel_yaw_rate(motion, drive);
  const double heading_rad = heading_at(stamp, wheels_rad_s, dt_s);
  const double along_m = dt_s * (speed_m_s + speed_m_s_.value_or(speed_m_s)) / 2;
  const double left_m = drive == LimoDrive::Mecanum ? dt_s * motion.lateral_m_s : 0;
  const SO2 middle((heading_rad + heading_rad_) / 2);
  odom_T_base_ =
      SE2(SO2(heading_rad), odom_T_base_.translation() + middle * Eigen::Vector2d(along_m, left_m));
  heading_rad_ = heading_rad;
  speed_m_s_ = speed_m_s;
  newest_ = stamp;
  return Odometry{.stamp = stamp,
                  .odom_T_base = odom_T_base_,
                  .speed_m_s = speed_m_s,
                  .yaw_rate_rad_s = by_imu_ && yaw_rate_ ? yaw_rate_->value : wheels_rad_s};
}

std::vector<Sample> LimoBridge::imu(const LimoFrame& frame, SensorTime stamp) {
  const Eigen::Vector3d angular_velocity_rad_s = decode_angular_velocity_rad_s(frame);
  odometry_.receive_angular_velocity(angular_velocity_rad_s.z(), stamp);
  return {ImuSample{.stamp = stamp,
                    .angular_velocity_rad_s = angular_velocity_rad_s,
                    .linear_acceleration_m_s2 = acceleration_m_s2_}};
}

std::vector<Sample> LimoBridge::receive(const LimoFrame& frame, LimoDrive drive, Duration arrived,
                                        bool lost) {
  // The lost message may belong to any of the clocks.
  if (lost) lost_motion_ = lost_odometer_ = lost_gyro_ = lost_yaw_ = true;
  switch (static_cast<LimoId>(frame.id)) {
    case LimoId::MotionFeedback: {
      const SensorTime stamp = motion_clock_.stamp(arrived, std::exchange(lost_motion_, false));
      const auto motion = decode_motion(frame);
      const auto odometry = motion ? odometry_.receive(*motion, drive, stamp) : std::nullopt;
      if (odometry) return {*odometry};
      ++rejected_;
      return {};
    }
    case LimoId::Odometer: {
      const LimoOdometer odometer = decode_odometer(frame);
      return {WheelTicks{.stamp = odometer_clock_.stamp(arrived, std::exchange(lost_odometer_, false)),
                         .left_rad = odometer.left_m / wheel_radius_m_,
                         .right_rad = odometer.right_m / wheel_radius_m_}};
    }
    case LimoId::Acceleration:
      acceleration_m_s2_ = decode_acceleration_m_s2(frame);
      return {};
    case LimoId::AngularVelocity:
      return imu(frame, gyro_clock_.stamp(arrived, std::exchange(lost_gyro_, false)));
    case LimoId::Attitude:
      odometry_.receive_yaw(decode_attitude_rad(frame).x(),
                            yaw_clock_.stamp(arrived, std::exchange(lost_yaw_, false)));
      return {};
    default:
      return {};
  }
}

}  // namespace waymark
