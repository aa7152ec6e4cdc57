// Compares simulated wheels, IMU and driver odometry with measurements from real robots.
#include "waymark/simulation/sensors/motion_sensors.hpp"

#include <chrono>
#include <cmath>
#include <functional>
#include <numbers>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "waymark/base/angles.hpp"

namespace waymark {
namespace {

constexpr Duration kStep = std::chrono::milliseconds(5);

RobotModel small_robot() {
  return {
      .name = "test",
      .hull = {.front_m = 0.16, .rear_m = 0.16, .width_m = 0.22, .height_m = 0.25},
      .limits = {.speed_m_s = 1, .yaw_rate_rad_s = 2, .acceleration_m_s2 = 2, .yaw_acceleration_rad_s2 = 6},
      .wheel_radius_m = 0.045,
      .track_m = 0.172,
      .base_T_cam = SE3()};
}

DynamicsOptions exact() {
  return {.speed_lag_s = 0,
          .yaw_rate_lag_s = 0,
          .command_delay_s = 0,
          .turn_gain = 1,
          .lateral_slip_s = 0,
          .slip_noise_m_s = 0};
}

TEST(MotionSensors, WithoutErrorsOdometryIsExact) {
  RobotDynamics robot(small_robot(), exact(), SE2(), Random(1));
  MotionSensors sensors(small_robot(),
                        {.left_wheel_scale = 1,
                         .right_wheel_scale = 1,
                         .ticks_per_turn = 1e6,
                         .gyro_noise_rad_s = 0,
                         .gyro_bias_rad_s = 0},
                        Random(2));
  Odometry odometry = sensors.read_odometry(robot);
  for (int i = 0; i < 2000; ++i) {
    robot.step({0.4, 0.3}, kStep);
    odometry = sensors.read_odometry(robot);
  }
  const SE2 difference = odometry.odom_T_base.inverse() * robot.map_T_base();
  EXPECT_LT(difference.log().norm(), 5e-3);
}

TEST(MotionSensors, WheelScaleScalesOdometry) {
  RobotDynamics robot(small_robot(), exact(), SE2(), Random(1));
  MotionSensors sensors(
      small_robot(),
      {.left_wheel_scale = 1.05, .right_wheel_scale = 1.05, .gyro_noise_rad_s = 0, .gyro_bias_rad_s = 0},
      Random(2));
  (void)sensors.read_odometry(robot);
  for (int i = 0; i < 1000; ++i) robot.step({0.5, 0}, kStep);
  EXPECT_NEAR(sensors.read_odometry(robot).odom_T_base.x() / robot.map_T_base().x(), 1.05, 1e-3);
}

TEST(Simulation, TheSameSeedGivesTheSameRun) {
  const auto run = [] {
    RobotDynamics robot(small_robot(), {}, SE2(), Random(7));
    MotionSensors sensors(small_robot(), {}, Random(8));
    for (int i = 0; i < 500; ++i) robot.step({0.3, 0.2}, kStep);
    return std::pair(robot.map_T_base(), sensors.read_imu(robot).angular_velocity_rad_s.z());
  };
  EXPECT_EQ(run(), run());
}

RobotModel robot_model(double track_m = 0.172) {
  return {
      .limits = {.speed_m_s = 1, .yaw_rate_rad_s = 3, .acceleration_m_s2 = 2, .yaw_acceleration_rad_s2 = 8},
      .wheel_radius_m = 0.045,
      .track_m = track_m};
}

MotionSensorOptions no_errors() {
  return {.left_wheel_scale = 1,
          .right_wheel_scale = 1,
          .ticks_per_turn = 1e6,
          .gyro_noise_rad_s = 0,
          .gyro_bias_rad_s = 0,
          .acceleration_noise_m_s2 = 0};
}

/// Simulates a driver's odometry; `command` is applied for `seconds` at 50 messages per second.
struct Drive {
  SE2 truth;
  Odometry odometry;
  double turned_rad = 0;
};

Drive drive(const MotionSensorOptions& options, const VelocityCommand& command, double seconds,
            const RobotModel& model = robot_model()) {
  RobotDynamics robot(model, exact(), SE2(), Random(1));
  MotionSensors sensors(model, options, Random(2));
  Drive run;
  for (int i = 0; i < seconds / to_seconds(kStep); ++i) {
    if (i % 4 == 0) run.odometry = sensors.read_odometry(robot);
    robot.step(command, kStep);
    run.turned_rad += robot.yaw_rate_rad_s() * to_seconds(kStep);
  }
  run.odometry = sensors.read_odometry(robot);
  run.truth = robot.map_T_base();
  return run;
}

TEST(Imu, MeasuresLongitudinalAndCentripetalAcceleration) {
  RobotDynamics robot(robot_model(), exact(), SE2(), Random(1));
  MotionSensors sensors(robot_model(), no_errors(), Random(2));
  robot.step({1, 0}, kStep);
  EXPECT_NEAR(sensors.read_imu(robot).linear_acceleration_m_s2.x(), 2, 1e-9) << "the limit of the driver";
  for (int i = 0; i < 400; ++i) robot.step({0.5, 1}, kStep);
  const ImuSample imu = sensors.read_imu(robot);
  EXPECT_NEAR(imu.linear_acceleration_m_s2.x(), 0, 1e-9);
  EXPECT_NEAR(imu.linear_acceleration_m_s2.y(), 0.5, 1e-9) << "v w, to the left";
  EXPECT_NEAR(imu.angular_velocity_rad_s.z(), 1, 1e-9);
}

// The stock LIMO driver drops turns below 0.1 degrees per message, which is 5 deg/s at 50 messages per
// second. The angle has a resolution of a hundredth of a degree, so just below that limit some messages read
// 0.10 and are accepted.
TEST(OdometryOfLimo, DropsTurningBelowFiveDegreesASecond) {
  MotionSensorOptions options = no_errors();
  options.odometry = "imu_yaw";
  options.yaw_deadband_deg = 0.1;
  const Drive gentle = drive(options, {0.25, 0.25 / 3.3}, 20);  // a curve with a radius of 3.3 m: 4.3 deg/s
  EXPECT_GT(gentle.turned_rad, 1.5);
  EXPECT_EQ(gentle.odometry.odom_T_base.yaw(), 0) << "its odometry is straight";
  EXPECT_GT((gentle.odometry.odom_T_base.inverse() * gentle.truth).translation().norm(), 2.0);
  const Drive partly = drive(options, {0.25, 0.25 / 3.0}, 20);  // 4.77 deg/s
  EXPECT_LT(partly.odometry.odom_T_base.yaw(), 0.7 * partly.turned_rad);
  const Drive tighter = drive(options, {0.25, 0.25 / 2.5}, 20);  // 5.73 deg/s
  EXPECT_NEAR(std::remainder(tighter.odometry.odom_T_base.yaw() - tighter.turned_rad, 2 * std::numbers::pi),
              0, 0.01);
  options.yaw_deadband_deg = 0;
  const Drive repaired = drive(options, {0.25, 0.25 / 3.3}, 20);
  EXPECT_NEAR(repaired.odometry.odom_T_base.yaw(), repaired.truth.yaw(), to_radians(0.02))
      << "only the angle resolution and the ramp at the start";
}

// MBot: a driver that uses a track of 0.15572 m instead of the true 0.1696 m measured 20.519 rad in three
// laps, which are 6 pi.
TEST(OdometryOfMbot, MeasuresNinePercentTooMuchRotation) {
  MotionSensorOptions options = no_errors();
  options.odometry = "wheels";
  options.rotation_scale = 1.089;
  options.ticks_per_turn = 3120;
  const Drive run = drive(options, {0.2, 0.5}, 6 * std::numbers::pi / 0.5 + 0.03125, robot_model(0.1696));
  ASSERT_NEAR(run.turned_rad, 6 * std::numbers::pi, 0.01);
  EXPECT_NEAR(std::remainder(run.odometry.odom_T_base.yaw() - 20.519, 2 * std::numbers::pi), 0, 0.04);
}

// The odometry of the Academy's simulator is a random walk along world axes, independent of the heading.
TEST(OdometryOfTheAcademy, IsARandomWalkAndItsHeadingErrorRotatesNoTranslation) {
  MotionSensorOptions options = no_errors();
  options.odometry = "truth";
  options.odometry_noise_m = 0.001;
  options.odometry_noise_rad = 0.001;
  constexpr int kWalks = 300;
  constexpr int kMessages = 1000;  // 20 s at 50 messages per second
  Eigen::Vector3d squares = Eigen::Vector3d::Zero();
  for (int walk = 0; walk < kWalks; ++walk) {
    RobotDynamics robot(robot_model(), exact(), SE2(1, 2, 0.7), Random(1));
    MotionSensors sensors(robot_model(), options, Random(static_cast<std::uint64_t>(walk)));
    Odometry odometry;
    for (int i = 0; i < kMessages; ++i) odometry = sensors.read_odometry(robot);  // the robot is stationary
    const SE2& d = odometry.odom_T_base;
    squares += Eigen::Vector3d(d.x(), d.y(), d.yaw()).cwiseAbs2();
  }
  const double expected = 0.001 * std::sqrt(kMessages);  // 0.0316, which is 0.007 per square root of a second
  for (const double square : {squares.x(), squares.y(), squares.z()})
    EXPECT_NEAR(std::sqrt(square / kWalks) / expected, 1, 4 / std::sqrt(2.0 * kWalks));
  // When driving straight ahead with a large heading error, the translation still has the true direction.
  options.odometry_noise_m = 0;
  options.odometry_noise_rad = 0.05;
  const Drive run = drive(options, {0.5, 0}, 20);
  EXPECT_GT(std::abs(run.odometry.odom_T_base.yaw()), 0.05);
  EXPECT_LT((run.odometry.odom_T_base.translation() - run.truth.translation()).norm(), 1e-9);
}

// Overlapping Allan deviation (IEEE Std 952-1997, annex C). For white noise it decreases with the square root
// of the averaging time; for a random walk of the bias it increases with it.
double allan_deviation(const std::vector<double>& rates, double dt_s, std::size_t m) {
  std::vector<double> angle(1, 0.0);
  for (const double rate : rates) angle.push_back(angle.back() + rate * dt_s);
  const double tau_s = static_cast<double>(m) * dt_s;
  double sum = 0;
  const std::size_t count = angle.size() - 2 * m;
  for (std::size_t k = 0; k < count; ++k) {
    const double second = angle[k + 2 * m] - 2 * angle[k + m] + angle[k];
    sum += second * second;
  }
  return std::sqrt(sum / (2 * tau_s * tau_s * static_cast<double>(count)));
}

std::vector<double> standing_gyro(double noise, double walk, int seconds) {
  MotionSensorOptions options = no_errors();
  options.gyro_noise_rad_s = noise;
  options.gyro_bias_rad_s = 0.002;
  options.gyro_bias_walk = walk;
  RobotDynamics robot(robot_model(), exact(), SE2(), Random(1));
  MotionSensors sensors(robot_model(), options, Random(3));
  std::vector<double> rates;
  for (int i = 0; i < 100 * seconds; ++i) {
    robot.step({}, std::chrono::milliseconds(10));
    rates.push_back(sensors.read_imu(robot).angular_velocity_rad_s.z());
  }
  return rates;
}

TEST(Imu, AllanDeviationOfTheGyroMatchesItsNoise) {
  const double random_walk = 0.005 * std::sqrt(0.01);  // angle random walk N is sigma sqrt(dt)
  const auto white = standing_gyro(0.005, 0, 2000);
  for (const std::size_t m : {10U, 100U, 1000U}) {
    const double tau_s = 0.01 * static_cast<double>(m);
    EXPECT_NEAR(allan_deviation(white, 0.01, m) / (random_walk / std::sqrt(tau_s)), 1, 0.1) << tau_s;
  }
  const auto wandering = standing_gyro(0, 1e-3, 2000);
  for (const std::size_t m : {100U, 1000U}) {
    const double tau_s = 0.01 * static_cast<double>(m);
    EXPECT_NEAR(allan_deviation(wandering, 0.01, m) / (1e-3 * std::sqrt(tau_s / 3)), 1, 0.15) << tau_s;
  }
}

}  // namespace
}  // namespace waymark
