#pragma once

#include "waymark/base/fields.hpp"
#include "waymark/base/random.hpp"
#include "waymark/samples/robot_model.hpp"
#include "waymark/samples/robot_samples.hpp"
#include "waymark/simulation/robot_dynamics.hpp"

namespace waymark {

/// How far wheels and gyro are from the truth.
struct MotionSensorOptions {
  double left_wheel_scale = 1.02;
  double right_wheel_scale = 1.02;
  double ticks_per_turn = 1000;
  double gyro_noise_rad_s = 0.005;
  double gyro_bias_rad_s = 0.002;
  double acceleration_noise_m_s2 = 0.05;

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.left_wheel_scale,
          Field{"left_wheel_scale", "Ticks of the left wheels over what they should be.", 0.5, 2});
    visit(self.right_wheel_scale,
          Field{"right_wheel_scale", "Ticks of the right wheels over what they should be.", 0.5, 2});
    visit(self.ticks_per_turn, Field{"ticks_per_turn", "Resolution of the wheel encoders.", 1});
    visit(self.gyro_noise_rad_s, Field{"gyro_noise_rad_s", "Standard deviation of each yaw rate.", 0, 10});
    visit(self.gyro_bias_rad_s, Field{"gyro_bias_rad_s", "Constant error of the yaw rate.", -1, 1});
    visit(self.acceleration_noise_m_s2,
          Field{"acceleration_noise_m_s2", "Standard deviation of each acceleration.", 0, 100});
  }
};

/// Wheels, gyro and the odometry a driver makes of them: distance from the wheels, heading from the gyro.
/// Deterministic by seed.
class MotionSensors {
 public:
  MotionSensors(const RobotModel& model, const MotionSensorOptions& options, Random random);

  /// What the encoders say now.
  [[nodiscard]] WheelTicks read_wheels(const RobotDynamics& robot) const;
  /// What the IMU says now.
  [[nodiscard]] ImuSample read_imu(const RobotDynamics& robot);
  /// Advances the odometry to now and gives it.
  [[nodiscard]] Odometry read_odometry(const RobotDynamics& robot);

 private:
  RobotModel model_;
  MotionSensorOptions options_;
  Random random_;
  Odometry odometry_{};
  WheelTicks last_ticks_{};
  bool started_ = false;
};

}  // namespace waymark
