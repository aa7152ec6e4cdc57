#include "waymark/evaluation/turn_response.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "waymark/samples/mounted_camera.hpp"

namespace waymark {
namespace {

constexpr Duration kStep = std::chrono::milliseconds(20);

struct Drive {
  std::vector<StampedCommand> commands{};
  Trajectory trajectory{};
};

/// Turns to and fro by `gain` times what was commanded `delay` before.
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

TEST(TurnResponse, IsNotToldWhereNobodyTurns) {
  const Drive straight = drive(0.8, {}, 0.01);
  EXPECT_FALSE(turn_response(straight.commands, straight.trajectory, 0));
  EXPECT_FALSE(turn_response({}, straight.trajectory, 0));
  EXPECT_FALSE(turn_response(straight.commands, {}, 0));
}

TEST(SightingDistance, IsThatOfTheSharedSightingsOfMappedTags) {
  const TagId near{FamilyId::Tag36h11, 1};
  const TagId unknown{FamilyId::Tag36h11, 2};
  const TagMap map{.tags = {{near, {.map_T_tag = SE3(SO3(), {4, 0, 0.2}), .size_m = 0.1}}}};
  Trajectory trajectory;
  std::vector<TagFrame> frames;
  for (int i = 0; i < 100; ++i) {  // from 4 m to 1.03 m
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
