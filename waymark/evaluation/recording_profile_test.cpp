#include "waymark/evaluation/recording_profile.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "waymark/base/random.hpp"
#include "waymark/samples/mounted_camera.hpp"

namespace waymark {
namespace {

SensorTime at(double seconds) { return SensorTime(Duration(std::llround(seconds * 1e9))); }

/// A robot that is stationary for 5 s and then drives for 15 s, with known noise and a camera that fails for
/// 2 s.
RecordingProfile known_recording() {
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

TEST(RecordingProfile, MeasuresKnownRatesGapsAndNoise) {
  const RecordingProfile profile = known_recording();
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

TEST(RecordingProfile, LeavesUnknownValuesEmpty) {
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

constexpr Duration kStep = std::chrono::milliseconds(20);

struct Drive {
  std::vector<StampedCommand> commands{};
  Trajectory trajectory{};
};

/// Turns left and right at `gain` times the yaw rate commanded `delay` earlier.
Drive drive(double gain, Duration delay, double most_rad_s) {
  Drive drive;
  double yaw_rad = 0;
  const auto rate = [&](SensorTime at) {
    return most_rad_s * std::sin(2 * to_seconds(at.time_since_epoch()));
  };
  for (SensorTime at{}; at < SensorTime(std::chrono::seconds(30)); at += kStep) {
    drive.commands.push_back({at, {.speed_m_s = 0.2, .yaw_rate_rad_s = rate(at)}});
    drive.trajectory.push_back({at, SE3(SO3::exp({0, 0, yaw_rad}), {0, 0, 0})});
    yaw_rad += gain * rate(at - delay) * to_seconds(kStep);
  }
  return drive;
}

TEST(TurnResponse, IsTheGainFromCommandToMotionAfterTheDelay) {
  const Duration delay = std::chrono::milliseconds(100);
  for (const double gain : {0.3, 0.85, 1.1}) {
    const Drive d = drive(gain, delay, 0.8);
    const auto found = turn_response(d.commands, d.trajectory, to_seconds(delay));
    ASSERT_TRUE(found);
    EXPECT_NEAR(*found, gain, 0.02 * gain);
  }
}

TEST(TurnResponse, IsEmptyWithoutTurns) {
  const Drive straight = drive(0.8, {}, 0.01);
  EXPECT_FALSE(turn_response(straight.commands, straight.trajectory, 0));
  EXPECT_FALSE(turn_response({}, straight.trajectory, 0));
  EXPECT_FALSE(turn_response(straight.commands, {}, 0));
}

TEST(ObservationDistance, IsTheQuantileOverMapTags) {
  const TagId near{FamilyId::Tag36h11, 1};
  const TagId unknown{FamilyId::Tag36h11, 2};
  const TagMap map{.tags = {{near, {.map_T_tag = SE3(SO3(), {4, 0, 0.2}), .size_m = 0.1}}}};
  Trajectory trajectory;
  std::vector<TagFrame> frames;
  for (int i = 0; i < 100; ++i) {  // approaches from 4 m to 1.03 m
    const SensorTime at = SensorTime(i * kStep);
    trajectory.push_back({at, SE3(SO3(), {0.03 * i, 0, 0})});
    frames.push_back({.stamp = at, .detections = {TagDetection{.tag = near}, TagDetection{.tag = unknown}}});
  }
  const SE3 base_T_cam(SO3(), {0, 0, 0.2});
  const auto all = observation_distance_m(frames, map, base_T_cam, trajectory, 1);
  ASSERT_TRUE(all);
  EXPECT_NEAR(*all, 4, 1e-9);
  EXPECT_NEAR(*observation_distance_m(frames, map, base_T_cam, trajectory, 0.5), 2.5, 0.05);
  EXPECT_FALSE(observation_distance_m(frames, {}, base_T_cam, trajectory, 1));
  EXPECT_FALSE(observation_distance_m({frames.begin(), frames.begin() + 10}, map, base_T_cam, trajectory, 1));
}

}  // namespace
}  // namespace waymark
