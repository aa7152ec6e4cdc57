// Precedence among the sources of camera, mounting and filter options, and localisation from a recording.
#include "waymark/app/localize/localize_log.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/recorded_lap.hpp"
#include "waymark/app/evaluate/evaluate_trajectory.hpp"
#include "waymark/config/yaml/calibration_file.hpp"
#include "waymark/config/yaml/map_file.hpp"
#include "waymark/geometry/planar.hpp"

namespace waymark {
namespace {

namespace fs = std::filesystem;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;

/// Three seconds of a lap, a map of its world, and two robot files with different mountings.
struct InputFiles {
  fs::path folder = testing::fresh_folder("jobs_inputs");
  std::string lap = test::record_lap(folder / "lap.mcap", 91, {.for_s = 3});
  fs::path map_folder = folder / "map";
  SE3 base_T_cam = read_robot(WAYMARK_SHARE "/robots/limo.yaml")->model.base_T_cam;
  InputFiles() {
    fs::create_directories(map_folder);
    MapFile file{.tags = test::circuit().tags, .anchor = test::circuit().anchor};
    for (auto& [tag, mapped] : file.tags.tags) mapped.covariance = Matrix6(Matrix6::Identity() * 1e-6);
    EXPECT_TRUE(write_map(map_folder / "map.yaml", file));
    robot("ahead.yaml", 0.1);
    robot("map/robot.yaml", 0.2);
  }
  void robot(const std::string& name, double shift_m) const {
    const auto yaml = with_camera_mounting(test::file_text(WAYMARK_SHARE "/robots/limo.yaml"),
                                           SE3(SO3(), {shift_m, 0, 0}) * base_T_cam);
    EXPECT_TRUE(yaml);
    EXPECT_TRUE(write_text_file(folder / name, *yaml));
  }
  [[nodiscard]] LocalizeJob job() const { return {.logs = {lap}, .map = map_folder.string()}; }
  /// How far the camera mounting used by the job is ahead of the true one.
  [[nodiscard]] double ahead_m(const LocalizeJob& job) const {
    const auto inputs = read_localize_inputs(job, {});
    EXPECT_TRUE(inputs) << to_string(inputs.error());
    return inputs ? (inputs->setup.sensor.base_T_sensor.translation() - base_T_cam.translation()).x() : NAN;
  }
};

const InputFiles& input_files() {
  static const InputFiles made;
  return made;
}

TEST(LocalizeInputsOf, UseTheMountingOfTheRecordingUnlessAFileIsGiven) {
  LocalizeJob job = input_files().job();
  EXPECT_NEAR(input_files().ahead_m(job), 0, 1e-9) << "from the recording, not from the file next to the map";
  job.robot = (input_files().folder / "ahead.yaml").string();
  EXPECT_NEAR(input_files().ahead_m(job), 0.1, 1e-9);
  const auto inputs = read_localize_inputs(job, {});
  EXPECT_THAT(inputs->warnings, Contains(HasSubstr("10.0 cm"))) << "the disagreement is reported";
}

TEST(LocalizeInputsOf, UseTheFileBesideTheMapIfTheRecordingHasNoCamera) {
  const fs::path table = input_files().folder / "tags.csv";
  ASSERT_TRUE(
      write_text_file(table,
                      "t_ns,camera,tag,tl_x_px,tl_y_px,tr_x_px,tr_y_px,br_x_px,br_y_px,bl_x_px,bl_y_px\n"
                      "1000,cam,0,10,20,30,20,30,40,10,40\n"));
  LocalizeJob job = input_files().job();
  job.logs = {table.string()};
  EXPECT_NEAR(input_files().ahead_m(job), 0.2, 1e-9);
  job.map = (input_files().map_folder / "map.yaml").string();
  EXPECT_NEAR(input_files().ahead_m(job), 0.2, 1e-9) << "from the folder of the map file";
  const fs::path alone = input_files().folder / "alone.yaml";
  fs::copy_file(input_files().map_folder / "map.yaml", alone, fs::copy_options::overwrite_existing);
  job.map = alone.string();
  const auto unknown = read_localize_inputs(job, {});
  ASSERT_FALSE(unknown);
  EXPECT_THAT(unknown.error().hint, HasSubstr("`robot`"));
}

TEST(LocalizeInputsOf, ACalibrationOverridesRecordingAndRobotFile) {
  Calibration calibration;
  calibration.values["mounting_x_m"] = {.value = input_files().base_T_cam.translation().x() + 0.3,
                                        .sigma = 0.001};
  calibration.values["yaw_scale"] = {.value = 0.95, .sigma = 0.01};
  const fs::path file = input_files().folder / "calibration.yaml";
  fs::remove(file);
  ASSERT_TRUE(write_calibration(file, calibration));
  LocalizeJob job = input_files().job();
  job.robot = (input_files().folder / "ahead.yaml").string();
  job.calibration = file.string();
  EXPECT_NEAR(input_files().ahead_m(job), 0.3, 1e-9);
  EXPECT_EQ(read_localize_inputs(job, {})->setup.filter.yaw_scale, 0.95);
  job.calibration = "/nowhere.yaml";
  EXPECT_FALSE(read_localize_inputs(job, {}));
}

TEST(LocalizeInputsOf, RequestedOptionsOverrideRobotFileAndCalibration) {
  Calibration calibration;
  calibration.values["yaw_scale"] = {.value = 0.95, .sigma = 0.01};
  const fs::path file = input_files().folder / "gain.yaml";
  fs::remove(file);
  ASSERT_TRUE(write_calibration(file, calibration));
  LocalizeJob job = input_files().job();
  job.calibration = file.string();
  job.asked = [](RiekfOptions& filter) -> Status {
    filter.yaw_scale = 0.9;
    filter.motion.drift_m_sqrt_s = 0.123;
    return {};
  };
  const auto recorded = read_localize_inputs(job, {});
  ASSERT_TRUE(recorded) << to_string(recorded.error());
  const std::string yaml = test::file_text(WAYMARK_SHARE "/robots/turtlebot3-waffle.yaml");
  const auto live = read_localize_inputs(job, parse_robot(yaml, "waffle.yaml").value(), yaml);
  ASSERT_TRUE(live) << to_string(live.error());
  EXPECT_EQ(live->setup.filter.motion.crab_share, 1) << "from the robot file";
  for (const auto* inputs : {&recorded, &live}) {
    EXPECT_EQ((*inputs)->setup.filter.yaw_scale, 0.9);
    EXPECT_EQ((*inputs)->setup.filter.motion.drift_m_sqrt_s, 0.123);
  }
}

TEST(LocalizeInputsOf, ReportAnAssumedTagSize) {
  const fs::path layout = input_files().folder / "layout.json";
  ASSERT_TRUE(write_text_file(layout, R"({"tags":[{"ID":3,"pose":{"translation":{"x":4,"y":1,"z":1},
    "rotation":{"quaternion":{"W":0,"X":0,"Y":0,"Z":1}}}}],"field":{"length":16.5,"width":8.2}})"));
  LocalizeJob job = input_files().job();
  job.map = layout.string();
  const auto assumed = read_localize_inputs(job, {});
  ASSERT_TRUE(assumed) << to_string(assumed.error());
  EXPECT_THAT(assumed->warnings, Contains(HasSubstr("0.1651 m (set `tag_size_m`)")));
  job.tag_size_m = 0.2;
  EXPECT_THAT(read_localize_inputs(job, {})->warnings, Not(Contains(HasSubstr("assumed"))));
}

