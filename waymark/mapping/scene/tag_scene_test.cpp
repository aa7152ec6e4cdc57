// Tests the grouping of views, and priors.
#include "waymark/mapping/scene/tag_scene.hpp"

#include <cmath>

#include <gtest/gtest.h>
#include <Eigen/Cholesky>

#include "waymark/base/random.hpp"
#include "waymark/geometry/lie.hpp"

namespace waymark {
namespace {

SensorTime at_ms(std::int64_t ms) { return SensorTime(std::chrono::milliseconds(ms)); }

SceneView view(std::size_t camera) { return {.camera = camera}; }

TEST(GroupViews, EqualStampsFormAFrameInAnyOrder) {
  const auto frames = group_views(
      {{at_ms(200), view(1)}, {at_ms(100), view(0)}, {at_ms(200), view(0)}, {at_ms(300), view(1)}}, false);
  ASSERT_EQ(frames.size(), 3U);
  EXPECT_EQ(frames[0].views.size(), 1U);
  EXPECT_EQ(frames[1].stamp, at_ms(200));
  ASSERT_EQ(frames[1].views.size(), 2U);
  EXPECT_EQ(frames[1].views[0].camera, 0U);
  EXPECT_TRUE(group_views({}, false).empty());
  EXPECT_TRUE(group_views({}, true).empty());
}

TEST(GroupViews, SimilarStampsFormAFrameIfApproximate) {
  const auto frames = group_views({{at_ms(100), view(0)},
                                   {at_ms(120), view(1)},
                                   {at_ms(130), view(1)},
                                   {at_ms(200), view(0)},
                                   {at_ms(300), view(0)},
                                   {at_ms(310), view(1)},
                                   {at_ms(500), view(1)}},
                                  true);
  ASSERT_EQ(frames.size(), 3U) << "one frame for each image from the first camera";
  EXPECT_EQ(frames[0].views.size(), 2U) << "grouped with the nearer of two images";
  EXPECT_EQ(frames[1].views.size(), 1U);
  EXPECT_EQ(frames[2].views.size(), 2U) << "without the image that is half a period away";
}

TEST(ScenePrior, ItsSigmaIsInTheAxesOfTheChildAndMatchesItsFactor) {
  Random random(1);
  for (int round = 0; round < 10; ++round) {
    SE3::Tangent xi;
    for (double& x : xi) x = random.uniform(-1, 1);
    const SE3 mean = SE3::exp(xi);
    const ScenePrior prior = ScenePrior::of(mean, {0.1, 0.2, 0.3}, {0.01, 0.02, 0.03});
    // A deviation of one sigma along an axis of the child frame gives a residual of one, for any orientation
    // of the parent.
    for (int k = 0; k < 6; ++k) {
      SE3::Tangent off = SE3::Tangent::Zero();
      off[k] = k < 3 ? 0.1 * (k + 1) : 0.01 * (k - 2);
      EXPECT_NEAR(pose_prior_residual(prior.factor(), mean * SE3::exp(off)).norm(), 1, 1e-6) << k;
    }
    const PosePriorFactor factor = prior.factor();
    const Matrix6 information = factor.whitening.transpose() * factor.whitening;
    EXPECT_LT((information * prior.covariance() - Matrix6::Identity()).norm(), 1e-3);
  }
}

TEST(ScenePrior, AnUnknownDirectionHasALargeSigma) {
  ScenePrior prior;
  prior.sqrt_information = Matrix6::Zero();
  EXPECT_NEAR(std::sqrt(prior.covariance()(2, 2)), 1e3, 1);
}

}  // namespace
}  // namespace waymark
