// Taught laps, replays, walks and imitated recordings of the simulated robot, in this process.
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/data.hpp"
#include "waymark/app/common/profile_table.hpp"
#include "waymark/app/map/map_recording.hpp"
#include "waymark/app/replay/replay_route.hpp"
#include "waymark/app/samples/write_samples.hpp"
#include "waymark/app/session/explore_world.hpp"
#include "waymark/app/teach/teach_lap.hpp"
#include "waymark/app/world/simulate_like.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

std::string bytes_of(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// Cancels when it is asked for the given time.
JobControl cancelled_at_call(int call) {
  JobControl control;
  control.cancelled = [call, asked = 0]() mutable { return ++asked >= call; };
  return control;
}

class SimulatedDrives : public ::testing::Test {
 protected:
  [[nodiscard]] std::string lap(const char* name = "lap.mcap") const { return (folder_ / name).string(); }
  void teach_and_map() const {
    ASSERT_TRUE(teach_lap(setup_, {.output = lap()}, {}));
    ASSERT_TRUE(map_recording({.lap = lap(), .folder = folder_ / "map"}, {}));
  }

  const fs::path folder_ =
      testing::fresh_folder(::testing::UnitTest::GetInstance()->current_test_info()->name());
  const RobotSetup setup_ = load_setup("circuit24", "", 1).value();
};

using TeachLap = SimulatedDrives;
using ReplayRoute = SimulatedDrives;
using Explore = SimulatedDrives;
using SimulateLike = SimulatedDrives;
using WriteSamples = SimulatedDrives;

TEST_F(TeachLap, TheSameSeedRecordsTheSameBytesAndAnotherOthers) {
  const auto first = teach_lap(setup_, {.output = lap()}, {});
  ASSERT_TRUE(first) << to_string(first.error());
  EXPECT_TRUE(first->end.finished);
  EXPECT_TRUE(first->summary.closed_loop);
  EXPECT_TRUE(first->summary.mappable);
  ASSERT_TRUE(teach_lap(setup_, {.output = lap("again.mcap")}, {}));
  ASSERT_TRUE(teach_lap(load_setup("circuit24", "", 2).value(), {.output = lap("other.mcap")}, {}));
  EXPECT_EQ(bytes_of(lap()), bytes_of(lap("again.mcap")));
  EXPECT_NE(bytes_of(lap()), bytes_of(lap("other.mcap")));
}

TEST_F(TeachLap, ACancelledLapIsClosedAndCanBeRead) {
  const auto taught = teach_lap(setup_, {.output = lap()}, cancelled_at_call(400));
  ASSERT_TRUE(taught) << to_string(taught.error());
  EXPECT_FALSE(taught->end.finished);
  EXPECT_TRUE(taught->end.interrupted);
  EXPECT_GT(taught->summary.frames, 0);
  const auto profile = profile_of(lap(), {});
  ASSERT_TRUE(profile) << to_string(profile.error());
  EXPECT_NEAR(profile->duration_s, taught->end.lap_s, 1.0);
}

TEST_F(TeachLap, WhatCannotBeginLeavesNoFile) {
  const auto driver = teach_lap(setup_, {.output = lap(), .driver = "autopilot"}, {});
  ASSERT_FALSE(driver);
  EXPECT_THAT(driver.error().message, HasSubstr("autopilot"));
  EXPECT_FALSE(fs::exists(lap()));
  EXPECT_FALSE(teach_lap(setup_, {.output = (folder_ / "missing/lap.mcap").string()}, {}));
}

TEST_F(ReplayRoute, ATaughtLapIsDrivenWithinCentimetresOfIt) {
  teach_and_map();
  const RobotSetup other_day = load_setup("circuit24", "", 1001).value();
  const auto report = replay_route(other_day, {.folder = folder_ / "map", .output = lap("replay.mcap")}, {});
  ASSERT_TRUE(report) << to_string(report.error());
  EXPECT_TRUE(succeeded(*report)) << ending(*report);
  ASSERT_TRUE(report->judgement);
  EXPECT_LT(report->judgement->cross_track_rmse_m, 0.02);
  EXPECT_NEAR(report->end.driven_m, report->route_length_m, 0.1);
  EXPECT_TRUE(fs::exists(lap("replay.mcap")));
}

TEST_F(ReplayRoute, CancellingStopsTheRobotAndSaysByWhom) {
  teach_and_map();
  const auto report = replay_route(setup_, {.folder = folder_ / "map"}, cancelled_at_call(600));
  ASSERT_TRUE(report) << to_string(report.error());
  EXPECT_FALSE(succeeded(*report));
  EXPECT_TRUE(report->end.interrupted);
  EXPECT_LT(report->end.driven_m, report->route_length_m);
  EXPECT_THAT(ending(*report, "a test"), HasSubstr("a test"));
  ASSERT_GE(report->true_path.size(), 2U);
}

TEST_F(ReplayRoute, AFolderWithoutAMapOrWithAnotherPlacesRouteIsRefused) {
  EXPECT_FALSE(replay_route(setup_, {.folder = folder_ / "nowhere"}, {}));
  teach_and_map();
  const RobotSetup square = load_setup("mbot-square", "", 1).value();
  ASSERT_TRUE(teach_lap(square, {.output = lap("square.mcap")}, {}));
  ASSERT_TRUE(map_recording({.lap = lap("square.mcap"), .folder = folder_ / "square"}, {}));
  fs::copy_file(folder_ / "square/route.yaml", folder_ / "map/route.yaml",
                fs::copy_options::overwrite_existing);
  const auto foreign = replay_route(setup_, {.folder = folder_ / "map"}, {});
  ASSERT_FALSE(foreign);
  EXPECT_THAT(to_string(foreign.error()), HasSubstr("route.yaml"));
}

TEST_F(ReplayRoute, SeveralLapsNeedAClosedRoute) {
  teach_and_map();
  ReplayJob job{.folder = folder_ / "map"};
  const auto files = load_replay(job, {});
  ASSERT_TRUE(files) << to_string(files.error());
  Route open = files->route;
  open.closed = false;
  EXPECT_TRUE(check_drive(job, open));
  job.replay.laps = 2;
  EXPECT_TRUE(check_drive(job, files->route));
  EXPECT_FALSE(check_drive(job, open));
  EXPECT_NEAR(goal_m(files->route, job), 2 * goal_m(files->route, {.folder = job.folder}), 1e-9);
}

TEST_F(Explore, AWalkMeetsNothingAndEndsWhenItIsCancelled) {
  const RobotSetup house = load_setup("academy-house", "", 4).value();
  const auto walk = explore_world(house, {.minutes = 0.5, .output = lap("walk.mcap")}, {});
  ASSERT_TRUE(walk) << to_string(walk.error());
  EXPECT_FALSE(walk->interrupted);
  EXPECT_NEAR(walk->seconds, 30, 0.5);
  EXPECT_EQ(walk->collisions, 0);
  EXPECT_GT(walk->distance_m, 1);
  const auto ended = explore_world(house, {.minutes = 0.5}, cancelled_at_call(200));
  ASSERT_TRUE(ended) << to_string(ended.error());
  EXPECT_TRUE(ended->interrupted);
  EXPECT_LT(ended->seconds, walk->seconds);
  EXPECT_FALSE(explore_world(house, {.map = lap("no-map")}, {}));
}

TEST_F(SimulateLike, TheImitationLastsAsLongAndIsAsFastAsWhatItImitates) {
  ASSERT_TRUE(teach_lap(setup_, {.output = lap(), .speed_m_s = 0.2}, {}));
  const auto like = profile_of(lap(), {});
  ASSERT_TRUE(like) << to_string(like.error());
  const auto made = simulate_like(setup_, *like, {.like = lap(), .output = lap("made.mcap")}, {});
  ASSERT_TRUE(made) << to_string(made.error());
  EXPECT_NEAR(made->duration_s, like->duration_s, 1);
  EXPECT_NEAR(made->mean_speed_m_s, like->mean_speed_m_s, 0.05 * like->mean_speed_m_s);
  EXPECT_NEAR(made->streams.at("odometry").rate_hz, like->streams.at("odometry").rate_hz, 1);
}

TEST_F(WriteSamples, CancelledTheyLeaveNothingAndAFolderThatIsUsedStaysAsItIs) {
  const std::string wanted = (folder_ / "samples").string();
  EXPECT_FALSE(write_samples({.folder = wanted}, cancelled_at_call(1)));
  EXPECT_FALSE(fs::exists(wanted));
  fs::create_directories(wanted);
  std::ofstream(fs::path(wanted) / "mine.txt") << "mine";
  EXPECT_FALSE(write_samples({.folder = wanted}, {}));
  EXPECT_EQ(std::distance(fs::directory_iterator(wanted), {}), 1);
}

}  // namespace
}  // namespace waymark