TEST(LocalizeInputsOf, SortAndCountTheSamplesOfAllFiles) {
  const fs::path ranges = input_files().folder / "ranges.csv";
  ASSERT_TRUE(write_text_file(ranges, "t_s,landmark,range_m,bearing_rad\n2,3,1,0\n1,4,1,0\n"));
  LocalizeJob job = input_files().job();
  const std::size_t alone = read_localize_inputs(job, {})->observations;
  job.logs.push_back(ranges.string());
  const auto inputs = read_localize_inputs(job, {});
  ASSERT_TRUE(inputs) << to_string(inputs.error());
  EXPECT_TRUE(std::ranges::is_sorted(inputs->samples, {}, stamp_of));
  EXPECT_EQ(inputs->observations, alone + 2);
  EXPECT_TRUE(inputs->mounting_guessed);
  EXPECT_THAT(inputs->warnings, Contains(HasSubstr("`sensor_pose`")));
  job.sensor_pose = {0.5, 0, 90};
  const auto placed = read_localize_inputs(job, {});
  ASSERT_TRUE(placed);
  EXPECT_FALSE(placed->mounting_guessed);
  EXPECT_TRUE(placed->planar_sensor);
  EXPECT_NEAR(project_to_plane(placed->setup.sensor.base_T_sensor).yaw(), M_PI / 2, 1e-12);
}

