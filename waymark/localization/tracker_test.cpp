// Tests that the tracker detects wrong inputs: a wrong start pose, odometry that jumps, a robot that is moved
// by hand.
#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"
#include "tests/support/laser_robot.hpp"

namespace waymark {
namespace {

using test::findings;
using test::laser_filter;
using test::laser_points;
using test::laser_time;
using test::LaserRobot;
using test::off_m;

TEST(GivenStart, IsCertainWhenTheFirstTagsAgree) {
  RiekfLocalizer filter = laser_filter();
  LaserRobot robot;
  filter.start_from(robot.truth, 0.05, 0.05);
  robot.drive(filter, 1, false);
  ASSERT_TRUE(filter.estimate());
  EXPECT_FALSE(filter.estimate()->certain) << "no tag has confirmed it";
  robot.drive(filter, 0.3);
  EXPECT_TRUE(filter.estimate()->certain);
  EXPECT_LT(off_m(filter, robot), 0.1);
  EXPECT_TRUE(filter.problems().empty());
}

TEST(GivenStart, IsDroppedWhenTheFirstTagsContradict) {
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
    EXPECT_EQ(filter.tracker().refused_starts(), 1) << off.x();
    testing::expect_on_page("localize", findings(filter));
  }
}

// Images arrive late: observations from before the given pose must not restore the previous pose.
TEST(GivenPose, ReplacesTheEstimate) {
  RiekfLocalizer filter = laser_filter();
  LaserRobot robot;
  robot.drive(filter, 3);
  ASSERT_TRUE(filter.estimate()->certain);
  const LaserRobot before = robot;
  robot.truth = SE2(-1, 1, 2);  // the robot is moved by hand
  ASSERT_TRUE(filter.restart_from(
      {robot.truth * SE2(0.02, 0.02, 0.02), Eigen::Vector3d(4e-3, 4e-3, 4e-3).asDiagonal()}));
  EXPECT_LT(off_m(filter, robot), 0.03);
  EXPECT_FALSE(filter.estimate()->certain) << "no tag has confirmed it";
  for (const LandmarkPoint& point : laser_points()) {
    const Eigen::Vector2d p = before.truth.inverse() * point.map_p;
    filter.add(
        RangeBearing{laser_time(before.seconds - 0.05), point.number, p.norm(), std::atan2(p.y(), p.x())});
  }
  robot.drive(filter, 0.06, false);
  EXPECT_LT(off_m(filter, robot), 0.05) << "observations from before the robot was moved are ignored";
  robot.drive(filter, 0.3);
  EXPECT_TRUE(filter.estimate()->certain);
  EXPECT_LT(off_m(filter, robot), 0.1);
  EXPECT_TRUE(filter.problems().empty()) << "a recovery must not be reported";
}

TEST(GivenPose, IsDroppedWhenTagsContradict) {
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

// A single tag can refute a pose but not replace it; two tags can. The report distinguishes between the two
// cases.
TEST(GivenPose, IsReportedAsNotLocalisedUntilTwoTagsAgree) {
  RiekfLocalizer filter = laser_filter();
  LaserRobot robot;
  robot.drive(filter, 3);
  robot.in_view = 1;
  filter.restart_from({robot.truth * SE2(1, 1, 1), Eigen::Vector3d(0.01, 0.01, 0.01).asDiagonal()});
  robot.drive(filter, 1);
  EXPECT_FALSE(filter.estimate()->certain);
  EXPECT_EQ(filter.tracker().restarts(), 1);
  EXPECT_EQ(filter.tracker().refused_starts(), 1);
  testing::expect_on_page("localize", findings(filter));
  robot.in_view = 8;
  robot.drive(filter, 2);
  EXPECT_TRUE(filter.estimate()->certain);
  EXPECT_THAT(filter.problems(), ::testing::Each(::testing::Not(::testing::HasSubstr("recovered"))));
  testing::expect_on_page("localize", findings(filter));
}

TEST(OdometryJump, IsReportedAndThePoseReinitialised) {
  RiekfLocalizer filter = laser_filter();
  LaserRobot robot;
  robot.drive(filter, 3);
  ASSERT_TRUE(filter.estimate() && filter.estimate()->certain);
  robot.odom = SE2(40, -7, 2);  // the counter is reset and the robot is moved
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
  EXPECT_THAT(filter.problems(), ::testing::Contains(::testing::HasSubstr(" 1 time")));
  testing::expect_on_page("localize", findings(filter));
}

TEST(MovedRobot, IsReportedAsLostAndRecovered) {
  RiekfLocalizer filter = laser_filter();
  LaserRobot robot;
  robot.drive(filter, 3);
  EXPECT_TRUE(filter.problems().empty()) << findings(filter);
  robot.truth = SE2(0.5, 0.5, -2);  // the wheels do not measure this motion
  robot.drive(filter, 3);
  EXPECT_LT(off_m(filter, robot), 0.1);
  EXPECT_THAT(filter.problems(), ::testing::Contains(::testing::HasSubstr(" 1 time")));
  testing::expect_on_page("localize", findings(filter));
}

}  // namespace
}  // namespace waymark
