// Tests that every parameter of a calibration from a lap has a standard deviation, and that unobservable
// parameters have advice on what to drive.
#include "waymark/mapping/lap/lap_calibration.hpp"

#include <chrono>
#include <cmath>
#include <set>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"
#include "tests/support/ring_drive.hpp"

namespace waymark {
namespace {

using test::drive_ring;
using test::RingDrive;
using ::testing::HasSubstr;

RingDrive noisy(std::uint64_t seed = 1) {
  return drive_ring({.noise_px = 0.05, .odometry_sigma_m = 5e-4, .odometry_sigma_rad = 1e-3, .seed = seed});
}

TEST(LapCalibration, EveryParameterHasASigmaAndAdviceIfUnobservable) {
  const RingDrive drive = noisy(3);
  const auto found = calibrate_by_lap(drive.lap);
  ASSERT_TRUE(found) << to_string(found.error());
  const auto& values = found->calibration.values;
  const std::set<std::string> names = {
      "mounting_x_m",           "mounting_y_m", "mounting_roll_rad", "mounting_pitch_rad", "mounting_yaw_rad",
      "odometry_scale",         "yaw_scale",    "side_slip_s",       "camera_latency_s",   "turn_lead_s",
      "odometry_yaw_bias_rad_s"};
  for (const std::string& name : names) ASSERT_TRUE(values.contains(name)) << name;
  EXPECT_EQ(values.size(), names.size());
  for (const auto& [name, value] : values) {
    EXPECT_TRUE(std::isfinite(value.value) && value.sigma > 0) << name;
    EXPECT_EQ(value.advice.empty(), value.verdict == CalibrationVerdict::Known) << name;
  }
  EXPECT_EQ(values.at("side_slip_s").verdict, CalibrationVerdict::Unobservable) << "one bend at one speed";
  EXPECT_EQ(found->calibration.camera, drive.lap.camera) << "unchanged";
}

TEST(LapCalibration, FailsIfTagsAndOdometryDoNotOverlapInTime) {
  RingDrive drive = noisy(4);
  for (Odometry& sample : drive.lap.odometry) sample.stamp += std::chrono::hours(1);
  const auto apart = calibrate_by_lap(drive.lap);
  ASSERT_FALSE(apart);
  EXPECT_EQ(apart.error().code, ErrorCode::InvalidArgument);
  EXPECT_THAT(apart.error().hint, HasSubstr("`waymark info`"));
  testing::expect_on_page("calibrate", apart.error());
}

}  // namespace
}  // namespace waymark