std::size_t odometry_samples(const LocalizeInputs& inputs) {
  return static_cast<std::size_t>(std::ranges::count_if(
      inputs.samples, [](const Sample& sample) { return std::holds_alternative<Odometry>(sample); }));
}

TEST(LocalizeInputsOf, LeaveOutOdometryOfAnotherClock) {
  LocalizeJob job = input_files().job();
  const auto sound = read_localize_inputs(job, {});
  ASSERT_TRUE(sound);
  EXPECT_FALSE(sound->other_clock);
  EXPECT_GT(odometry_samples(*sound), 50U);
  job.logs = {test::record_lap(input_files().folder / "two_clocks.mcap", 91,
                               {.for_s = 3, .motion_ahead_s = 1'700'000'000})};
  const auto inputs = read_localize_inputs(job, {});
  ASSERT_TRUE(inputs) << to_string(inputs.error());
  ASSERT_TRUE(inputs->other_clock);
  EXPECT_THAT(inputs->warnings, Contains(to_string(inputs->other_clock->error)));
  EXPECT_EQ(odometry_samples(*inputs), 0U);
  EXPECT_EQ(inputs->observations, sound->observations);
  EXPECT_LT(to_seconds(stamp_of(inputs->samples.back()) - stamp_of(inputs->samples.front())), 3.1);
  const auto report = localize(job, *inputs, {});
  ASSERT_TRUE(report) << to_string(report.error());
  EXPECT_LT(report->duration_s, 3.1);
}

TEST(LocalizeInputsOf, TransformsAreOdometryOnlyWithoutAnyOther) {
  LocalizeJob job = input_files().job();
  const std::size_t usual = odometry_samples(read_localize_inputs(job, {}).value());
  job.logs = {test::record_lap(input_files().folder / "transforms.mcap", 91,
                               {.for_s = 3, .odometry_in_transforms = true})};
  const auto alone = read_localize_inputs(job, {});
  ASSERT_TRUE(alone) << to_string(alone.error());
  EXPECT_EQ(odometry_samples(*alone), usual);
  EXPECT_EQ(alone->recorded.chosen.odometry, "/tf (odom to base_link)");
  const fs::path wheels = input_files().folder / "wheels_too.csv";
  ASSERT_TRUE(
      write_text_file(wheels, "t_s,x_m,y_m,theta_rad,speed_m_s,yaw_rate_rad_s\n1,0,0,0,0,0\n2,0,0,0,0,0\n"));
  job.logs.push_back(wheels.string());
  const auto both = read_localize_inputs(job, {});
  ASSERT_TRUE(both) << to_string(both.error());
  EXPECT_EQ(odometry_samples(*both), 2U) << "the table takes precedence";
}

TEST(LocalizeInputsOf, RejectARecordingWithoutObservations) {
  const fs::path wheels = input_files().folder / "wheels.csv";
  ASSERT_TRUE(write_text_file(wheels, "t_s,x_m,y_m,theta_rad,speed_m_s,yaw_rate_rad_s\n1,0,0,0,0,0\n"));
  LocalizeJob job = input_files().job();
  job.logs = {wheels.string()};
  const auto inputs = read_localize_inputs(job, {});
  ASSERT_FALSE(inputs);
  EXPECT_EQ(inputs.error().code, ErrorCode::NotFound);
  EXPECT_EQ(inputs.error().place.source, wheels.string());
}

TEST(LocalizeInputsOf, WarnAboutAnIgnoredTagSize) {
  LocalizeJob job = input_files().job();
  job.tag_size_m = 0.5;
  const auto inputs = read_localize_inputs(job, {});
  ASSERT_TRUE(inputs);
  EXPECT_THAT(inputs->warnings, Contains(HasSubstr("`tag_size_m`")));
}

TEST(LocalizeLogOutput, RecordsMethodSourceAndOptions) {
  LocalizeJob job = input_files().job();
  job.output = (input_files().folder / "out.mcap").string();
  job.filter.corner_sigma_px = 0.77;
  job.no_adapt = true;
  fs::remove(job.output);
  const auto inputs = read_localize_inputs(job, {});
  ASSERT_TRUE(inputs);
  ASSERT_TRUE(localize(job, *inputs, {}));
  const auto lap = read_lap_file(job.output);
  ASSERT_TRUE(lap) << to_string(lap.error());
  EXPECT_EQ(lap->setup.metadata.at("waymark").at("method"), "riekf");
  EXPECT_EQ(lap->setup.metadata.at("waymark").at("source"), "lap.mcap");
  EXPECT_THAT(lap->attachments.at("options.yaml"), HasSubstr("corner_sigma_px: 0.77"));
  EXPECT_FALSE(lap->odometry.empty()) << "odometry is copied";
  EXPECT_FALSE(lap->truth.empty());
  EXPECT_TRUE(lap->frames.empty());
}

/// Ten seconds of a lap, and a map of its world.
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

TEST(LocalizeLog, ReportAgreesWithTheEvaluationAgainstGroundTruth) {
  const std::string output = (scene().folder / "estimate.mcap").string();
  const auto report = localized({.logs = {scene().lap}, .map = scene().map, .output = output});
  ASSERT_TRUE(report) << to_string(report.error());
  EXPECT_GT(report->certain, report->estimates / 2);
  EXPECT_NEAR(report->duration_s, 10, 0.5);
  // Compares the written estimates with the ground truth from the recording.
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
  EXPECT_THAT(comparison_warnings(*scores, inputs->reference), IsEmpty());
  const auto json = to_json(fields(*scores));
  EXPECT_EQ(json["poses"], report->certain);
}

TEST(LocalizeLog, LeavesNoFileIfCancelled) {
  const std::string output = (scene().folder / "cancelled.mcap").string();
  const LocalizeJob job{.logs = {scene().lap}, .map = scene().map, .output = output};
  const auto inputs = read_localize_inputs(job, {});
  ASSERT_TRUE(inputs);
  bool stop = false;
  JobControl control;
  // Cancels during the run that writes the output.
  control.cancelled = [&] { return stop || fs::exists(output); };
  const auto report = localize(job, *inputs, control);
  ASSERT_FALSE(report);
  stop = true;
  EXPECT_FALSE(fs::exists(output));
  EXPECT_FALSE(read_localize_inputs(job, control)) << "reading is cancelled as well";
}

TEST(LocalizeLog, ChoosesTheOutputFormatByTheExtension) {
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
  EXPECT_EQ(again.error().code, ErrorCode::Unwritable) << "poses are not overwritten";
}

TEST(LocalizeLog, RejectsInvalidJobsBeforeRunning) {
  const auto two_odometries = localized({.logs = {scene().lap, scene().lap}, .map = scene().map});
  ASSERT_FALSE(two_odometries);
  EXPECT_EQ(two_odometries.error().code, ErrorCode::InvalidArgument) << "two recordings contain odometry";
  EXPECT_FALSE(localized({.logs = {scene().lap}, .map = "/nowhere/map.yaml"}));
  EXPECT_FALSE(localized({.logs = {"/nowhere/lap.mcap"}, .map = scene().map}));
  const auto no_recording = localized({.map = scene().map});
  ASSERT_FALSE(no_recording);
  EXPECT_EQ(no_recording.error().code, ErrorCode::InvalidArgument);
  const auto unused = localized(
      {.logs = {scene().lap}, .map = scene().map, .method = LocalizationKind::Anchor, .no_adapt = true});
  ASSERT_FALSE(unused);
  EXPECT_EQ(unused.error().place.key, "no_adapt") << "the method anchor has no noise to adapt";
  LocalizeJob not_finite{.logs = {scene().lap}, .map = scene().map};
  not_finite.start = {std::nan(""), 0, 0};
  const auto start = localized(not_finite);
  ASSERT_FALSE(start);
  EXPECT_EQ(start.error().place.key, "start");
}

}  // namespace
}  // namespace waymark
