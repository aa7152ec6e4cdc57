#include "waymark/live/commission_limit.hpp"

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

TEST(CommissionLimit, SlowsOnTheSameArc) {
  const VelocityCommand slow = slowed({.speed_m_s = -0.6, .yaw_rate_rad_s = 1}, 0.15);
  EXPECT_DOUBLE_EQ(slow.speed_m_s, -0.15);
  EXPECT_DOUBLE_EQ(slow.yaw_rate_rad_s, 0.25);
  const VelocityCommand turn{.yaw_rate_rad_s = 1};
  EXPECT_EQ(slowed(turn, 0.15), turn);
}

}  // namespace
}  // namespace waymark
