// The chain on laps whose truth is known: exact without noise, right in spite of tags that show the wrong one
// of their poses.
#include "waymark/mapping/lap/teach_chain.hpp"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "waymark/base/random.hpp"
#include "waymark/geometry/lie.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/geometry/uncertain_draw.hpp"

namespace waymark {
namespace {

constexpr double kPi = std::numbers::pi;

TagId tag(int number) { return {.number = number}; }

SE3 base_T_cam() {
  const Eigen::Matrix3d optical = (Eigen::Matrix3d() << 0, 0, 1, -1, 0, 0, 0, -1, 0).finished();
  return {SO3::from_matrix(optical), {0.08, 0, 0.18}};
}

/// Tags on a circle of 3 m, some leaning, all facing inwards; one lies on the floor.
TagMap true_tags() {
  TagMap map;
  const Eigen::Matrix3d upright = (Eigen::Matrix3d() << 0, 0, 1, -1, 0, 0, 0, -1, 0).finished();
  for (int i = 0; i < 16; ++i) {
    const double angle = 2 * kPi * i / 16;
    const SE3 place = lift(SE2(3 * std::cos(angle), 3 * std::sin(angle), angle));
    const SE3 lean(SO3::exp({0.02 * (i % 5), 0.03 * (i % 3), 0.1 * i}) * SO3::from_matrix(upright),
                   {0, 0, 0.2 + 0.03 * (i % 4)});
    map.tags[tag(i)] = {.map_T_tag = place * lean, .size_m = 0.16};
  }
  map.tags[tag(16)] = {.map_T_tag = SE3(SO3::exp({kPi, 0, 0.4}), {2.2, 0.5, 0}), .size_m = 0.16};
  return map;
}

/// A drive round a circle of 1 m that ends where it began; every frame sees what lies within 70 degrees
/// ahead.
Trajectory true_lap() {
  Trajectory lap;
  for (int i = 0; i <= 300; ++i) {
    const double angle = 2 * kPi * i / 300;
    lap.push_back({SensorTime(Duration(i * 66'000'000LL)),
                   lift(SE2(std::cos(angle), std::sin(angle), angle + kPi / 2))});
  }
  return lap;
}

std::vector<ObservedFrame> observe_lap(const Trajectory& lap, const TagMap& tags) {
  std::vector<ObservedFrame> frames;
  for (const StampedPose& pose : lap) {
    ObservedFrame frame{.stamp = pose.stamp};
    const SE3 cam_T_map = (pose.map_T_base * base_T_cam()).inverse();
    for (const auto& [id, mapped] : tags.tags) {
      const SE3 cam_T_tag = cam_T_map * mapped.map_T_tag;
      const Eigen::Vector3d ahead = cam_T_tag.translation().normalized();
      if (ahead.z() < std::cos(70 * kPi / 180)) continue;
      frame.tags.push_back(
          {.tag = id, .cam_T_tag = cam_T_tag, .covariance = PoseCovariance::Identity() * 1e-5});
    }
    frames.push_back(frame);
  }
  return frames;
}

Result<ChainResult> chain(const std::vector<ObservedFrame>& frames, const ChainOptions& options = {}) {
  return map_by_chain(frames, tag(0), true_tags().tags.at(tag(0)).map_T_tag, {.default_size_m = 0.16},
                      base_T_cam(), options);
}

double worst(const TagMap& map) {
  double most = 0;
  for (const auto& [id, mapped] : map.tags)
    most = std::max(most, minus(mapped.map_T_tag, true_tags().find(id)->map_T_tag).norm());
  return most;
}

TEST(TeachChain, WithoutNoiseExact) {
  for (const bool spread : {false, true}) {
    const Trajectory lap = true_lap();
    const auto result = chain(observe_lap(lap, true_tags()), {.spread_closing_error = spread});
    ASSERT_TRUE(result) << to_string(result.error());
    EXPECT_EQ(result->map.tags.size(), 17U);
    EXPECT_TRUE(result->unconnected.empty());
    EXPECT_LT(worst(result->map), 1e-9);
    EXPECT_EQ(result->frames_without_pose, 0);
    ASSERT_EQ(result->trajectory.size(), lap.size());
    // Neighbours hold a trajectory together as a weak link; on a curve that is millimetres, at its ends more.
    for (std::size_t i = 0; i < lap.size(); ++i)
      EXPECT_LT(minus(result->trajectory[i].map_T_base, lap[i].map_T_base).norm(),
                i < 7 || i + 7 >= lap.size() ? 5e-3 : 5e-4)
          << i;
  }
}

TEST(TeachChain, TheMapNeedNotHaveItsOriginOnTheFloor) {
  const SE3 moved(SO3::exp({0, 0, 1}), {5, -2, -0.3});
  const auto result =
      map_by_chain(observe_lap(true_lap(), true_tags()), tag(0),
                   moved * true_tags().tags.at(tag(0)).map_T_tag, {.default_size_m = 0.16}, base_T_cam());
  ASSERT_TRUE(result);
  for (const auto& [id, mapped] : result->map.tags)
    EXPECT_LT(minus(mapped.map_T_tag, moved * true_tags().find(id)->map_T_tag).norm(), 1e-9);
}

/// The pose mirrored about the plane that faces the camera.
SE3 mirrored(const SE3& cam_T_tag) {
  const Eigen::Vector3d sight = cam_T_tag.translation().normalized();
  const Eigen::Vector3d normal = cam_T_tag.rotation() * Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d axis = normal.cross(sight);
  const double angle = std::atan2(axis.norm(), normal.dot(sight));
  if (axis.norm() < 1e-9) return cam_T_tag;
  return {SO3::exp(axis.normalized() * 2 * angle) * cam_T_tag.rotation(), cam_T_tag.translation()};
}

// In four of ten observations the corners fit the wrong pose a little better, as they do for far tags: no
// frame by itself can tell.
TEST(TeachChain, WrongPosesAreFoundByAllFramesTogether) {
  Random random(5);
  auto frames = observe_lap(true_lap(), true_tags());
  int wrong = 0;
  for (ObservedFrame& frame : frames) {
    for (TagPoseObservation& seen : frame.tags) {
      const SE3 truth = seen.cam_T_tag;
      const bool is_wrong = random.uniform() < 0.4;
      wrong += is_wrong ? 1 : 0;
      if (is_wrong) seen.cam_T_tag = mirrored(truth);
      seen.other = TagPoseSolution{
          .cam_T_tag = is_wrong ? truth : mirrored(truth), .chi2 = 1, .covariance = seen.covariance};
    }
  }
  EXPECT_GT(wrong, 500);
  const auto result = chain(frames);
  ASSERT_TRUE(result);
  EXPECT_LT(worst(result->map), 0.01);
}

TEST(TeachChain, NoisyFramesAreAveraged) {
  Random random(6);
  auto frames = observe_lap(true_lap(), true_tags());
  for (ObservedFrame& frame : frames) {
    for (TagPoseObservation& seen : frame.tags) {
      seen.covariance = PoseCovariance::Identity() * (0.02 * 0.02);
      seen.cam_T_tag = sample(Uncertain<SE3>{seen.cam_T_tag, seen.covariance}, random);
    }
  }
  const auto result = chain(frames);
  ASSERT_TRUE(result);
  EXPECT_LT(worst(result->map), 0.06) << "one link of two single observations is wrong by as much";
}

TEST(TeachChain, WhatLeadsNowhereIsSaid) {
  auto frames = observe_lap(true_lap(), true_tags());
  ObservedFrame alone{.stamp = SensorTime(std::chrono::seconds(100))};
  alone.tags.push_back({.tag = tag(40), .cam_T_tag = SE3({}, {0, 0, 1})});
  frames.push_back(alone);
  const auto result = chain(frames);
  ASSERT_TRUE(result);
  EXPECT_EQ(result->unconnected, std::vector<TagId>{tag(40)});
  EXPECT_EQ(result->frames_without_pose, 1);

  const auto never = map_by_chain(frames, tag(99), {}, {.default_size_m = 0.16}, base_T_cam());
  ASSERT_FALSE(never);
  EXPECT_EQ(never.error().message, "the anchor tag36h11:99 is never seen in this lap");
  EXPECT_FALSE(chain({}));
  EXPECT_FALSE(chain(frames, {.max_distance_m = -1}));
  EXPECT_FALSE(chain(frames, {.max_distance_m = 0.2})) << "the anchor is never seen so near";
}

}  // namespace
}  // namespace waymark
