#include "waymark/robots/limo/limo_odometry.hpp"

#include <chrono>
#include <cmath>
#include <numbers>

namespace waymark {
namespace {

constexpr Duration kImuAge = std::chrono::milliseconds(200);
constexpr double kMostLeap_m_s = 0.5;   ///< from feedback to feedback
constexpr double kMostLeap_rad = 0.35;  ///< from yaw to yaw
constexpr double kLongestStep_s = 0.5;

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
      yaw_ && stamp - yaw_->stamp < kImuAge && std::abs(turned(yaw_->value, yaw_rad)) > kMostLeap_rad;
  if (sudden && !(doubtful_yaw_ && std::abs(turned(*doubtful_yaw_, yaw_rad)) < kMostLeap_rad)) {
    doubtful_yaw_ = yaw_rad;
    return;
  }
  // A leap that is believed is one of the IMU (it was set to zero), not of the robot.
  if (sudden) odom_R_imu_rad_ -= turned(yaw_->value, yaw_rad);
  doubtful_yaw_.reset();
  yaw_ = Measured{yaw_ ? yaw_->value + turned(yaw_->value, yaw_rad) : yaw_rad, stamp};
}

bool LimoOdometry::hears_imu(SensorTime now) const { return yaw_ && now - yaw_->stamp < kImuAge; }

double LimoOdometry::heading_at(SensorTime stamp, double wheel_yaw_rate_rad_s, double dt_s) {
  if (!hears_imu(stamp)) {
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
  const bool sudden = speed_m_s_ && std::abs(speed_m_s - *speed_m_s_) > kMostLeap_m_s;
  if (sudden && !(doubtful_speed_m_s_ && std::abs(speed_m_s - *doubtful_speed_m_s_) < kMostLeap_m_s)) {
    doubtful_speed_m_s_ = speed_m_s;
    return std::nullopt;
  }
  doubtful_speed_m_s_.reset();
  const double dt_s = newest_ ? std::min(to_seconds(stamp - *newest_), kLongestStep_s) : 0;
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

}  // namespace waymark
