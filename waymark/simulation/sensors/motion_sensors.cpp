#include "waymark/simulation/sensors/motion_sensors.hpp"

#include <cmath>
#include <numbers>
#include <utility>

#include "waymark/base/angles.hpp"

namespace waymark {

MotionSensors::MotionSensors(const RobotModel& model, const MotionSensorOptions& options, Random random)
    : model_(model),
      options_(options),
      method_(options.odometry == "wheels"    ? Method::Wheels
              : options.odometry == "imu_yaw" ? Method::ImuYaw
              : options.odometry == "truth"   ? Method::Truth
                                              : Method::Gyro),
      random_(std::move(random)),
      bias_rad_s_(options.gyro_bias_rad_s) {}

WheelTicks MotionSensors::read_wheels(const RobotDynamics& robot) const {
  const double tick_rad = 2 * std::numbers::pi / options_.ticks_per_turn;
  const WheelTicks truth = robot.wheel_ticks();
  const auto counted = [&](double angle_rad) { return std::floor(angle_rad / tick_rad) * tick_rad; };
  return {truth.stamp, counted(options_.left_wheel_scale * truth.left_rad),
          counted(options_.right_wheel_scale * truth.right_rad)};
}

/// The yaw rate with its errors; advances the random walk of the bias since the last reading.
double MotionSensors::gyro(const RobotDynamics& robot) {
  if (options_.gyro_bias_walk > 0) {
    const double dt_s = to_seconds(robot.now() - bias_stamp_);
    bias_rad_s_ += options_.gyro_bias_walk * std::sqrt(dt_s) * random_.normal();
    bias_stamp_ = robot.now();
  }
  return robot.yaw_rate_rad_s() + bias_rad_s_ + options_.gyro_noise_rad_s * random_.normal();
}

ImuSample MotionSensors::read_imu(const RobotDynamics& robot) {
  constexpr double kGravity = 9.80665;
  const Eigen::Vector3d twist = robot.twist();
  const double noise = options_.acceleration_noise_m_s2;
  const double roll_rate = options_.gyro_noise_rad_s * random_.normal();
  const double pitch_rate = options_.gyro_noise_rad_s * random_.normal();
  const double yaw_rate = gyro(robot);
  const double forward = robot.acceleration_m_s2() + noise * random_.normal();
  const double left = twist.x() * twist.z() + noise * random_.normal();
  return {.stamp = robot.now(),
          .angular_velocity_rad_s = {roll_rate, pitch_rate, yaw_rate},
          .linear_acceleration_m_s2 = {forward, left, kGravity + noise * random_.normal()}};
}

/// The turn measured by the IMU's angle that remains after the driver's deadband.
double MotionSensors::dropped(double turned_rad) {
  constexpr double kResolution = to_radians(0.01);  // resolution of the transmitted angle
  imu_yaw_rad_ += turned_rad;
  const double step = std::round(imu_yaw_rad_ / kResolution) * kResolution;
  imu_yaw_rad_ -= step;  // consumed, whether or not it is used
  return std::abs(step) < to_radians(options_.yaw_deadband_deg) ? 0 : step;
}

void MotionSensors::follow_truth(const RobotDynamics& robot) {
  if (!started_) map_T_odom_ = robot.map_T_base();
  const double m = options_.odometry_noise_m;
  for (const int axis : {0, 1}) drift_[axis] += m * random_.normal();
  drift_.z() += options_.odometry_noise_rad * random_.normal();
  const SE2 true_T = map_T_odom_.inverse() * robot.map_T_base();
  odometry_.odom_T_base = SE2(true_T.x() + drift_.x(), true_T.y() + drift_.y(), true_T.yaw() + drift_.z());
  odometry_.speed_m_s = robot.twist().x();
  odometry_.yaw_rate_rad_s = robot.yaw_rate_rad_s();
}

Odometry MotionSensors::read_odometry(const RobotDynamics& robot) {
  const WheelTicks ticks = read_wheels(robot);
  if (method_ == Method::Truth) {
    follow_truth(robot);
  } else {
    const double left_rad = ticks.left_rad - last_ticks_.left_rad;
    const double right_rad = ticks.right_rad - last_ticks_.right_rad;
    const double dt_s = started_ ? to_seconds(ticks.stamp - last_ticks_.stamp) : 0;
    const double distance = started_ ? model_.wheel_radius_m * (left_rad + right_rad) / 2 : 0;
    double yaw_rate = 0;
    double turned = 0;
    if (method_ == Method::Wheels) {
      turned = options_.rotation_scale * model_.wheel_radius_m * (right_rad - left_rad) / model_.track_m;
      yaw_rate = dt_s > 0 ? turned / dt_s : 0;
    } else {
      yaw_rate = options_.rotation_scale * gyro(robot);
      turned = yaw_rate * dt_s;
      if (method_ == Method::ImuYaw) turned = dropped(turned);
    }
    if (started_) odometry_.odom_T_base = odometry_.odom_T_base * SE2::exp({distance, 0, turned});
    odometry_.speed_m_s = dt_s > 0 ? distance / dt_s : 0;
    odometry_.yaw_rate_rad_s = yaw_rate;
  }
  odometry_.stamp = ticks.stamp;
  last_ticks_ = ticks;
  started_ = true;
  return odometry_;
}

}  // namespace waymark
