// What is refused of jobs before a robot is started, with the flag that says it.
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/data.hpp"
#include "waymark/app/calibrate_camera/calibrate_guided.hpp"
#include "waymark/app/live/inputs.hpp"
#include "waymark/app/live/robot_kinds.hpp"
#include "waymark/app/live/start_recording.hpp"
#include "waymark/app/replay/replay_route.hpp"
#include "waymark/app/session/run_session.hpp"
#include "waymark/app/teach/teach_lap.hpp"

namespace waymark {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;

std::string words(const Status& status) { return status ? "" : to_string(status.error()); }

TEST(TeachChecks, SpeedsAreThoseOfTheRobotAndOfItsDriver) {
  RobotSetup setup = load_setup("circuit24", "limo", 1).value();
  EXPECT_EQ(words(check_teach({.output = "a.mcap"}, setup)), "");
  EXPECT_THAT(words(check_teach({.output = "a.mcap", .speed_m_s = 4}, setup)),
              StartsWith("(--speed-m-s): limo drives at most "));
  EXPECT_THAT(words(check_teach({.output = "a.mcap", .second_speed_m_s = 4}, setup)),
              StartsWith("(--second-speed-m-s): limo drives at most "));
  EXPECT_EQ(words(check_teach({.output = "a.mcap", .second_speed_m_s = 0.5}, setup)), "");
  EXPECT_THAT(words(check_teach({.output = "a.mcap", .driver = "keyboard", .second_speed_m_s = 0.5}, setup)),
              HasSubstr("only the scripted driver"));
  EXPECT_EQ(words(check_teach({.output = "a.mcap", .images = "jpeg"}, setup)),
            "(--record-images): there are no pictures to record. Add --images.");
  setup.process = RobotCommand("true");
  EXPECT_EQ(words(check_teach({.output = "a.mcap", .images = "jpeg"}, setup)), "") << "it may have some";
}

TEST(TeachChecks, TheNearestDriverIsNamed) {
  EXPECT_EQ(words(check_lap_driver("keyboard")), "");
  EXPECT_EQ(words(check_lap_driver("keybord")),
            "(--driver): there is no driver 'keybord'. Did you mean 'keyboard'?");
}

TEST(ReplayChecks, MethodControllerAndLapsAreChosenByName) {
  ReplayJob job;
  ASSERT_TRUE(choose_replay("ekf", "pursuit", job));
  EXPECT_EQ(job.method, LocalizationKind::Ekf);
  EXPECT_EQ(job.replay.controller, ReplayController::Pursuit);
  EXPECT_THAT(words(choose_replay("smoother", "pursuit", job)), StartsWith("(--method): "));
  EXPECT_THAT(words(choose_replay("ekf", "pursiut", job)), StartsWith("(--controller): "));
  job.replay.laps = 0;
  EXPECT_EQ(words(choose_replay("ekf", "pursuit", job)), "(--laps): 0 is outside (0, 1000]");
}

TEST(ReplayChecks, PicturesAreRecordedWhereThereAreSomeAndARecording) {
  const RobotSetup setup = load_setup("circuit24", "", 1).value();
  ReplayJob job;
  EXPECT_EQ(words(check_recording(job, setup)), "");
  job.images = "jpeg";
  EXPECT_EQ(words(check_recording(job, setup)), "(--record-images): nothing is recorded. Add -o FILE.");
  job.output = "a.mcap";
  EXPECT_THAT(words(check_recording(job, setup)), HasSubstr("there are no pictures to record"));
}

TEST(SessionChecks, ARouteIsOneOfAMapAndSuccessThatOfAllReplays) {
  SessionJob job;
  EXPECT_EQ(words(check_session(job)), "");
  job.replay.route = "kitchen";
  EXPECT_THAT(words(check_session(job)), StartsWith("(--route): a lap that is taught has one route"));
  job.map = "map";
  EXPECT_EQ(words(check_session(job)), "");
  SessionReport report;
  EXPECT_TRUE(succeeded(report));
  report.map_failed = true;
  EXPECT_FALSE(succeeded(report));
  report = {.replays = {ReplayReport{}}};
  EXPECT_FALSE(succeeded(report));
}

TEST(LoadRobot, IsSimulatedInAWorldOrAProcessOfAKind) {
  EXPECT_EQ(load_robot("sim", "circuit24", "", 1, false)->simulated.world.name, "circuit24");
  EXPECT_FALSE(load_robot("process:true", "", "", 1, true)->process.empty());
  const auto refused = [](const char* robot, const char* world, bool processes) {
    const auto setup = load_robot(robot, world, "", 1, processes);
    return setup ? "" : to_string(setup.error());
  };
  EXPECT_THAT(refused("sim", "", true), StartsWith("(--world): --world is required"));
  EXPECT_THAT(refused("smi", "circuit24", true), StartsWith("(--robot): there is no robot 'smi'. Did you"));
  EXPECT_THAT(refused("process:true", "circuit24", false), HasSubstr("there is no robot 'process:true'"));
}

TEST(LoadRobot, AMapMayHoldItsFile) {
  const auto folder = testing::fresh_folder("live_job_checks");
  EXPECT_EQ(robot_file_in(folder), "");
  std::ofstream(folder / "robot.yaml") << "\n";
  EXPECT_EQ(robot_file_in(folder), (folder / "robot.yaml").string());
}

TEST(GuidedChecks, PicturesOfTheirOwnAreNoSource) {
  const auto folder = testing::fresh_folder("live_job_checks_pictures");
  std::ofstream(folder / "a.png") << "x";
  CalibrateCameraJob job{.sources = {(folder / "a.png").string()}};
  EXPECT_THAT(words(check_guided_sources(job)), HasSubstr("is a picture: a guided calibration takes"));
  job.sources = {(folder / "a.mp4").string()};
  EXPECT_EQ(words(check_guided_sources(job)), "");
}

}  // namespace
}  // namespace waymark
