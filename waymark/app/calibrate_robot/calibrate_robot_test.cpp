// Calibration of a robot from a drive past tags, using the lap and innovations methods, and the output files.
#include "waymark/app/calibrate_robot/calibrate_robot.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/recorded_lap.hpp"
#include "waymark/config/yaml/calibration_file.hpp"
#include "waymark/config/yaml/map_file.hpp"
#include "waymark/samples/mounted_camera.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::Not;

/// A complete lap, the true map, and a robot file in which the camera is rotated by two degrees.
struct CalibrationDrive {
  fs::path folder = testing::fresh_folder("jobs_calibrate");
  std::string lap = test::record_lap(folder / "lap.mcap", 71);
  std::string map = (folder / "map.yaml").string();
  std::string wrong_robot = (folder / "wrong.yaml").string();
  SE3 base_T_cam = read_robot(WAYMARK_SHARE "/robots/limo.yaml")->model.base_T_cam;

  CalibrationDrive() {
    MapFile file{.tags = test::circuit().tags, .anchor = test::circuit().anchor};
    for (auto& [tag, mapped] : file.tags.tags) mapped.covariance = Matrix6(Matrix6::Identity() * 1e-6);
    EXPECT_TRUE(write_map(map, file));
    const SE3 turned = SE3(SO3::from_rpy(0, 0, kTurned_rad), Eigen::Vector3d::Zero()) * base_T_cam;
    const auto yaml = with_camera_mounting(test::file_text(WAYMARK_SHARE "/robots/limo.yaml"), turned);
    EXPECT_TRUE(yaml);
    EXPECT_TRUE(write_text_file(wrong_robot, *yaml));
  }
  static constexpr double kTurned_rad = 0.035;
};

const CalibrationDrive& calibration_drive() {
  static const CalibrationDrive made;
  return made;
}

TEST(CalibrateByLap, AWrongMountingIsEstimatedWithinItsStandardDeviation) {
  CalibrateRobotJob job{
      .drive = {.logs = {calibration_drive().lap}, .robot = calibration_drive().wrong_robot}};
  job.by = CalibrateRobotBy::Lap;
  job.drive.output = (calibration_drive().folder / "by_lap.yaml").string();
  std::string notes;
  JobControl control;
  control.note = [&](const std::string& note) { notes += note; };
  const auto report = calibrate_robot(job, control);
  ASSERT_TRUE(report) << to_string(report.error());
  EXPECT_THAT(notes, HasSubstr("robot file")) << "warns that the robot file and the recording differ";
  const auto yaw = report->calibration.values.find("mounting_yaw_rad");
  ASSERT_NE(yaw, report->calibration.values.end());
  const double truth_rad = camera_mounting(calibration_drive().base_T_cam).yaw_rad;
  EXPECT_NEAR(yaw->second.value, truth_rad, std::max(0.003, 4 * yaw->second.sigma));
  EXPECT_LT(yaw->second.sigma, CalibrationDrive::kTurned_rad / 4);
  ASSERT_TRUE(write_robot_calibration(job, *report));
  const auto written = read_calibration(job.drive.output);
  ASSERT_TRUE(written) << to_string(written.error());
  EXPECT_EQ(written->values.size(), report->calibration.values.size());
  EXPECT_EQ(written->observable_value("mounting_yaw_rad"),
            report->calibration.observable_value("mounting_yaw_rad"));
  const auto json = to_json(fields(*report));
  EXPECT_EQ(json["tags"], 24);
  EXPECT_LT(json["corners_rms_px"].get<double>(), 2);
}

TEST(CalibrateByLap, UsesOnlyTheIntervalAndRejectsAnEmptyOne) {
  CalibrateRobotJob job{.drive = {.logs = {calibration_drive().lap}}};
  job.by = CalibrateRobotBy::Lap;
  job.to_s = 12;
  const auto part = calibrate_robot(job, {});
  ASSERT_TRUE(part) << to_string(part.error());
  ASSERT_TRUE(part->lap);
  EXPECT_LT(part->lap->map.map.tags.size(), 24U);
  job.from_s = 10'000;
  job.to_s = 10'001;
  const auto empty = calibrate_robot(job, {});
  ASSERT_FALSE(empty);
  EXPECT_EQ(empty.error().code, ErrorCode::InvalidArgument);
  EXPECT_EQ(empty.error().place.source, calibration_drive().lap);
}

