// Tests the cost of another program's solution of a scene.
#include "waymark/mapping/scene/scene_values.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "tests/support/rig_scene.hpp"

namespace waymark {
namespace {

using test::at;
using test::rig_scene;
using test::RigScene;

SceneValues truth_of(const RigScene& made) {
  SceneValues values{.static_bodies = {{"wall", SE3()}}};
  for (std::size_t c = 0; c < made.cameras.size(); ++c)
    values.cameras["cam" + std::to_string(c)] = made.cameras[c];
  for (std::size_t t = 0; t < made.tags.size(); ++t) values.tags[static_cast<int>(t)] = made.tags[t];
  for (std::size_t f = 0; f < made.rig.size(); ++f)
    values.moving_bodies[{"rig", made.recording.frames[f].stamp.time_since_epoch().count()}] = made.rig[f];
  return values;
}

TEST(SceneValues, TheCostOfTrueValuesIsThatOfTheNoise) {
  const RigScene exact = rig_scene();
  const auto nothing = cost_at(truth_of(exact), exact.scene, exact.recording);
  ASSERT_TRUE(nothing) << to_string(nothing.error());
  EXPECT_LT(nothing->cost, 1e-6);
  EXPECT_EQ(nothing->free_poses, 0);
  EXPECT_LT(nothing->reprojection_mean_px, 1e-6);
  const RigScene noisy = rig_scene({.frames = 200, .noise_px = 0.5});
  const auto cost = cost_at(truth_of(noisy), noisy.scene, noisy.recording);
  ASSERT_TRUE(cost);
  std::size_t numbers = 0;
  for (const SceneFrame& frame : noisy.recording.frames) numbers += 8 * frame.views[0].detections.size();
  const double expected = 0.5 * 0.25 * static_cast<double>(numbers);  // pixel noise of the model: 1 px
  EXPECT_NEAR(cost->cost, expected, 4 * std::sqrt(0.5 * 0.0625 * static_cast<double>(numbers)));
  EXPECT_NEAR(cost->reprojection_mean_px, 0.5 * std::sqrt(M_PI / 2), 0.02) << "Rayleigh";
  EXPECT_NEAR(cost->reprojection_median_px, 0.5 * std::sqrt(2 * std::log(2)), 0.03);
}

TEST(SceneValues, MissingPosesAreEstimated) {
  const RigScene made = rig_scene();
  SceneValues values = truth_of(made);
  values.tags.erase(4);
  values.moving_bodies.erase(values.moving_bodies.begin());
  const auto cost = cost_at(values, made.scene, made.recording);
  ASSERT_TRUE(cost);
  EXPECT_EQ(cost->free_poses, 2);
  EXPECT_LT(cost->cost, 1e-6);
}

TEST(SceneValues, AWrongValueIncreasesTheCost) {
  const RigScene made = rig_scene();
  SceneValues values = truth_of(made);
  values.tags.at(4) = at(0.02, 0, 0) * values.tags.at(4);
  const auto cost = cost_at(values, made.scene, made.recording);
  ASSERT_TRUE(cost);
  EXPECT_GT(cost->cost, 100);
  EXPECT_GT(cost->reprojection_mean_px, cost->reprojection_median_px);
}

TEST(SceneValues, FramesWithoutAGivenPoseAreRemoved) {
  const RigScene made = rig_scene();
  SceneValues values = truth_of(made);
  SceneRecording all = made.recording;
  restrict_to(values, all);
  EXPECT_EQ(all.frames.size(), made.recording.frames.size());
  while (values.moving_bodies.size() > 12) values.moving_bodies.erase(values.moving_bodies.begin());
  SceneRecording some = made.recording;
  restrict_to(values, some);
  ASSERT_EQ(some.frames.size(), 12U);
  EXPECT_EQ(some.frames.back().stamp, made.recording.frames.back().stamp);
  while (values.moving_bodies.size() > 9) values.moving_bodies.erase(values.moving_bodies.begin());
  SceneRecording free = made.recording;
  restrict_to(values, free);
  EXPECT_EQ(free.frames.size(), made.recording.frames.size()) << "nine poses do not select frames";
}

}  // namespace
}  // namespace waymark
