// Tests errors, results and reports of replays.
#include "waymark/app/replay/replay_route.hpp"

#include <chrono>
#include <filesystem>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/data.hpp"
#include "tests/support/golden_page.hpp"
#include "waymark/app/map/map_recording.hpp"
#include "waymark/app/session/run_session.hpp"
#include "waymark/app/teach/teach_lap.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;
using std::chrono::seconds;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::StartsWith;

struct Notes {
  std::vector<std::string> lines{};
  JobControl control{.note = [this](const std::string& note) { lines.push_back(note); }};
};

ReplayStep at_station(const std::string& name, double arc_m, double pause_s) {
  return {.state = ReplayState::AtStation, .station = Station{name, arc_m, pause_s}};
}

TEST(ReplayNotes, ReportsEachStopAtAStationAndItsDuration) {
  Notes noted;
  ReplayNotes notes(noted.control);
  const ReplayStep drives{.state = ReplayState::Driving};
  ASSERT_TRUE(notes.add(SensorTime(seconds(1)), drives, nullptr));
  ASSERT_TRUE(notes.add(SensorTime(seconds(2)), at_station("shelf", 4.5, 3), nullptr));
  ASSERT_TRUE(notes.add(SensorTime(seconds(5)), drives, nullptr));
  EXPECT_THAT(noted.lines, ElementsAre(AllOf(HasSubstr("'shelf'"), HasSubstr("4.50 m"), HasSubstr("3 s")),
                                       HasSubstr("'shelf'")));
  for (const std::string& line : noted.lines) testing::expect_on_page("replay", line);
  ASSERT_EQ(notes.visits().size(), 1U);
  EXPECT_EQ(notes.visits()[0].dwell_s, 3);
}

TEST(ReplayNotes, TheDwellTimeOfAnInterruptedStopIsItsDuration) {
  Notes noted;
  ReplayNotes notes(noted.control);
  for (int i = 0; i <= 40; ++i)
    ASSERT_TRUE(notes.add(SensorTime(seconds(10 + i)), at_station("night", 2, 86400), nullptr));
  ASSERT_EQ(notes.visits().size(), 1U);
  EXPECT_EQ(notes.visits()[0].dwell_s, 40);
  EXPECT_EQ(noted.lines.size(), 1U);
}

TEST(CheckDrive, RefusesASpeedThatCannotBeDistinguishedFromZero) {
  const Route route{.closed = true, .length_m = 10};
  ReplayJob job;
  for (const double speed_m_s : {0.0, 0.005, 0.5}) {
    job.replay.profile.speed_m_s = speed_m_s;
    EXPECT_TRUE(check_drive(job, route)) << speed_m_s;
  }
  job.replay.profile.speed_m_s = 1e-9;
  const Status refused = check_drive(job, route);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().place.key, "speed_m_s");
  testing::expect_on_page("replay", refused.error());
}

using ::testing::Not;

TEST(ReplayReport, PrintsNoNegativeZeroAfterASmallBackwardMotion) {
  ReplayReport report{.route_length_m = 17.4};
  report.end.driven_m = -0.001;
  report.end.state = ReplayState::Stopped;
  report.end.reason = "a tag is near";
  EXPECT_THAT(ending(report), AllOf(HasSubstr(" 0.00 m"), HasSubstr("17.40 m")));
  report.end.driven_m = -0.01;
  EXPECT_THAT(ending(report), HasSubstr(" -0.01 m"));
  EXPECT_THAT(to_text(report), Not(HasSubstr("-0.00")));
}

TEST(ReplayReport, AnAbortedReplayReportsItsTimeLimit) {
  ReplayReport report{.route_length_m = 10, .allowed_s = 260};
  report.end.state = ReplayState::Driving;
  report.end.driven_m = 4;
  EXPECT_THAT(ending(report), AllOf(HasSubstr("260 s"), HasSubstr("4.00 m")));
  testing::expect_on_page("replay", ending(report));
}

