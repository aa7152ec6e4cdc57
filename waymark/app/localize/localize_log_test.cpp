#include "waymark/app/localize/localize_log.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/recorded_lap.hpp"
#include "waymark/app/calibrate_robot/calibrate_robot.hpp"
#include "waymark/app/evaluate/evaluate_trajectory.hpp"
#include "waymark/app/evaluate/trajectory_doubts.hpp"
#include "waymark/config/map_file.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

/// Ten seconds of a lap, and the map of the world it was driven in.
struct Scene {
  fs::path folder = testing::fresh_folder("jobs_localize");
  std::string lap = test::record_lap(folder / "lap.mcap", 8, {.for_s = 10});
  std::string map = (folder / "map.yaml").string();
  Scene() {
    MapFile file{.tags = test::circuit().tags, .anchor = test::circuit().anchor};
    for (auto& [tag, mapped] : file.tags.tags) mapped.covariance = Matrix6(Matrix6::Identity() * 1e-6);
    EXPECT_TRUE(write_map(map, file));
  }
};

const Scene& scene() {
  static const Scene made;
  return made;
}

Result<LocalizeReport> localized(const LocalizeJob& job, const JobControl& control = {}) {
  const auto inputs = read_localize_inputs(job, control);
  if (!inputs) return tl::unexpected(inputs.error());
  return localize(job, *inputs, control);
}

TEST(LocalizeLog, TheRobotIsWhereTheTruthIsAndTheSummarySaysSo) {
  const std::string output = (scene().folder / "estimate.mcap").string();
  const auto report = localized({.logs = {scene().lap}, .map = scene().map, .output = output});
  ASSERT_TRUE(report) << to_string(report.error());
  EXPECT_GT(report->certain, report->estimates / 2);
  EXPECT_NEAR(report->duration_s, 10, 0.5);
  // Judged by the other job: what was written against the truth of the recording.
  const EvaluateTrajectoryJob job{.estimate = output, .reference = scene().lap};
  const auto inputs = read_evaluation(job, {});
  ASSERT_TRUE(inputs) << to_string(inputs.error());
  EXPECT_EQ(inputs->estimate.size(), report->certain);
  const auto scores = evaluate_trajectory(job, *inputs, {});
  ASSERT_TRUE(scores) << to_string(scores.error());
  ASSERT_TRUE(scores->rows.front().scores);
  EXPECT_LT(scores->rows.front().scores->ate_m.rmse, 0.1);
  EXPECT_EQ(scores->uncertain, report->estimates - report->certain);
  ASSERT_TRUE(scores->nis);
  EXPECT_EQ(scores->nis->observations, report->accepted);
  EXPECT_NEAR(scores->nis->mean, report->nis_mean, 1e-3);
  EXPECT_THAT(doubts_about(*scores, inputs->reference), IsEmpty());
  const auto json = to_json(*scores);
  EXPECT_EQ(json["poses"], report->certain);
}

TEST(LocalizeLog, ACancelledJobLeavesNoFile) {
  const std::string output = (scene().folder / "cancelled.mcap").string();
  const LocalizeJob job{.logs = {scene().lap}, .map = scene().map, .output = output};
  const auto inputs = read_localize_inputs(job, {});
  ASSERT_TRUE(inputs);
  bool stop = false;
  JobControl control;
  control.cancelled = [&] { return stop || fs::exists(output); };  // in the middle of the run that writes
  const auto report = localize(job, *inputs, control);
  ASSERT_FALSE(report);
  stop = true;
  EXPECT_FALSE(fs::exists(output));
  EXPECT_FALSE(read_localize_inputs(job, control)) << "reading ends as well";
}

TEST(LocalizeLog, TheEndingOfTheOutputSaysWhatItHolds) {
  const auto unknown =
      localized({.logs = {scene().lap}, .map = scene().map, .output = (scene().folder / "out.xyz").string()});
  ASSERT_FALSE(unknown);
  EXPECT_EQ(unknown.error().code, ErrorCode::InvalidArgument);
  const std::string tum = (scene().folder / "poses.txt").string();
  ASSERT_TRUE(localized({.logs = {scene().lap}, .map = scene().map, .output = tum}));
  const auto read = read_estimate(tum, "");
  ASSERT_TRUE(read) << to_string(read.error());
  EXPECT_FALSE(read->empty());
  const auto again = localized({.logs = {scene().lap}, .map = scene().map, .output = tum});
  ASSERT_FALSE(again);
  EXPECT_EQ(again.error().code, ErrorCode::Unwritable) << "poses are not written over";
}

TEST(LocalizeLog, WhatCannotWorkIsSaidBeforeAnythingRuns) {
  const auto twice = localized({.logs = {scene().lap, scene().lap}, .map = scene().map});
  ASSERT_FALSE(twice);
  EXPECT_EQ(twice.error().code, ErrorCode::InvalidArgument) << "one drive has one odometry";
  EXPECT_FALSE(localized({.logs = {scene().lap}, .map = "/nowhere/map.yaml"}));
  EXPECT_FALSE(localized({.logs = {"/nowhere/lap.mcap"}, .map = scene().map}));
  LocalizeJob nowhere{.logs = {scene().lap}, .map = scene().map};
  nowhere.start = {std::nan(""), 0, 0};
  const auto start = localized(nowhere);
  ASSERT_FALSE(start);
  EXPECT_EQ(start.error().place.key, "--start");
}

