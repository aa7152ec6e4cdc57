// Tests the estimation of cameras.
#include "waymark/mapping/scene/scene_calibration.hpp"

#include <gtest/gtest.h>

#include "tests/support/rig_scene.hpp"
#include "waymark/camera/intrinsics.hpp"

namespace waymark {
namespace {

using test::rig_scene;
using test::RigScene;
using test::true_scene_map;

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
