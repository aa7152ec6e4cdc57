#include "waymark/simulation/robot/scripted_driver.hpp"

#include <chrono>
#include <cmath>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "waymark/simulation/robot/robot_dynamics.hpp"

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

std::vector<Eigen::Vector2d> circle(double radius, int points) {
  std::vector<Eigen::Vector2d> result;
  for (int i = 0; i < points; ++i) {
    const double a = 2 * std::numbers::pi * i / points;
    result.emplace_back(radius * std::cos(a), radius * std::sin(a));
  }
  return result;
}

TEST(Driver, DrivesALapWithDeviationsAndStops) {
  DriverOptions options;
  options.speed_m_s = 0.4;
  const auto path = sample_path(circle(2.0, 60), true, 0.02);
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    RobotDynamics robot(small_robot(), {}, path[0].map_T_path, Random(seed));
    ScriptedDriver driver(path, true, options, Random(seed + 100));
    double worst = 0;
    double driven = 0;
    for (int i = 0; i < 20000 && !driver.done(); ++i) {
      robot.step(driver.drive(robot.map_T_base(), robot.now()), kStep);
      worst = std::max(worst, std::abs(robot.map_T_base().translation().norm() - 2.0));
      driven += robot.speed_m_s() * to_seconds(kStep);
    }
    EXPECT_TRUE(driver.done());
    EXPECT_LT(worst, 0.15);
    EXPECT_GT(worst, 0.005) << "a person deviates from the line";
    EXPECT_NEAR(driven, 4 * std::numbers::pi + options.overlap_m, 0.4);
  }
}

TEST(Driver, AClockThatGoesBackGivesFiniteCommands) {
  const auto path = sample_path({{0, 0}, {1, 0.1}, {2, 0}}, false, 0.02);
  ScriptedDriver driver(path, false, {}, Random(1));
  for (const int ms : {1000, 1050, 900, 950, 1100}) {
    const VelocityCommand command = driver.drive(SE2(), SensorTime(std::chrono::milliseconds(ms)));
    EXPECT_TRUE(std::isfinite(command.speed_m_s)) << ms;
    EXPECT_TRUE(std::isfinite(command.yaw_rate_rad_s)) << ms;
  }
}

}  // namespace
}  // namespace waymark
