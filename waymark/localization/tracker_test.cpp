// What the filter is told wrongly, it notices: a start, odometry that jumps, a robot that is carried.
#include <cmath>

#include <gtest/gtest.h>

#include "tests/support/laser_robot.hpp"

namespace waymark {
namespace {

using test::laser_filter;
using test::laser_points;
using test::laser_time;
using test::LaserRobot;
using test::off_m;
using test::says;

TEST(AStartThatIsGiven, IsCertainWhenTheFirstTagsAgree) {
  RiekfLocalizer filter = laser_filter();
  LaserRobot robot;
  filter.start_from(robot.truth, 0.05, 0.05);
  robot.drive(filter, 1, false);
  ASSERT_TRUE(filter.estimate());
  EXPECT_FALSE(filter.estimate()->certain) << "nobody has confirmed it";
  robot.drive(filter, 0.3);
  EXPECT_TRUE(filter.estimate()->certain);
  EXPECT_LT(off_m(filter, robot), 0.1);
  EXPECT_TRUE(filter.problems().empty());
}

TEST(AStartThatIsGiven, IsGivenUpWhenTheyDoNot) {
  for (const SE2& off : {SE2(1.5, 1, 1), SE2(0, 0, 3), SE2(-0.5, 0, 0)}) {
    RiekfLocalizer filter = laser_filter();
    LaserRobot robot;
    filter.start_from(robot.truth * off, 0.05, 0.05);
    int certain_and_wrong = 0;
    for (int i = 0; i < 100; ++i) {
      robot.drive(filter, 0.02);
      certain_and_wrong += filter.estimate()->certain && off_m(filter, robot) > 0.2 ? 1 : 0;
    }
    EXPECT_EQ(certain_and_wrong, 0) << off.x();
    EXPECT_TRUE(filter.estimate()->certain) << off.x();
    EXPECT_LT(off_m(filter, robot), 0.1) << off.x();
    EXPECT_TRUE(says(filter, "assumed start")) << off.x();
  }
}

// Pictures come late: what was seen before somebody said where the robot is must not bring back the old
// place.
TEST(APoseThatIsGivenInTheMiddle, CountsWhateverWasEstimatedBefore) {
  RiekfLocalizer filter = laser_filter();
  LaserRobot robot;
  robot.drive(filter, 3);
  ASSERT_TRUE(filter.estimate()->certain);
  const LaserRobot before = robot;
  robot.truth = SE2(-1, 1, 2);  // carried
  ASSERT_TRUE(filter.restart_from(
      {robot.truth * SE2(0.02, 0.02, 0.02), Eigen::Vector3d(4e-3, 4e-3, 4e-3).asDiagonal()}));
  EXPECT_LT(off_m(filter, robot), 0.03);
  EXPECT_FALSE(filter.estimate()->certain) << "no tag has said so";
  for (const LandmarkPoint& point : laser_points()) {
    const Eigen::Vector2d p = before.truth.inverse() * point.map_p;
    filter.add(
        RangeBearing{laser_time(before.seconds - 0.05), point.number, p.norm(), std::atan2(p.y(), p.x())});
  }
  robot.drive(filter, 0.06, false);
  EXPECT_LT(off_m(filter, robot), 0.05) << "what was seen before the robot was carried says nothing";
  robot.drive(filter, 0.3);
  EXPECT_TRUE(filter.estimate()->certain);
  EXPECT_LT(off_m(filter, robot), 0.1);
  EXPECT_TRUE(filter.problems().empty()) << "it was not lost";
}

TEST(APoseThatIsGivenInTheMiddle, IsGivenUpWhenTagsContradict) {
  RiekfLocalizer filter = laser_filter();
  LaserRobot robot;
  robot.drive(filter, 3);
  filter.restart_from({robot.truth * SE2(1, 1, 1), Eigen::Vector3d(0.01, 0.01, 0.01).asDiagonal()});
  int certain_and_wrong = 0;
  for (int i = 0; i < 100; ++i) {
    robot.drive(filter, 0.02);
    certain_and_wrong += filter.estimate()->certain && off_m(filter, robot) > 0.2 ? 1 : 0;
  }
  EXPECT_EQ(certain_and_wrong, 0);
  EXPECT_TRUE(filter.estimate()->certain);
  EXPECT_LT(off_m(filter, robot), 0.1);
}

// What is said of it is what happened: one tag refutes a pose and gives none, two give another.
TEST(APoseThatIsGivenInTheMiddle, IsNotCalledLocalisedBeforeTwoTagsAgree) {
  RiekfLocalizer filter = laser_filter();
  LaserRobot robot;
  robot.drive(filter, 3);
  robot.in_view = 1;
  filter.restart_from({robot.truth * SE2(1, 1, 1), Eigen::Vector3d(0.01, 0.01, 0.01).asDiagonal()});
  robot.drive(filter, 1);
  EXPECT_FALSE(filter.estimate()->certain);
  EXPECT_TRUE(says(filter, "do not agree with the pose that was given: the robot is not localised"))
      << ::testing::PrintToString(filter.problems());
  robot.in_view = 8;
  robot.drive(filter, 2);
  EXPECT_TRUE(filter.estimate()->certain);
  EXPECT_TRUE(
      says(filter, "do not agree with the pose that was given: the robot was localised from the tags"))
      << ::testing::PrintToString(filter.problems());
  EXPECT_FALSE(says(filter, "lost and found"));
}

TEST(OdometryThatJumps, IsSaidAndTheRobotIsLookedForAnew) {
  RiekfLocalizer filter = laser_filter();
  LaserRobot robot;
  robot.drive(filter, 3);
  ASSERT_TRUE(filter.estimate() && filter.estimate()->certain);
  robot.odom = SE2(40, -7, 2);  // the counter was set back, and the robot was carried
  robot.truth = SE2(0.5, 0.5, -2);
  int certain_and_wrong = 0;
  for (int i = 0; i < 100; ++i) {
    robot.drive(filter, 0.02);
    certain_and_wrong +=
        filter.estimate() && filter.estimate()->certain && off_m(filter, robot) > 0.3 ? 1 : 0;
  }
  EXPECT_EQ(certain_and_wrong, 0);
  EXPECT_TRUE(filter.estimate()->certain);
  EXPECT_LT(off_m(filter, robot), 0.1);
  EXPECT_TRUE(says(filter, "odometry jumped 1 time"));
}

TEST(ARobotThatIsCarried, IsSaidToHaveBeenLostAndFound) {
  RiekfLocalizer filter = laser_filter();
  LaserRobot robot;
  robot.drive(filter, 3);
  EXPECT_FALSE(says(filter, "lost"));
  robot.truth = SE2(0.5, 0.5, -2);  // the wheels know nothing of it
  robot.drive(filter, 3);
  EXPECT_LT(off_m(filter, robot), 0.1);
  EXPECT_TRUE(says(filter, "lost and found again, 1 time")) << ::testing::PrintToString(filter.problems());
}

}  // namespace
}  // namespace waymark