TEST(TimeAllowed, IsSufficientForTheRequestedSpeedAndTheStations) {
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

std::string words(const Status& status) { return status ? "" : to_string(status.error()); }

TEST(ReplayChecks, ParsesMethodControllerAndLaps) {
  ReplayJob job;
  ASSERT_TRUE(choose_replay("ekf", "pursuit", job));
  EXPECT_EQ(job.method, LocalizationKind::Ekf);
  EXPECT_EQ(job.replay.controller, ReplayController::Pursuit);
  EXPECT_THAT(words(choose_replay("smoother", "pursuit", job)), StartsWith("(method): "));
  EXPECT_THAT(words(choose_replay("ekf", "pursiut", job)), StartsWith("(controller): "));
  job.replay.laps = 0;
  const Status no_laps = choose_replay("ekf", "pursuit", job);
  EXPECT_THAT(words(no_laps), AllOf(StartsWith("(laps): 0 "), HasSubstr("(0, 1000]")));
  testing::expect_on_page("replay", no_laps.error());
}

TEST(ReplayChecks, RecordingImagesNeedsImagesAndARecording) {
  const RobotSetup setup = load_setup("circuit24", "", 1).value();
  ReplayJob job;
  EXPECT_EQ(words(check_recording(job, setup)), "");
  job.images = "jpeg";
  EXPECT_THAT(words(check_recording(job, setup)),
              AllOf(StartsWith("(record_images): "), HasSubstr("`output")));
  testing::expect_on_page("replay", words(check_recording(job, setup)));
  job.output = "a.mcap";
  EXPECT_THAT(words(check_recording(job, setup)),
              AllOf(StartsWith("(record_images): "), HasSubstr("`images`")));
  testing::expect_on_page("replay", words(check_recording(job, setup)));
}

TEST(ReplayReportText, ExplainsWhyThePoseWasNeverCertain) {
  ReplayReport report;
  report.end.state = ReplayState::Waiting;
  const std::string no_frames = ending(report);
  EXPECT_THAT(no_frames, HasSubstr("`camera_source`"));
  testing::expect_on_page("replay", no_frames);
  report.end.frames = 9;
  const std::string no_tags = ending(report);
  testing::expect_on_page("replay", no_tags);
  report.end.frames_with_two_tags = 5;
  EXPECT_NE(ending(report), no_frames);
  EXPECT_NE(ending(report), no_tags);
  EXPECT_NE(no_tags, no_frames);
  testing::expect_on_page("replay", ending(report));
  report.end.state = ReplayState::Refused;
  report.end.reason = "the start is 3 m away";
  EXPECT_THAT(ending(report), HasSubstr("the start is 3 m away"));
  testing::expect_on_page("replay", ending(report));
  EXPECT_FALSE(succeeded(report));
}

TEST(ReplayReportText, ReportsAStopOnce) {
  ReplayReport report;
  report.end.state = ReplayState::Stopped;
  report.end.driven_m = 1;
  report.route_length_m = 3;
  const std::string where = "1.00 m along a route of 3.00 m";
  for (const auto& [reason, words] :
       {std::pair{"stopped: a stick was moved", "stopped " + where + ": a stick was moved"},
        {"stopped by the operator", "stopped by the operator " + where},
        {"a tag is near", "stopped " + where + ": a tag is near"}}) {
    report.end.reason = reason;
    EXPECT_EQ(ending(report), words);
  }
  EXPECT_EQ(with_reason("stopped", "stopped: a stick was moved"), "stopped: a stick was moved");
  EXPECT_EQ(with_reason("stopped", "a tag is near"), "stopped: a tag is near");
  EXPECT_EQ(with_reason("done", ""), "done");
}

/// A control that cancels the job on the given call to cancelled().
JobControl cancelled_at_call(int call) {
  JobControl control;
  control.cancelled = [call, asked = 0]() mutable { return ++asked >= call; };
  return control;
}

/// Tests replays with a robot simulated in this process.
class ReplayRoute : public ::testing::Test {
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

TEST_F(ReplayRoute, CancellingStopsTheRobotAndNamesTheCause) {
  teach_and_map();
  const auto report = replay_route(setup_, {.folder = folder_ / "map"}, cancelled_at_call(600));
  ASSERT_TRUE(report) << to_string(report.error());
  EXPECT_FALSE(succeeded(*report));
  EXPECT_TRUE(report->end.interrupted);
  EXPECT_LT(report->end.driven_m, report->route_length_m);
  EXPECT_THAT(ending(*report, "a test"), HasSubstr("a test"));
  ASSERT_GE(report->true_path.size(), 2U);
}

TEST_F(ReplayRoute, RefusesAFolderWithoutAMapOrWithTheRouteOfAnotherMap) {
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

TEST(ReplayReport, HasNoErrorsWithoutGroundTruth) {
  ReplayReport report{
      .visits = {{.name = "shelf", .arc_length_m = 4.5, .arrived = SensorTime(seconds(2)), .dwell_s = 3}},
      .wall_s = 0.5};
  report.end.frames = 4;
  report.end.frames_with_two_tags = 1;
  report.end.missed_tags = {{MissReason::Blurred, 2}};
  EXPECT_EQ(
      to_json(fields(report)).dump(),
      R"({"laps_completed":null,"finished":false,"reason":"","cross_track_rmse_m":null,)"
      R"("cross_track_p95_m":null,"cross_track_max_m":null,"heading_rmse_deg":null,"min_clearance_m":null,)"
      R"("two_tags_fraction":0.25,"missed_tags":{"outside":0,"too_faint":0,"blurred":2,"occluded":0},)"
      R"("stops":0,"distance_m":null,"lap_s":0.0,"stations":[{"name":"shelf","arc_length_m":4.5,)"
      R"("arrived_s":2.0,"stationary_s":3.0}],"wall_s":0.5,"warnings":[]})");
  report.judgement = ReplayJudgement{.cross_track_rmse_m = 0.25, .laps_completed = 2};
  EXPECT_EQ(to_json(fields(report))["laps_completed"], 2);
  EXPECT_EQ(to_json(fields(report))["cross_track_rmse_m"], 0.25);
}

}  // namespace
}  // namespace waymark
