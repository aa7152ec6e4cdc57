// Tests the profile of a recording as a table and as simulator options. The reference is the simulator that
// wrote the recording, because its rates and noise are known.
#include "waymark/app/common/profile_table.hpp"

#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "tests/support/recorded_lap.hpp"

namespace waymark {
namespace {

using ::testing::HasSubstr;

const std::string& lap() {
  static const std::string file =
      test::record_lap(testing::fresh_folder("jobs_profile_lap") / "lap.mcap", 3, {.for_s = 20});
  return file;
}

const ProfileRow* row_of(const std::vector<ProfileRow>& rows, const std::string& key) {
  const auto found = std::ranges::find(rows, key, &ProfileRow::key);
  return found == rows.end() ? nullptr : &*found;
}

TEST(ProfileTable, MeasuresTheSimulatorOptions) {
  const auto profile = profile_of(lap(), {});
  ASSERT_TRUE(profile) << to_string(profile.error());
  const SimulatedRobotOptions simulated;
  EXPECT_NEAR(profile->duration_s, 20, 0.2);
  EXPECT_NEAR(profile->streams.at("camera").rate_hz, simulated.camera_rate_hz, 0.1);
  EXPECT_NEAR(profile->streams.at("odometry").rate_hz, simulated.odometry_rate_hz, 0.1);
  EXPECT_NEAR(profile->streams.at("imu").rate_hz, simulated.imu_rate_hz, 0.1);
  ASSERT_TRUE(profile->gyro_noise_rad_s);
  EXPECT_NEAR(*profile->gyro_noise_rad_s, simulated.sensors.gyro_noise_rad_s,
              0.2 * simulated.sensors.gyro_noise_rad_s);
  EXPECT_TRUE(profile->camera_gaps.empty());
}

TEST(ProfileTable, RecordingsWithoutOdometryHaveNoSpeeds) {
  const std::string file = test::record_lap(testing::fresh_folder("jobs_profile_none") / "lap.mcap", 3,
                                            {.for_s = 5, .odometry = false});
  const auto profile = profile_of(file, {});
  ASSERT_FALSE(profile);
  EXPECT_EQ(profile.error().code, ErrorCode::NotFound);
  EXPECT_EQ(profile.error().place.source, file);
  EXPECT_FALSE(profile_of("/nowhere/lap.mcap", {}));
  EXPECT_FALSE(profile_of(lap(), test::cancelled_after(10)));
}

TEST(ProfileTable, RowsWithoutAnyValueAreOmitted) {
  RecordingProfile like{.duration_s = 10};
  like.streams["camera"] = {.samples = 100, .rate_hz = 10, .longest_gap_s = 0.2};
  like.streams["camera left"] = {.samples = 50, .rate_hz = 5, .longest_gap_s = 0.3};
  like.streams["imu"] = {.samples = 1, .rate_hz = 0};
  like.corner_sigma_px = 0.25;
  RecordingProfile made{.duration_s = 12};
  made.streams["camera"] = {.samples = 100, .rate_hz = 9, .longest_gap_s = 0.1};
  made.gyro_noise_rad_s = 0.01;
  const auto rows = profile_table(like, made);
  ASSERT_NE(row_of(rows, "camera_rate_hz"), nullptr);
  EXPECT_EQ(row_of(rows, "camera_rate_hz")->recording, 10);
  EXPECT_EQ(row_of(rows, "camera_rate_hz")->simulation, 9);
  ASSERT_NE(row_of(rows, "camera_left_rate_hz"), nullptr) << "this is one of several cameras";
  EXPECT_EQ(row_of(rows, "camera_left_rate_hz")->simulation, std::nullopt);
  EXPECT_EQ(row_of(rows, "imu_rate_hz"), nullptr) << "one sample has no rate";
  EXPECT_EQ(row_of(rows, "lidar_rate_hz"), nullptr);
  EXPECT_EQ(row_of(rows, "corner_sigma_px")->recording, 0.25);
  EXPECT_EQ(row_of(rows, "gyro_noise_rad_s")->recording, std::nullopt);
  EXPECT_THAT(to_text(rows), HasSubstr("corner noise [px]                               0.25           -"));
  const auto json = to_json(fields(ProfileReport{"made.mcap", rows}));
  EXPECT_EQ(json["file"], "made.mcap");
  EXPECT_EQ(json["quantities"]["duration_s"]["simulation"], 12);
  EXPECT_TRUE(json["quantities"]["corner_sigma_px"]["simulation"].is_null());
}

TEST(ProfileTable, MeasuredOptionsAreSetAndOthersKept) {
  RecordingProfile profile;
  profile.streams["camera"] = {.samples = 100, .rate_hz = 1000};
  profile.streams["odometry"] = {.samples = 100, .rate_hz = 20};
  profile.corner_sigma_px = 0.4;
  profile.image_arrival_delay_s = 60;
  profile.command_delay_s = 0.3;
  SimulatedRobotOptions before;
  before.dynamics.speed_lag_s = 0.1;
  before.sensors.gyro_noise_rad_s = 0.123;
  before.tag_camera.small_tag_sigma_px = 1;
  const SimulatedRobotOptions options = options_like(profile, before);
  EXPECT_EQ(options.camera_rate_hz, 200) << "the maximum of the simulator";
  EXPECT_EQ(options.odometry_rate_hz, 20);
  EXPECT_EQ(options.imu_rate_hz, before.imu_rate_hz) << "not measured";
  EXPECT_EQ(options.sensors.gyro_noise_rad_s, 0.123);
  EXPECT_EQ(options.tag_camera.corner_sigma_px, 0.4);
  EXPECT_EQ(options.tag_camera.small_tag_sigma_px, 0) << "the measured noise already includes it";
  EXPECT_EQ(options.camera_latency_s, 10);
  EXPECT_DOUBLE_EQ(options.dynamics.speed_lag_s + options.dynamics.command_delay_s, 0.3);
  EXPECT_DOUBLE_EQ(options.dynamics.speed_lag_s, 0.1);
  EXPECT_TRUE(check(options)) << "every value is valid for the simulator";
  const SimulatedRobotOptions unmeasured = options_like({}, before);
  EXPECT_EQ(unmeasured.camera_rate_hz, before.camera_rate_hz) << "nothing was measured";
  EXPECT_TRUE(unmeasured.faults.empty());
}

TEST(ProfileTable, GapsBecomeFaultsBetweenTheSamples) {
  RecordingProfile profile;
  profile.streams["camera"] = {.samples = 100, .rate_hz = 10};
  profile.camera_gaps = {{.at_s = 5, .for_s = 2}};
  profile.odometry_gaps = {{.at_s = 7, .for_s = 1}};
  const auto options = options_like(profile, {});
  ASSERT_EQ(options.faults.size(), 2U);
  EXPECT_EQ(options.faults[0].kind, FaultKind::CameraLost);
  EXPECT_DOUBLE_EQ(options.faults[0].at_s, 5.05);
  EXPECT_DOUBLE_EQ(options.faults[0].for_s, 1.9);
  EXPECT_EQ(options.faults[1].kind, FaultKind::OdometryLost);
}

TEST(ProfileTable, LatencyIsUnknownIfMessagesWereRecordedAtTheirStamps) {
  EXPECT_EQ(image_latency_of("/nowhere/lap.mcap", {}), std::nullopt);
  EXPECT_EQ(image_latency_of(lap(), {}), std::nullopt) << "the log times are the timestamps";
}

}  // namespace
}  // namespace waymark
