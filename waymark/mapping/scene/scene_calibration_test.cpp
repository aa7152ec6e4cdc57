// Tests the estimation of the size of all tags from distances, and the estimation of cameras.
#include "waymark/mapping/scene/scene_calibration.hpp"

#include <gtest/gtest.h>

#include "tests/support/rig_scene.hpp"
#include "waymark/camera/intrinsics.hpp"

namespace waymark {
namespace {

using test::rig_scene;
using test::RigScene;
using test::true_scene_map;

/// A scene with a given distance, in which all tag sizes are wrong by a factor.
SceneMap misprinted(double factor) {
  RigScene made = rig_scene({.noise_px = 0.02});
  const double true_m = (made.tags[1].translation() - made.tags[6].translation()).norm();
  made.scene.distances = {{1, 6, -1, -1, true_m, 0.0005}};
  for (SceneTag& tag : made.scene.bodies[0].tags) tag.size_m *= factor;
  return true_scene_map(made, 0.02);
}

TEST(TagScale, AgreesWithAGivenDistance) {
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
    EXPECT_LE(scale.sigma, 0.02) << "at most the prior uncertainty";
    EXPECT_EQ(scale.by_scale.size(), map.problem.bundle.poses.size());
    EXPECT_LT(searches, 12);
    for (const CornerTerm& term : map.problem.bundle.corners)
      EXPECT_NEAR(term.factor.size_m, test::kRigTag_m * factor * scale.value, 1e-9);
    // The derivative of the poses with respect to the size is by_scale, relative to the fixed tag.
    const Vector6& far = scale.by_scale[map.problem.tags[0][6]];
    EXPECT_GT(far.head<3>().norm(), 1);
    EXPECT_EQ(scale.by_scale[map.problem.tags[0][0]], Vector6::Zero());
  }
}

TEST(FreeIntrinsics, AreThoseWithASigmaOrAll) {
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
  EXPECT_EQ(map.problem.bundle.intrinsics[1].sigma[0], 0.7) << "a given sigma is kept";
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

}  // namespace
}  // namespace waymark
