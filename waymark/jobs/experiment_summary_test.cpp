#include "waymark/jobs/experiment_summary.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/recorded_lap.hpp"
#include "waymark/jobs/judge_world.hpp"
#include "waymark/jobs/profile_table.hpp"

namespace waymark {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;

ExperimentRun run_with(const std::string& cell, std::uint64_t seed, double rmse_m) {
  return {cell, seed, true, "",
          ReplayJudgement{.cross_track_rmse_m = rmse_m, .cross_track_max_m = 2 * rmse_m}};
}

TEST(ExperimentSummary, MedianAndWorstOfEachCellInTheOrderOfTheRuns) {
  const auto json = summaries_of({run_with("b", 1, 0.01), run_with("a", 1, 0.5), run_with("b", 2, 0.04),
                                  run_with("b", 3, 0.02), run_with("b", 4, 0.03)});
  ASSERT_EQ(json.size(), 2U);
  EXPECT_EQ(json[0]["what"], "b");
  EXPECT_EQ(json[0]["runs"], 4);
  EXPECT_EQ(json[0]["completed"], 4);
  EXPECT_DOUBLE_EQ(json[0]["cross_track_rmse_median_m"], 0.025)
      << "of an even number the mean of the middle two";
  EXPECT_DOUBLE_EQ(json[0]["cross_track_max_worst_m"], 0.08);
  EXPECT_DOUBLE_EQ(json[1]["cross_track_rmse_median_m"], 0.5);
}

TEST(ExperimentSummary, RunsThatDidNotEndWellAreNamedAndJudgedAsFarAsTheyWent) {
  ExperimentRun stopped = run_with("a", 7, 0.1);
  stopped.finished = false;
  stopped.ending = "stopped after 3 m";
  ExperimentRun refused{"a", 8, false, "refused", {}};
  const auto json = summaries_of({stopped, refused});
  EXPECT_EQ(json[0]["completed"], 0);
  EXPECT_EQ(json[0]["endings"][0], "seed 7: stopped after 3 m");
  EXPECT_EQ(json[0]["endings"][1], "seed 8: refused");
  EXPECT_DOUBLE_EQ(json[0]["cross_track_rmse_median_m"], 0.1);
  EXPECT_TRUE(summaries_of({refused})[0]["cross_track_rmse_median_m"].is_null());
  EXPECT_TRUE(summaries_of({}).empty());
}

TEST(JudgeWorld, TheCircuitIsGoodAndASlipOfUnitsIsDoubted) {
  const RobotDescription robot = read_robot(WAYMARK_SHARE "/robots/limo.yaml").value();
  const auto good = judge_world(test::circuit(), robot.model, robot.camera, {});
  ASSERT_TRUE(good) << to_string(good.error());
  EXPECT_TRUE(good->good);
  EXPECT_NE(nearest_tag(good->check), "no tag");
  const auto json = to_json(*good, test::circuit(), robot.model);
  EXPECT_EQ(json["tags"], 24);
  EXPECT_GE(json["two_tags_fraction"].get<double>(), kGoodLapTwoTags);
  World large = test::circuit();
  large.tags.tags.begin()->second.size_m = 160;
  const auto doubted = judge_world(large, robot.model, robot.camera, {});
  ASSERT_TRUE(doubted);
  EXPECT_FALSE(doubted->good);
  EXPECT_THAT(doubted->doubts, Contains(HasSubstr("millimetres")));
  World sparse = test::circuit();
  while (sparse.tags.tags.size() > 2) sparse.tags.tags.erase(std::prev(sparse.tags.tags.end()));
  EXPECT_FALSE(judge_world(sparse, robot.model, robot.camera, {})->good) << "too few tags are seen";
}

TEST(ProfileTable, ARecordingBesideASimulation) {
  RecordingProfile like{.duration_s = 10};
  like.streams["camera"] = {.samples = 100, .rate_hz = 10, .longest_gap_s = 0.2};
  like.streams["camera left"] = {.samples = 50, .rate_hz = 5};
  like.streams["imu"] = {.samples = 1, .rate_hz = 0};
  RecordingProfile made{.duration_s = 20};
  made.streams["camera"] = {.samples = 100, .rate_hz = 12};
  const auto rows = profile_table(like, made);
  const auto row = [&](const std::string& key) {
    const auto found = std::ranges::find(rows, key, &ProfileRow::key);
    return found == rows.end() ? ProfileRow{} : *found;
  };
  EXPECT_EQ(row("camera_rate_hz").recording, 10);
  EXPECT_EQ(row("camera_rate_hz").simulation, 12);
  EXPECT_EQ(row("camera_left_rate_hz").recording, 5);
  EXPECT_FALSE(row("camera_left_rate_hz").simulation);
  EXPECT_TRUE(row("imu_rate_hz").key.empty()) << "what neither has is left out; one sample is no rate";
  const auto json = to_json(rows, "lap.mcap");
  EXPECT_EQ(json["file"], "lap.mcap");
  EXPECT_TRUE(json["quantities"]["camera_left_rate_hz"]["simulation"].is_null());
}

TEST(OptionsLike, TheSimulationTakesWhatWasMeasuredWithinReason) {
  const SimulatedRobotOptions usual;
  const SimulatedRobotOptions same = options_like({}, usual);
  EXPECT_EQ(same.camera_rate_hz, usual.camera_rate_hz) << "nothing was measured";
  EXPECT_TRUE(same.faults.empty());
  RecordingProfile measured;
  measured.streams["camera"] = {.samples = 100, .rate_hz = 4};
  measured.streams["odometry"] = {.samples = 9, .rate_hz = 100'000};
  measured.corner_sigma_px = 0.7;
  measured.image_latency_s = 99;
  measured.command_delay_s = 0.1;
  measured.camera_gaps = {{.at_s = 3, .for_s = 2}};
  const SimulatedRobotOptions like = options_like(measured, usual);
  EXPECT_EQ(like.camera_rate_hz, 4);
  EXPECT_EQ(like.odometry_rate_hz, 200) << "no faster than a simulation goes";
  EXPECT_EQ(like.tag_camera.corner_sigma_px, 0.7);
  EXPECT_LE(like.camera_latency_s, 10);
  EXPECT_NEAR(like.dynamics.command_delay_s + like.dynamics.speed_lag_s, 0.1, 1e-12);
  ASSERT_EQ(like.faults.size(), 1U);
  EXPECT_EQ(like.faults[0].kind, FaultKind::CameraLost);
  EXPECT_NEAR(like.faults[0].at_s, 3.125, 1e-12) << "half a period behind the last picture";
}

TEST(ProfileOf, CancellingEndsItAndARecordingWithoutOdometryHasNone) {
  const auto folder = testing::fresh_folder("jobs_profile");
  const std::string lap = test::record_lap(folder / "lap.mcap", 51, {.for_s = 4});
  EXPECT_TRUE(profile_of(lap, {}));
  EXPECT_FALSE(profile_of(lap, test::cancelled_after(20)));
  const std::string without = test::record_lap(folder / "without.mcap", 51, {.for_s = 4, .odometry = false});
  const auto none = profile_of(without, {});
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().code, ErrorCode::NotFound);
  EXPECT_EQ(none.error().place.source, without);
  EXPECT_FALSE(image_latency_of(lap, {})) << "it was recorded with the stamps as times";
  EXPECT_FALSE(image_latency_of("/nowhere", {}));
}

}  // namespace
}  // namespace waymark