TEST(CalibrateByLap, RequiresTagCornersAndOdometry) {
  LocalizeJob job{.logs = {calibration_drive().lap}, .map = calibration_drive().map};
  EXPECT_TRUE(can_calibrate_by_lap(job, {}));
  const fs::path folder = testing::fresh_folder("jobs_no_odometry");
  job.logs = {test::record_lap(folder / "lap.mcap", 72, {.for_s = 3, .odometry = false})};
  EXPECT_FALSE(can_calibrate_by_lap(job, {}));
  job.logs = {"/nowhere/lap.mcap"};
  EXPECT_FALSE(can_calibrate_by_lap(job, {}));
}

TEST(CalibrateRobot, OdometryOfAnotherClockIsAnError) {
  const fs::path folder = testing::fresh_folder("jobs_two_clocks");
  const std::string lap = test::record_lap(folder / "lap.mcap", 72, {.for_s = 6, .motion_ahead_s = 3600});
  for (const CalibrateRobotBy by :
       {CalibrateRobotBy::Lap, CalibrateRobotBy::Innovations, CalibrateRobotBy::Either}) {
    CalibrateRobotJob job{.drive = {.logs = {lap}, .map = calibration_drive().map}};
    job.by = by;
    const auto report = calibrate_robot(job, {});
    ASSERT_FALSE(report) << static_cast<int>(by);
    EXPECT_EQ(report.error().code, ErrorCode::InvalidArgument);
    EXPECT_EQ(report.error().place.source, lap);
    EXPECT_THAT(report.error().message, HasSubstr("3600 s"));
  }
}

TEST(CalibrateRobot, GroundTruthOfAnotherClockIsNotNeeded) {
  const fs::path folder = testing::fresh_folder("jobs_truth_clock");
  const std::string lap = test::record_lap(folder / "lap.mcap", 72, {.for_s = 6, .truth_ahead_s = 3600});
  const LocalizeJob drive{.logs = {lap}, .map = calibration_drive().map};
  const auto inputs = read_localize_inputs(drive, {});
  ASSERT_TRUE(inputs) << to_string(inputs.error());
  EXPECT_TRUE(affects(inputs->other_clock, StampedKind::Truth));
  EXPECT_FALSE(affects(inputs->other_clock, StampedKind::Odometry));
  for (const CalibrateRobotBy by : {CalibrateRobotBy::Lap, CalibrateRobotBy::Innovations}) {
    CalibrateRobotJob job{.drive = drive};
    job.by = by;
    const auto report = calibrate_robot(job, {});
    if (!report) EXPECT_THAT(report.error().message, Not(HasSubstr("3600 s"))) << static_cast<int>(by);
  }
}

TEST(CalibrateByInnovations, MinimisesInnovationsAndCanBeCancelled) {
  CalibrateRobotJob job{.drive = {.logs = {calibration_drive().lap}, .map = calibration_drive().map}};
  job.by = CalibrateRobotBy::Innovations;
  job.to_s = 15;
  std::vector<std::string> texts;
  JobControl control;
  control.progress = [&](const JobProgress& now) { texts.push_back(now.text); };
  const auto report = calibrate_robot(job, control);
  ASSERT_TRUE(report) << to_string(report.error());
  ASSERT_TRUE(report->innovations);
  EXPECT_FALSE(report->lap);
  EXPECT_THAT(texts.front(), HasSubstr("run 1 "));
  EXPECT_LE(report->innovations->cost_after, report->innovations->cost_before + 1e-9);
  const auto json = to_json(fields(*report));
  EXPECT_EQ(json["runs"], report->innovations->runs);
  for (const auto& [name, value] : report->calibration.values)
    EXPECT_EQ(value.verdict == CalibrationVerdict::Unobservable && value.advice.empty(), false) << name;
  int runs = 0;
  control.progress = [&](const JobProgress&) { ++runs; };
  control.cancelled = [&] { return runs >= 2; };
  const auto stopped = calibrate_robot(job, control);
  ASSERT_FALSE(stopped);
  EXPECT_THAT(stopped.error().message, HasSubstr("nothing was written"));
  EXPECT_LE(runs, 3) << "must end after the current run";
}

