#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "waymark/app/replay/replay_route.hpp"

namespace waymark {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

TEST(ReplayReport, ARobotThatSwayedBackwardsHasNoNegativeZero) {
  ReplayReport report{.route_length_m = 17.4};
  report.end.driven_m = -0.001;
  report.end.state = ReplayState::Stopped;
  report.end.reason = "a tag is near";
  EXPECT_THAT(ending(report), HasSubstr("0.00 m along a route of 17.40 m"));
  report.end.driven_m = -0.01;
  EXPECT_THAT(ending(report), HasSubstr("stopped -0.01 m along"));
  EXPECT_THAT(to_text(report), Not(HasSubstr("-0.00")));
}

TEST(ReplayReport, AReplayThatTakesTooLongSaysHowLongItWasGiven) {
  ReplayReport report{.route_length_m = 10, .allowed_s = 260};
  report.end.state = ReplayState::Driving;
  report.end.driven_m = 4;
  EXPECT_THAT(ending(report), HasSubstr("after 260 s of simulated time: given up 4.00 m along"));
}

TEST(TimeAllowed, IsEnoughForTheAskedSpeedAndTheStations) {
  const Route route{.closed = true, .length_m = 24};
  ReplayJob job;
  job.replay.laps = 2;
  RobotModel robot;
  robot.limits.speed_m_s = 0.6;
  EXPECT_DOUBLE_EQ(time_allowed_s(route, job, robot), 60 + 48 / 0.05);
  for (const double speed_m_s : {0.003, 0.02, 0.5}) {
    job.replay.profile.speed_m_s = speed_m_s;
    EXPECT_GT(time_allowed_s(route, job, robot), 60 + 2 * 48 / speed_m_s);
  }
  Route paused = route;
  paused.stations.push_back({.name = "bench", .arc_length_m = 3, .pause_s = 900});
  EXPECT_GT(time_allowed_s(paused, job, robot), time_allowed_s(route, job, robot) + 1800);
}

}  // namespace
}  // namespace waymark
