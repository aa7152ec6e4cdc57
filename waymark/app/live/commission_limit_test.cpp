#include "waymark/app/live/commission_limit.hpp"

#include <gtest/gtest.h>

namespace waymark {
namespace {

RobotSetup setup() {
  RobotSetup made = load_setup("", "limo", 1).value();
  made.ground = {.robot = "process:python3 my_robot.py", .topics = ""};
  return made;
}

CommissionRecord passed(const RobotSetup& setup) {
  const RobotModel& model = setup.simulated.model;
  return {.passed = true,
          .robot = setup.ground.robot,
          .limits = model.limits,
          .wheel_radius_m = model.wheel_radius_m,
          .track_m = model.track_m};
}

TEST(CommissionLimit, HoldsForARealRobotUntilItsFirstDrivePassed) {
  RobotSetup robot = setup();
  const auto why = lacks_commission(robot, {});
  ASSERT_TRUE(why);
  EXPECT_NE(why->find("holds no first drive"), std::string::npos) << *why;
  EXPECT_NE(why->find("waymark commission --robot 'process:python3 my_robot.py' --robot-file"),
            std::string::npos)
      << *why;
  EXPECT_FALSE(lacks_commission(robot, {.simulated = true}));
  EXPECT_FALSE(lacks_commission(robot, {.lockstep = true})) << "no wheels wait for a computer";
  robot.commissioned = passed(robot);
  EXPECT_FALSE(lacks_commission(robot, {}));
}

TEST(CommissionLimit, SaysWhyAFirstDriveDoesNotCount) {
  RobotSetup robot = setup();
  robot.commissioned = passed(robot);
  robot.simulated.model.track_m = 0.3;
  EXPECT_NE(lacks_commission(robot, {})->find("no longer counts: wheels.track_m was 0.172, and is 0.3"),
            std::string::npos);
  robot.commissioned->passed = false;
  robot.commissioned->failed = {"stop.kill"};
  EXPECT_NE(lacks_commission(robot, {})->find("did not pass (stop.kill)"), std::string::npos);
}

constexpr MotionLimits kLimits{.speed_m_s = 1, .yaw_rate_rad_s = 2};

TEST(CommissionLimit, SlowsOnTheSameArc) {
  const VelocityCommand slow = slowed({.speed_m_s = -0.6, .yaw_rate_rad_s = 1}, 0.15, kLimits);
  EXPECT_DOUBLE_EQ(slow.speed_m_s, -0.15);
  EXPECT_DOUBLE_EQ(slow.yaw_rate_rad_s, 0.25);
  const VelocityCommand turn{.yaw_rate_rad_s = 1};
  EXPECT_EQ(slowed(turn, 0.15, kLimits), turn);
}

TEST(CommissionLimit, KeepsWithinTheRobotsLimits) {
  constexpr double kAny = std::numeric_limits<double>::infinity();
  const VelocityCommand fast = slowed({.speed_m_s = 9, .yaw_rate_rad_s = -9}, kAny, kLimits);
  EXPECT_DOUBLE_EQ(fast.speed_m_s, 1);
  EXPECT_DOUBLE_EQ(fast.yaw_rate_rad_s, -1) << "the same arc";
  const VelocityCommand spin = slowed({.speed_m_s = 0.1, .yaw_rate_rad_s = 20}, kAny, kLimits);
  EXPECT_DOUBLE_EQ(spin.speed_m_s, 0.01);
  EXPECT_DOUBLE_EQ(spin.yaw_rate_rad_s, 2);
  const VelocityCommand calm{.speed_m_s = 0.9, .yaw_rate_rad_s = 1.9};
  EXPECT_EQ(slowed(calm, kAny, kLimits), calm);
}

}  // namespace
}  // namespace waymark
