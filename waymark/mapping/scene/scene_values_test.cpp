// What another program's solution of a scene costs, and the size of all tags found from distances.
#include "waymark/mapping/scene/scene_values.hpp"

#include <gtest/gtest.h>

#include "tests/support/rig_scene.hpp"
#include "waymark/camera/intrinsics.hpp"
#include "waymark/mapping/scene/corner_consistency.hpp"
#include "waymark/mapping/scene/scene_intrinsics.hpp"
#include "waymark/mapping/scene/scene_report.hpp"
#include "waymark/mapping/scene/tag_scale.hpp"

namespace waymark {
namespace {

using test::at;
using test::rig_scene;
using test::RigScene;
using test::true_scene_map;

SceneValues truth_of(const RigScene& made) {
  SceneValues values{.static_bodies = {{"wall", SE3()}}};
  for (std::size_t c = 0; c < made.cameras.size(); ++c)
    values.cameras["cam" + std::to_string(c)] = made.cameras[c];
  for (std::size_t t = 0; t < made.tags.size(); ++t) values.tags[static_cast<int>(t)] = made.tags[t];
  for (std::size_t f = 0; f < made.rig.size(); ++f)
    values.moving_bodies[{"rig", made.recording.frames[f].stamp.time_since_epoch().count()}] = made.rig[f];
  return values;
}

TEST(SceneValues, TheTruthCostsWhatTheNoiseDoes) {
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
  const double expected = 0.5 * 0.25 * static_cast<double>(numbers);  // model: 1 px
  EXPECT_NEAR(cost->cost, expected, 4 * std::sqrt(0.5 * 0.0625 * static_cast<double>(numbers)));
  EXPECT_NEAR(cost->reprojection_mean_px, 0.5 * std::sqrt(M_PI / 2), 0.02) << "Rayleigh";
  EXPECT_NEAR(cost->reprojection_median_px, 0.5 * std::sqrt(2 * std::log(2)), 0.03);
}

TEST(SceneValues, WhatTheyDoNotHaveIsFreeAndFound) {
  const RigScene made = rig_scene();
  SceneValues values = truth_of(made);
  values.tags.erase(4);
  values.moving_bodies.erase(values.moving_bodies.begin());
  const auto cost = cost_at(values, made.scene, made.recording);
  ASSERT_TRUE(cost);
  EXPECT_EQ(cost->free_poses, 2);
  EXPECT_LT(cost->cost, 1e-6);
}

TEST(SceneValues, AWrongValueCostsWhatItDoes) {
  const RigScene made = rig_scene();
  SceneValues values = truth_of(made);
  values.tags.at(4) = at(0.02, 0, 0) * values.tags.at(4);
  const auto cost = cost_at(values, made.scene, made.recording);
  ASSERT_TRUE(cost);
  EXPECT_GT(cost->cost, 100);
  EXPECT_GT(cost->reprojection_mean_px, cost->reprojection_median_px);
}

TEST(SceneValues, FramesThatTheOtherSolutionLeftOutAreLeftOut) {
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
  EXPECT_EQ(free.frames.size(), made.recording.frames.size()) << "nine poses are no selection";
}

/// The scene with a distance and sizes that are given wrong by a factor.
SceneMap misprinted(double factor) {
  RigScene made = rig_scene({.noise_px = 0.02});
  const double true_m = (made.tags[1].translation() - made.tags[6].translation()).norm();
  made.scene.distances = {{1, 6, -1, -1, true_m, 0.0005}};
  for (SceneTag& tag : made.scene.bodies[0].tags) tag.size_m *= factor;
  return true_scene_map(made, 0.02);
}

TEST(TagScale, IsWhatADistanceSays) {
  for (const double factor : {1.0, 1.03, 0.96}) {
    SceneMap map = misprinted(factor);
    map.problem.bundle.priors.clear();
    map.problem.bundle.poses[map.problem.tags[0][0]].fixed = true;
    map.problem.bundle.poses[map.problem.bodies[0].front()].fixed = true;
    map.problem.bundle.poses[map.problem.cameras[0]].fixed = true;
    int searches = 0;
    const TagScale scale = find_tag_scale(map, 1, 0.02, [&] {
      ++searches;
      EXPECT_TRUE(solve(map.problem.bundle).usable());
    });
    EXPECT_NEAR(scale.value, 1 / factor, 4 * scale.sigma + 1e-3) << factor;
    EXPECT_NEAR(map.size_scale, scale.value, 1e-12);
    EXPECT_GT(scale.sigma, 0);
    EXPECT_LE(scale.sigma, 0.02) << "no less sure than beforehand";
    EXPECT_EQ(scale.by_scale.size(), map.problem.bundle.poses.size());
    EXPECT_LT(searches, 12);
    for (const CornerTerm& term : map.problem.bundle.corners)
      EXPECT_NEAR(term.factor.size_m, test::kRigTag_m * factor * scale.value, 1e-9);
    // Poses move with the size as by_scale says: away from the tag that is held.
    const Vector6& far = scale.by_scale[map.problem.tags[0][6]];
    EXPECT_GT(far.head<3>().norm(), 1);
    EXPECT_EQ(scale.by_scale[map.problem.tags[0][0]], Vector6::Zero());
  }
}

TEST(FreeIntrinsics, AreThoseThatTheSceneKnowsRoughlyOrAll) {
  RigScene made = rig_scene({.cameras = 2});
  made.scene.cameras[1].intrinsics_sigma =
      Eigen::VectorXd::Constant(intrinsics_of(made.scene.cameras[1].model).size(), 0.7);
  SceneMap map = true_scene_map(made);
  free_intrinsics(map, false);
  ASSERT_EQ(map.problem.bundle.intrinsics.size(), 2U);
  EXPECT_FALSE(map.problem.bundle.intrinsics[0].free());
  EXPECT_TRUE(map.problem.bundle.intrinsics[1].free());
  EXPECT_EQ(map.problem.bundle.intrinsics[1].sigma[0], 0.7);
  free_intrinsics(map, true);
  const Eigen::VectorXd& sigma = map.problem.bundle.intrinsics[0].sigma;
  EXPECT_NEAR(sigma[0], 4.42, 1e-9) << "1 % of the focal length";
  EXPECT_NEAR(sigma[2], 6.4, 1e-9) << "1 % of the width";
  EXPECT_EQ(map.problem.bundle.intrinsics[1].sigma[0], 0.7) << "what is known stays";
  ASSERT_TRUE(solve(map.problem.bundle).usable());
  map.covariance = covariance(map.problem.bundle);
  report_intrinsics(map);
  ASSERT_EQ(map.intrinsics.size(), 2U);
  for (const FoundIntrinsics& lens : map.intrinsics) {
    EXPECT_EQ(lens.names.size(), static_cast<std::size_t>(lens.found.size()));
    EXPECT_LT((lens.found - lens.given).cwiseQuotient(lens.prior_sigma).cwiseAbs().maxCoeff(), 0.1);
    EXPECT_TRUE((lens.sigma.array() <= lens.prior_sigma.array() * (1 + 1e-9)).all());
  }
}

TEST(CornerConsistency, IsOneWhereTheDetectorsCovariancesAreTrue) {
  for (const double times : {1.0, 2.0}) {
    RigScene made = rig_scene({.frames = 60, .noise_px = 0.2 * times});
    for (SceneFrame& frame : made.recording.frames) {
      for (TagDetection& seen : frame.views[0].detections) {
        CornerCovariance P = 0.04 * CornerCovariance::Identity();
        P(0, 0) *= 1 + 1e-9;  // of its own, not one number for all
        seen.corner_covariance_px2 = P;
      }
    }
    SceneMap map = true_scene_map(made);
    for (CornerTerm& term : map.problem.bundle.corners) {
      term.factor.whitening = CornerCovariance::Identity() / 0.2;
      term.factor.isotropic = true;
    }
    ASSERT_TRUE(solve(map.problem.bundle).usable());
    EXPECT_NEAR(corner_chi2_per_dof(map), times * times, 0.15 * times * times);
  }
  const SceneMap without = true_scene_map(rig_scene({.noise_px = 0.2}));
  EXPECT_EQ(corner_chi2_per_dof(without), 0) << "no covariance was given";
}

TEST(Reprojection, IsOfCornersInUseInPixels) {
  RigScene made = rig_scene();
  SceneMap map = true_scene_map(made);
  for (CornerTerm& term : map.problem.bundle.corners) {
    for (Eigen::Vector2d& corner : term.factor.corners_px) corner += Eigen::Vector2d(3, 4);
  }
  map.problem.bundle.corners[0].factor.corners_px[0].x() += 1e6;
  map.problem.bundle.corners[0].used = false;
  measure_reprojection(map);
  EXPECT_NEAR(map.reprojection_mean_px, 5, 1e-6);
  EXPECT_NEAR(map.reprojection_median_px, 5, 1e-6);
  for (CornerTerm& term : map.problem.bundle.corners) term.used = false;
  map.reprojection_mean_px = 7;
  measure_reprojection(map);
  EXPECT_EQ(map.reprojection_mean_px, 7) << "of nothing there is none";
}

}  // namespace
}  // namespace waymark
