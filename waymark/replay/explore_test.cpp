#include "waymark/replay/explore.hpp"

#include <cmath>
#include <limits>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"

namespace waymark {
namespace {

using std::chrono::milliseconds;

const RobotModel kRobot{.hull = {.front_m = 0.16, .rear_m = 0.16, .width_m = 0.22, .height_m = 0.25}};

SensorTime at(int ms) { return SensorTime(milliseconds(ms)); }

/// A full scan from the middle of a room with walls ahead, behind and on both sides.
LaserScan room(int ms, double ahead_m, double left_m, double right_m, double behind_m = 2) {
  LaserScan scan{.stamp = at(ms),
                 .angle_min_rad = -std::numbers::pi,
                 .angle_increment_rad = std::numbers::pi / 180,
                 .range_min_m = 0.05,
                 .range_max_m = 8};
  for (int i = 0; i < 360; ++i) {
    const double a = scan.angle_min_rad + i * scan.angle_increment_rad;
    const double x = std::cos(a) > 0 ? ahead_m / std::cos(a) : behind_m / -std::cos(a);
    const double y = std::sin(a) > 0 ? left_m / std::sin(a) : right_m / -std::sin(a);
    scan.ranges_m.push_back(static_cast<float>(std::min(std::abs(x), std::abs(y))));
  }
  return scan;
}

Explorer explorer(std::uint64_t seed = 1, const ExploreOptions& options = {}) {
  return {options, kRobot, SE2(), Random(seed)};
}

TEST(Explorer, StopsWithoutAScanAndWithAnOldOne) {
  Explorer wander = explorer();
  EXPECT_EQ(wander.step(at(0)).command, VelocityCommand{});
  testing::expect_on_page("replay", wander.step(at(0)).reason.value_or(""));
  wander.add(room(0, 3, 2, 2));
  EXPECT_GT(wander.step(at(500)).command.speed_m_s, 0);
  const ExploreStep old = wander.step(at(501));
  EXPECT_EQ(old.command, VelocityCommand{});
  EXPECT_THAT(old.reason.value_or(""),
              ::testing::AllOf(::testing::HasSubstr("0.50 s"), ::testing::HasSubstr("limit")));
  testing::expect_on_page("replay", old.reason.value_or(""));
  wander.add(room(2000, 3, 2, 2));
  EXPECT_TRUE(wander.step(at(1000)).reason) << "a scan with a future timestamp is not fresh";
}

TEST(Explorer, MeasuresTheFreeDistanceAheadOfTheHull) {
  Explorer wander = explorer();
  wander.add(room(0, 1.16, 2, 2));
  EXPECT_NEAR(wander.free_ahead_m(), 1.0, 1e-3);
  LaserScan scan{
      .stamp = at(0), .angle_min_rad = 0, .angle_increment_rad = 0.1, .range_min_m = 0.1, .range_max_m = 8};
  // One obstacle half a metre ahead and 0.24 m to the left, just beyond 0.11 + 0.12 m.
  scan.angle_min_rad = std::atan2(0.24, 0.5);
  scan.ranges_m = {static_cast<float>(std::hypot(0.24, 0.5))};
  wander.add(scan);
  EXPECT_TRUE(std::isinf(wander.free_ahead_m()));
  scan.angle_min_rad = std::atan2(0.22, 0.5);
  scan.ranges_m = {static_cast<float>(std::hypot(0.22, 0.5))};
  wander.add(scan);
  EXPECT_NEAR(wander.free_ahead_m(), 0.34, 1e-3);
  scan.ranges_m = {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(), 0.01F,
                   9.0F};
  wander.add(scan);
  EXPECT_TRUE(std::isinf(wander.free_ahead_m())) << "an invalid range is not an obstacle";
}

TEST(Explorer, UsesTheMountingOfTheLidar) {
  Explorer straight = explorer();
  straight.add(room(0, 1.0, 2, 2));
  // The lidar is mounted backwards, so its rear points ahead of the robot.
  Explorer turned({}, kRobot, SE2(0, 0, std::numbers::pi), Random(1));
  turned.add(room(0, 2, 2, 2, 1.0));
  EXPECT_NEAR(turned.free_ahead_m(), straight.free_ahead_m(), 1e-6);
}

TEST(Explorer, TurnsTowardsMoreSpaceUntilThePathIsFree) {
  for (const bool left_is_free : {true, false}) {
    Explorer wander = explorer(7);
    const auto blocked = [&](int ms) {
      return room(ms, 0.4, left_is_free ? 3 : 0.5, left_is_free ? 0.5 : 3);
    };
    int ms = 0;
    for (int i = 0; i < 40; ++i, ms += 50) {
      wander.add(blocked(ms));
      const ExploreStep step = wander.step(at(ms));
      EXPECT_EQ(step.state, ExploreState::Turn);
      EXPECT_EQ(step.command.speed_m_s, 0);
      EXPECT_EQ(step.command.yaw_rate_rad_s > 0, left_is_free);
    }
    EXPECT_EQ(wander.turns(), 1) << "a long turn is counted once";
    bool drives = false;
    for (int i = 0; i < 80 && !drives; ++i, ms += 50) {
      wander.add(room(ms, 3, 2, 2));
      drives = wander.step(at(ms)).state == ExploreState::Forward;
    }
    EXPECT_TRUE(drives);
  }
}

TEST(Explorer, ReportsObstaclesOnAllSides) {
  Explorer wander = explorer();
  ExploreStep step;
  for (int ms = 0; ms < 60000 && !step.reason; ms += 50) {
    wander.add(room(ms, 0.3, 0.3, 0.3, 0.3));
    step = wander.step(at(ms));
  }
  testing::expect_on_page("replay", step.reason.value_or(""));
  EXPECT_EQ(step.command, VelocityCommand{});
}

TEST(Explorer, HasTheGivenHeadingNoiseAndIsReproducible) {
  const ExploreOptions options{.heading_noise_rad_s = 0.25, .heading_noise_s = 0.5};
  Explorer wander = explorer(3, options);
  Explorer twin = explorer(3, options);
  double sum = 0;
  double squares = 0;
  constexpr int kSteps = 20000;
  for (int i = 0; i < kSteps; ++i) {
    const LaserScan scan = {.stamp = at(50 * i)};
    wander.add(scan);
    twin.add(scan);
    const VelocityCommand command = wander.step(at(50 * i)).command;
    ASSERT_EQ(command, twin.step(at(50 * i)).command);
    sum += command.yaw_rate_rad_s;
    squares += command.yaw_rate_rad_s * command.yaw_rate_rad_s;
  }
  EXPECT_NEAR(sum / kSteps, 0, 0.02);
  EXPECT_NEAR(std::sqrt(squares / kSteps), 0.25, 0.02);
}

}  // namespace
}  // namespace waymark
