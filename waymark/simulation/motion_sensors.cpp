#include "waymark/simulation/motion_sensors.hpp"

#include <cmath>
#include <numbers>
#include <utility>

namespace waymark {

MotionSensors::MotionSensors(const RobotModel& model, const MotionSensorOptions& options, Random random)
    : model_(model), options_(options), random_(std::move(random)) {}

WheelTicks MotionSensors::read_wheels(const RobotDynamics& robot) const {
  const double tick_rad = 2 * std::numbers::pi / options_.ticks_per_turn;
  const WheelTicks truth = robot.wheel_ticks();
  const auto counted = [&](double angle_rad) { return std::floor(angle_rad / tick_rad) * tick_rad; };
  return {truth.stamp, counted(options_.left_wheel_scale * truth.left_rad),
          counted(options_.right_wheel_scale * truth.right_rad)};
}

ImuSample MotionSensors::read_imu(const RobotDynamics& robot) {
  constexpr double kGravity = 9.80665;
  const double v = robot.speed_m_s();
  const double w = robot.yaw_rate_rad_s();
  const double noise = options_.acceleration_noise_m_s2;
  return {
      .stamp = robot.now(),
      .angular_velocity_rad_s = {options_.gyro_noise_rad_s * random_.normal(),
                                 options_.gyro_noise_rad_s * random_.normal(),
                                 w + options_.gyro_bias_rad_s + options_.gyro_noise_rad_s * random_.normal()},
      .linear_acceleration_m_s2 = {noise * random_.normal(), v * w + noise * random_.normal(),
                                   kGravity + noise * random_.normal()}};
}

Odometry MotionSensors::read_odometry(const RobotDynamics& robot) {
  const WheelTicks ticks = read_wheels(robot);
  const double yaw_rate =
      robot.yaw_rate_rad_s() + options_.gyro_bias_rad_s + options_.gyro_noise_rad_s * random_.normal();
  if (started_) {
    const double dt_s = to_seconds(ticks.stamp - last_ticks_.stamp);
    const double turned = (ticks.left_rad - last_ticks_.left_rad) + (ticks.right_rad - last_ticks_.right_rad);
    const double distance = model_.wheel_radius_m * turned / 2;
    odometry_.odom_T_base = odometry_.odom_T_base * SE2::exp({distance, 0, yaw_rate * dt_s});
    odometry_.speed_m_s = dt_s > 0 ? distance / dt_s : 0;
  }
  odometry_.yaw_rate_rad_s = yaw_rate;
  odometry_.stamp = ticks.stamp;
  last_ticks_ = ticks;
  started_ = true;
  return odometry_;
}

}  // namespace waymark
