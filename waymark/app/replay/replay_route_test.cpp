// What a replay says of its stations, also while it still stands at one.
#include "waymark/app/replay/replay_route.hpp"

#include <chrono>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace waymark {
namespace {

using std::chrono::seconds;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

struct Said {
  std::vector<std::string> words{};
  JobControl control{.note = [this](const std::string& note) { words.push_back(note); }};
};

ReplayStep at_station(const std::string& name, double arc_m, double pause_s) {
  return {.state = ReplayState::AtStation, .station = Station{name, arc_m, pause_s}};
}

TEST(ReplayNotes, SaysEachPauseAndHowLongItWas) {
  Said said;
  ReplayNotes notes(said.control);
  const ReplayStep drives{.state = ReplayState::Driving};
  ASSERT_TRUE(notes.add(SensorTime(seconds(1)), drives, nullptr));
  ASSERT_TRUE(notes.add(SensorTime(seconds(2)), at_station("shelf", 4.5, 3), nullptr));
  ASSERT_TRUE(notes.add(SensorTime(seconds(5)), drives, nullptr));
  EXPECT_THAT(said.words, ElementsAre(HasSubstr("at 'shelf', 4.50 m along the route: stands for 3 s"),
                                      HasSubstr("goes on from 'shelf'")));
  ASSERT_EQ(notes.visits().size(), 1U);
  EXPECT_EQ(notes.visits()[0].stood_s, 3);
}

TEST(ReplayNotes, APauseThatIsEndedByASignalIsAsLongAsItWas) {
  Said said;
  ReplayNotes notes(said.control);
  for (int i = 0; i <= 40; ++i)
    ASSERT_TRUE(notes.add(SensorTime(seconds(10 + i)), at_station("night", 2, 86400), nullptr));
  ASSERT_EQ(notes.visits().size(), 1U);
  EXPECT_EQ(notes.visits()[0].stood_s, 40);
  EXPECT_EQ(said.words.size(), 1U);
}

TEST(CheckDrive, ASpeedThatCannotBeToldFromStandingIsRefused) {
  const Route route{.closed = true, .length_m = 10};
  ReplayJob job;
  for (const double speed_m_s : {0.0, 0.005, 0.5}) {
    job.replay.profile.speed_m_s = speed_m_s;
    EXPECT_TRUE(check_drive(job, route)) << speed_m_s;
  }
  job.replay.profile.speed_m_s = 1e-9;
  const Status refused = check_drive(job, route);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().place.key, "--speed-m-s");
}

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
