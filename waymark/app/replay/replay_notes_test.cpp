// What a replay says of its stations, also while it still stands at one.
#include "waymark/app/replay/replay_notes.hpp"

#include <chrono>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "waymark/app/replay/replay_route.hpp"

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

}  // namespace
}  // namespace waymark
