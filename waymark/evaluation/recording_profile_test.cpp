#include "waymark/evaluation/recording_profile.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "waymark/base/random.hpp"

namespace waymark {
namespace {

SensorTime at(double seconds) { return SensorTime(Duration(std::llround(seconds * 1e9))); }

/// A robot that stands for 5 s and drives for 15, with noises that are known, and a camera that fails for 2
/// s.
RecordingProfile known() {
  RecordingProfiler profiler;
  Random random(1);
  const auto asked = [](double t) { return t < 5 ? 0.0 : 0.3 + 0.1 * std::sin(t); };
  for (int ms = 0; ms < 20000; ms += 10) {
    const double t = ms * 1e-3;
    if (ms % 50 == 0) profiler.add(StampedCommand{at(t), {asked(t), 0}});
    if (ms % 20 == 0) profiler.add(Odometry{.stamp = at(t), .speed_m_s = asked(t - 0.15)});
    profiler.add(ImuSample{.stamp = at(t),
                           .angular_velocity_rad_s = {0, 0, 0.003 + 0.005 * random.normal()},
                           .linear_acceleration_m_s2 = {0, 0, 9.81 + 0.05 * random.normal()}});
    if (ms % 100 != 0 || (t > 10 && t < 12)) continue;
    TagFrame frame{.stamp = at(t)};
    for (const int number : {1, 2}) {
      if (random.uniform() < 0.1) continue;
      TagDetection detection{.tag = {FamilyId::Tag36h11, number}};
      for (auto& corner : detection.corners_px)
        corner = Eigen::Vector2d(100 + t + 0.2 * random.normal(), 50 + 0.2 * random.normal());
      frame.detections.push_back(detection);
    }
    profiler.add(frame);
  }
  return profiler.profile();
}

TEST(RecordingProfile, FindsRatesGapsAndNoisesThatAreKnown) {
  const RecordingProfile profile = known();
  EXPECT_NEAR(profile.duration_s, 20, 0.02);
  EXPECT_NEAR(profile.streams.at("imu").rate_hz, 100, 1e-6);
  EXPECT_NEAR(profile.streams.at("odometry").rate_hz, 50, 1e-6);
  EXPECT_NEAR(profile.streams.at("camera").rate_hz, 10, 1e-6);
  EXPECT_NEAR(profile.streams.at("camera").longest_gap_s, 2, 1e-6);
  ASSERT_EQ(profile.camera_gaps.size(), 1U);
  EXPECT_NEAR(profile.camera_gaps[0].at_s, 10, 1e-6);
  EXPECT_TRUE(profile.odometry_gaps.empty());
  EXPECT_NEAR(*profile.gyro_noise_rad_s / 0.005, 1, 0.08);
  EXPECT_NEAR(*profile.gyro_bias_rad_s, 0.003, 0.001);
  EXPECT_NEAR(*profile.acceleration_noise_m_s2 / 0.05, 1, 0.08);
  EXPECT_NEAR(*profile.corner_sigma_px / 0.2, 1, 0.08);
  EXPECT_NEAR(*profile.miss_probability, 0.1, 0.05);
  EXPECT_NEAR(*profile.command_delay_s, 0.15, 0.03);
  EXPECT_NEAR(profile.standing_share, 0.25, 0.02);
  EXPECT_NEAR(profile.mean_speed_m_s, 0.3, 0.03);
}

TEST(RecordingProfile, OfLittleOrNothingSaysWhatItDoesNotKnow) {
  EXPECT_EQ(RecordingProfiler().profile().duration_s, 0);
  RecordingProfiler profiler;
  profiler.add(Odometry{.stamp = at(3)});
  const RecordingProfile profile = profiler.profile();
  EXPECT_FALSE(profile.gyro_noise_rad_s);
  EXPECT_FALSE(profile.corner_sigma_px);
  EXPECT_FALSE(profile.command_delay_s);
  EXPECT_EQ(profile.streams.at("odometry").rate_hz, 0);
  EXPECT_EQ(profile.mean_speed_m_s, 0);
}

}  // namespace
}  // namespace waymark