TEST(TakeCalibrated, ReplacesOnlyObservableFilterOptions) {
  Calibration calibration;
  calibration.values["odometry_scale"] = {.value = 1.05, .sigma = 0.01};
  calibration.values["yaw_scale"] = {.value = 0.9, .verdict = CalibrationVerdict::Unobservable};
  calibration.values["camera_latency_s"] = {.value = 0.08, .sigma = 0.01};
  RiekfOptions filter;
  const double yaw_scale = filter.yaw_scale;
  take_calibrated(calibration, filter);
  EXPECT_EQ(filter.odometry_scale, 1.05);
  EXPECT_EQ(filter.camera_latency_s, 0.08);
  EXPECT_EQ(filter.yaw_scale, yaw_scale) << "unobservable, so unchanged";
}

TEST(CalibrateRobot, RejectsInvalidJobsBeforeReading) {
  CalibrateRobotJob job{.drive = {.logs = {"/nowhere/lap.mcap"}}};
  job.from_s = 5;
  job.to_s = 5;
  const auto interval = calibrate_robot(job, {});
  ASSERT_FALSE(interval);
  EXPECT_EQ(interval.error().place.key, "to");
  job.to_s = 6;
  job.by = CalibrateRobotBy::Innovations;
  const auto map = calibrate_robot(job, {});
  ASSERT_FALSE(map);
  EXPECT_EQ(map.error().place.key, "by");
  job.by = CalibrateRobotBy::Lap;
  job.drive.output = "/nowhere/calibration.yaml";
  const auto output = calibrate_robot(job, {});
  ASSERT_FALSE(output);
  EXPECT_EQ(output.error().code, ErrorCode::Unwritable);
  job.drive.output = calibration_drive().map;
  EXPECT_FALSE(calibrate_robot(job, {})) << "a map file is not overwritten";
  job.drive.output.clear();
  const auto missing = calibrate_robot(job, {});
  ASSERT_FALSE(missing);
  EXPECT_EQ(missing.error().place.source, "/nowhere/lap.mcap");
}

TEST(CalibrateRobot, ACancelledJobWritesNothing) {
  const fs::path output = calibration_drive().folder / "calibration.yaml";
  CalibrateRobotJob job{.drive = {.logs = {calibration_drive().lap},
                                  .map = calibration_drive().map,
                                  .output = output.string()}};
  job.by = CalibrateRobotBy::Lap;
  const auto report = calibrate_robot(job, test::cancelled_after(3));
  ASSERT_FALSE(report);
  EXPECT_THAT(to_string(report.error()), HasSubstr("nothing was written"));
  EXPECT_FALSE(fs::exists(output));
}

TEST(CalibrateRobot, AnUnobservableCalibrationIsNotWritten) {
  const fs::path output = calibration_drive().folder / "nothing.yaml";
  const CalibrateRobotJob job{.drive = {.logs = {calibration_drive().lap}, .output = output.string()}};
  CalibrateRobotReport report;
  report.calibration.values["yaw_scale"] = {.verdict = CalibrationVerdict::Unobservable};
  EXPECT_FALSE(write_robot_calibration(job, report));
  EXPECT_FALSE(fs::exists(output));
  report.calibration.values["yaw_scale"] = {.value = 1.02, .sigma = 0.01};
  EXPECT_TRUE(write_robot_calibration(job, report));
  EXPECT_TRUE(fs::exists(output));
  report.innovations = InnovationFit{};
  report.innovations->changed = true;
  const auto worse = write_robot_calibration(job, report);
  ASSERT_FALSE(worse);
  EXPECT_THAT(to_string(worse.error()), HasSubstr("nothing was written"));
  EXPECT_EQ(to_json(fields(report))["values"]["yaw_scale"]["verdict"], "known");
}

}  // namespace
}  // namespace waymark