TEST(EvaluateTrajectory, NothingInCommonIsAnError) {
  EvaluateTrajectoryJob job{
      .estimate = scene().lap, .reference = scene().lap, .estimate_topic = topics::kTruth, .from_s = 1000};
  const auto inputs = read_evaluation(job, {});
  ASSERT_TRUE(inputs) << to_string(inputs.error());
  const auto late = evaluate_trajectory(job, *inputs, {});
  ASSERT_FALSE(late);
  EXPECT_EQ(late.error().code, ErrorCode::NotFound);
  job.from_s = 0;
  const auto same = evaluate_trajectory(job, *inputs, {});
  ASSERT_TRUE(same) << to_string(same.error());
  EXPECT_EQ(same->rows.front().scores->ate_m.max, 0);
  job.estimate_topic = "/odomm";
  const auto unknown = read_evaluation(job, {});
  ASSERT_FALSE(unknown);
  EXPECT_EQ(unknown.error().code, ErrorCode::NotFound);
}

TEST(EvaluateTrajectory, AShiftOfTheEstimateIsItsError) {
  const EvaluateTrajectoryJob job{
      .estimate = scene().lap, .reference = scene().lap, .estimate_topic = topics::kTruth};
  auto inputs = read_evaluation(job, {});
  ASSERT_TRUE(inputs);
  for (EstimatedPose& pose : inputs->estimate)
    pose.map_T_base =
        SE3(pose.map_T_base.rotation(), pose.map_T_base.translation() + Eigen::Vector3d(0.3, 0.4, 0));
  const auto report = evaluate_trajectory(job, *inputs, {});
  ASSERT_TRUE(report);
  EXPECT_NEAR(report->rows.front().scores->ate_m.rmse, 0.5, 1e-9);
  const auto files = write_evaluation_figures(*inputs, *report, (scene().folder / "figures").string());
  ASSERT_TRUE(files) << to_string(files.error());
  for (const std::string& file : *files) EXPECT_TRUE(fs::exists(file)) << file;
}

TEST(CalibrateRobot, AJobThatMakesNoSenseReadsNothing) {
  CalibrateRobotJob job{.drive = {.logs = {"/nowhere/lap.mcap"}}};
  job.from_s = 5;
  job.to_s = 5;
  const auto span = calibrate_robot(job, {});
  ASSERT_FALSE(span);
  EXPECT_EQ(span.error().place.key, "--to");
  job.to_s = 6;
  job.by = CalibrateRobotBy::Innovations;
  const auto map = calibrate_robot(job, {});
  ASSERT_FALSE(map);
  EXPECT_EQ(map.error().place.key, "--by");
  job.by = CalibrateRobotBy::Lap;
  job.drive.output = "/nowhere/calibration.yaml";
  const auto output = calibrate_robot(job, {});
  ASSERT_FALSE(output);
  EXPECT_EQ(output.error().code, ErrorCode::Unwritable);
  job.drive.output = scene().map;
  EXPECT_FALSE(calibrate_robot(job, {})) << "a map is not written over";
  job.drive.output.clear();
  const auto missing = calibrate_robot(job, {});
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().place.source, "/nowhere/lap.mcap");
}

TEST(CalibrateRobot, ACancelledJobWritesNothing) {
  const fs::path output = scene().folder / "calibration.yaml";
  CalibrateRobotJob job{.drive = {.logs = {scene().lap}, .map = scene().map, .output = output.string()}};
  job.by = CalibrateRobotBy::Lap;
  const auto report = calibrate_robot(job, test::cancelled_after(3));
  ASSERT_FALSE(report);
  EXPECT_THAT(to_string(report.error()), HasSubstr("nothing was written"));
  EXPECT_FALSE(fs::exists(output));
}

TEST(CalibrateRobot, WhatTellsNothingIsNotWritten) {
  const fs::path output = scene().folder / "nothing.yaml";
  const CalibrateRobotJob job{.drive = {.logs = {scene().lap}, .output = output.string()}};
  CalibrateRobotReport report;
  report.calibration.values["yaw_gain"] = {.verdict = CalibrationVerdict::Unobservable};
  EXPECT_FALSE(write_robot_calibration(job, report));
  EXPECT_FALSE(fs::exists(output));
  report.calibration.values["yaw_gain"] = {.value = 1.02, .sigma = 0.01};
  EXPECT_TRUE(write_robot_calibration(job, report));
  EXPECT_TRUE(fs::exists(output));
  report.innovations = InnovationFit{};
  report.innovations->changed = true;
  const auto worse = write_robot_calibration(job, report);
  ASSERT_FALSE(worse);
  EXPECT_THAT(to_string(worse.error()), HasSubstr("do not fit the drive better"));
  EXPECT_EQ(to_json(report)["values"]["yaw_gain"]["verdict"], "known");
}

}  // namespace
}  // namespace waymark
