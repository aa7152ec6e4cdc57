#include "waymark/simulation/robot/robot_dynamics.hpp"

#include <chrono>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

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

TEST(Dynamics, APerfectRobotDrivesACircle) {
  RobotDynamics robot(small_robot(), exact(), SE2(), Random(1));
  for (int i = 0; i < 400; ++i)
    robot.step({0.5, 0.5}, std::chrono::milliseconds(5));  // 2 s, minus the acceleration ramps
  // The radius is v / w = 1 about (0, 1), however long the acceleration takes (both ramps have the same
  // duration relative to their speed).
  const double v_loss = 0.5 * 0.5 / 2 / 2;  // ramp of 0.25 s at 2 m/s^2
  EXPECT_NEAR(robot.map_T_base().yaw(), 1.0 - 0.5 * 0.5 / 6 / 2, 5e-3);
  EXPECT_NEAR(robot.wheel_ticks().right_rad + robot.wheel_ticks().left_rad, 2 * (1.0 - v_loss) / 0.045, 0.2);
}

TEST(Dynamics, CommandsActAfterTheDelayWithTheTurnResponseGain) {
  DynamicsOptions options = exact();
  options.command_delay_s = 0.1;
  options.turn_gain = 0.8;
  RobotDynamics robot(small_robot(), options, SE2(), Random(1));
  for (int i = 0; i < 20; ++i) robot.step({0, 1.0}, kStep);
  EXPECT_EQ(robot.yaw_rate_rad_s(), 0);
  for (int i = 0; i < 100; ++i) robot.step({0, 1.0}, kStep);
  EXPECT_NEAR(robot.yaw_rate_rad_s(), 0.8, 1e-9);
}

TEST(Dynamics, AStationaryRobotDoesNotMove) {
  RobotDynamics robot(small_robot(), {}, SE2(1, 2, 3), Random(1));
  for (int i = 0; i < 1000; ++i) robot.step({}, kStep);
  EXPECT_EQ(robot.map_T_base(), SE2(1, 2, 3));
}

RobotModel robot_model(double track_m = 0.172) {
  return {
      .limits = {.speed_m_s = 1, .yaw_rate_rad_s = 3, .acceleration_m_s2 = 2, .yaw_acceleration_rad_s2 = 8},
      .wheel_radius_m = 0.045,
      .track_m = track_m};
}

DynamicsOptions ackermann() {
  DynamicsOptions options = exact();
  options.drive = "ackermann";
  options.steering_lag_s = 0.1;
  return options;
}

TEST(Ackermann, DrivesTheRadiusOfItsSteeringAngle) {
  RobotDynamics robot(robot_model(), ackermann(), SE2(), Random(1));
  for (int i = 0; i < 400; ++i) robot.step({0.4, 0.5}, kStep);  // by then the wheels have turned
  EXPECT_NEAR(robot.steering_rad(), std::atan(0.2 * 0.5 / 0.4), 1e-6);
  const SE2 start = robot.map_T_base();
  const Eigen::Vector2d centre = start * Eigen::Vector2d(0, 0.8);  // v / w to the left
  double worst = 0;
  for (int i = 0; i < 3000; ++i) {
    robot.step({0.4, 0.5}, kStep);
    worst = std::max(worst, std::abs((robot.map_T_base().translation() - centre).norm() - 0.8));
  }
  EXPECT_LT(worst, 1e-6);
}

TEST(Ackermann, CannotTurnTighterThanItsRadiusNorOnTheSpot) {
  RobotDynamics robot(robot_model(), ackermann(), SE2(), Random(1));
  for (int i = 0; i < 1000; ++i) robot.step({0, 1.5}, kStep);
  EXPECT_EQ(robot.map_T_base(), SE2()) << "it does not move";
  for (int i = 0; i < 1000; ++i) robot.step({0.3, 3}, kStep);
  EXPECT_NEAR(robot.speed_m_s() / robot.yaw_rate_rad_s(), 0.4, 1e-6);
}

TEST(Ackermann, SteeringFollowsWithItsLagAndRate) {
  DynamicsOptions options = ackermann();
  options.steering_rate_rad_s = 100;
  RobotDynamics robot(robot_model(), options, SE2(), Random(1));
  for (int i = 0; i < 200; ++i) robot.step({0.3, 0}, kStep);
  const double wanted = std::atan(0.2 * 0.3 / 0.3);
  for (int i = 0; i < 20; ++i) robot.step({0.3, 0.3}, kStep);  // one time constant
  EXPECT_NEAR(robot.steering_rad(), wanted * (1 - std::exp(-1)), 1e-9);
  options.steering_rate_rad_s = 0.5;
  RobotDynamics slow(robot_model(), options, SE2(), Random(1));
  for (int i = 0; i < 20; ++i) slow.step({0.3, 0.3}, kStep);
  EXPECT_NEAR(slow.steering_rad(), 0.05, 1e-9) << "0.1 s at 0.5 rad/s";
}

TEST(Dynamics, SlippingWheelsTurnMoreThanTheRobotMoves) {
  RobotDynamics robot(robot_model(), exact(), SE2(), Random(1));
  for (int i = 0; i < 200; ++i) robot.step({0.5, 0}, kStep);
  const SE2 before = robot.map_T_base();
  const double wheels = robot.wheel_ticks().left_rad;
  robot.set_grip({.speed_share = 0.25, .yaw_share = 0});
  for (int i = 0; i < 200; ++i) robot.step({0.5, 0}, kStep);
  const double rolled = (robot.wheel_ticks().left_rad - wheels) * 0.045;
  EXPECT_NEAR(rolled, 0.5, 1e-9);
  EXPECT_NEAR((before.inverse() * robot.map_T_base()).x(), 0.25 * rolled, 1e-9);
}

}  // namespace
}  // namespace waymark
