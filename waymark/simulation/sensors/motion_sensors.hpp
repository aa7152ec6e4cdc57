#pragma once

#include <string>

#include "waymark/base/fields.hpp"
#include "waymark/base/random.hpp"
#include "waymark/samples/robot_model.hpp"
#include "waymark/samples/robot_samples.hpp"
#include "waymark/simulation/robot/robot_dynamics.hpp"

namespace waymark {

/// Errors of the wheels and the gyro, and of the odometry computed by the robot's own driver.
struct MotionSensorOptions {
  double left_wheel_scale = 1.02;
  double right_wheel_scale = 1.02;
  double ticks_per_turn = 1000;
  double gyro_noise_rad_s = 0.005;
  double gyro_bias_rad_s = 0.002;
  double gyro_bias_walk = 0;
  double acceleration_noise_m_s2 = 0.05;
  std::string odometry = "gyro";
  double rotation_scale = 1;
  double yaw_deadband_deg = 0;
  double odometry_noise_m = 0;
  double odometry_noise_rad = 0;

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.left_wheel_scale,
          Field{"left_wheel_scale", "Scale error of the left wheel encoders: counted over true ticks.", 0.5,
                2});
    visit(self.right_wheel_scale,
          Field{"right_wheel_scale", "Scale error of the right wheel encoders: counted over true ticks.", 0.5,
                2});
    visit(self.ticks_per_turn, Field{"ticks_per_turn", "Resolution of the wheel encoders.", 1});
    visit(self.gyro_noise_rad_s,
          Field{"gyro_noise_rad_s", "Standard deviation of each yaw rate measurement.", 0, 10});
    visit(self.gyro_bias_rad_s, Field{"gyro_bias_rad_s", "Initial bias of the yaw rate.", -1, 1});
    visit(
        self.gyro_bias_walk,
        Field{"gyro_bias_walk", "Random walk of the gyro's bias, rad/s per square root of a second.", 0, 1});
    visit(self.acceleration_noise_m_s2,
          Field{"acceleration_noise_m_s2", "Standard deviation of each acceleration measurement.", 0, 100});
    visit(self.odometry, Field{"odometry",
                               "Source of the odometry: wheels (distance and heading), gyro (heading from "
                               "the gyro), imu_yaw (heading from the IMU's yaw angle), or truth (true pose "
                               "with odometry_noise, as in some simulators)."});
    visit(self.rotation_scale,
          Field{"rotation_scale", "Scale error of the odometry's rotation: measured over true rotation.", 0.1,
                10});
    visit(self.yaw_deadband_deg,
          Field{"yaw_deadband_deg",
                "Yaw change between two messages below which the driver of imu_yaw ignores it.", 0, 10});
    visit(self.odometry_noise_m, Field{"odometry_noise_m",
                                       "Standard deviation that each message of odometry truth adds to x and "
                                       "y, also at rest; the heading error does not rotate the translation.",
                                       0, 1});
    visit(self.odometry_noise_rad,
          Field{"odometry_noise_rad",
                "Standard deviation that each message of odometry truth adds to the heading.", 0, 1});
  }
};

/// Wheels, gyro, and the odometry that a driver computes from them. Deterministic for a given seed.
class MotionSensors {
 public:
  MotionSensors(const RobotModel& model, const MotionSensorOptions& options, Random random);

  /// Current encoder readings.
  [[nodiscard]] WheelTicks read_wheels(const RobotDynamics& robot) const;
  /// Current IMU reading.
  [[nodiscard]] ImuSample read_imu(const RobotDynamics& robot);
  /// Advances the odometry to the present and returns it.
  [[nodiscard]] Odometry read_odometry(const RobotDynamics& robot);

 private:
  enum class Method { Gyro, Wheels, ImuYaw, Truth };
  [[nodiscard]] double gyro(const RobotDynamics& robot);
  [[nodiscard]] double dropped(double turned_rad);
  void follow_truth(const RobotDynamics& robot);

  RobotModel model_;
  MotionSensorOptions options_;
  Method method_;
  Random random_;
  double bias_rad_s_;
  SensorTime bias_stamp_{};
  Odometry odometry_{};
  WheelTicks last_ticks_{};
  double imu_yaw_rad_ = 0;  ///< IMU angle already consumed by the driver
  SE2 map_T_odom_{};        ///< true pose of the odometry frame
  Eigen::Vector3d drift_ = Eigen::Vector3d::Zero();
  bool started_ = false;
};

}  // namespace waymark
