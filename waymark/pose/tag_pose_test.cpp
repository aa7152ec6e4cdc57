#include "waymark/pose/tag_pose.hpp"

#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "tests/support/geometry_matchers.hpp"
#include "tests/support/numeric_jacobian.hpp"
#include "tests/support/tag_views.hpp"

namespace waymark {
namespace {

using ::testing::HasSubstr;
using testing::kTagSize;
using testing::MatrixNear;
using testing::SE3Near;
using testing::see_tag;
using testing::some_covariance;
using testing::with_noise;
using Vector6 = SE3::Tangent;

/// Sum of squared pixel errors over their variance, written down independently: the cost both solutions
/// minimise.
double cost(const CameraModel& camera, const TagDetection& seen, double sigma_px, const SE3& cam_T_tag) {
  Eigen::Matrix<double, 8, 1> e;
  for (std::size_t i = 0; i < 4; ++i) {
    e.segment<2>(static_cast<Eigen::Index>(2 * i)) =
        camera.project(cam_T_tag * testing::tag_corners().at(i)).value() - seen.corners_px.at(i);
  }
  if (!seen.corner_covariance_px2) return e.squaredNorm() / (sigma_px * sigma_px);
  return e.dot(seen.corner_covariance_px2->inverse() * e);
}

TEST(TagPose, ExactWithoutNoise) {
  Random random(1);
  for (const CameraModel& camera :
       {testing::plain_camera(), testing::distorting_camera(), testing::fisheye_camera()}) {
    for (int trial = 0; trial < 700; ++trial) {
      const SE3 truth =
          testing::random_view(random, {.min_size_px = 15, .max_size_px = 250, .max_tilt_deg = 75});
      const auto seen = testing::see_tag(camera, truth);
      ASSERT_TRUE(seen);
      const auto pose = estimate_tag_pose(*seen, kTagSize, camera);
      ASSERT_TRUE(pose) << to_string(pose.error());
      EXPECT_THAT(pose->best.cam_T_tag, SE3Near(truth, 1e-9, 1e-9));
      EXPECT_LT(pose->best.rms_px, 1e-8);
      EXPECT_LT(pose->best.chi2, 1e-12);
      EXPECT_TRUE(!pose->other || pose->other->chi2 > pose->best.chi2);
    }
  }
}

TEST(TagPose, FisheyeTagsBeyondNinetyDegrees) {
  Random random(2);
  const CameraModel camera = testing::fisheye_camera();
  const SO3 sideways = SO3::exp({0, 1.62, 0});
  for (int trial = 0; trial < 50; ++trial) {
    const SE3 truth =
        SE3(sideways, Eigen::Vector3d::Zero()) * testing::random_view(random, {.max_off_axis = 0.05});
    const auto seen = testing::see_tag(camera, truth);
    ASSERT_TRUE(seen);
    const auto pose = estimate_tag_pose(*seen, kTagSize, camera);
    ASSERT_TRUE(pose) << to_string(pose.error());
    EXPECT_THAT(pose->best.cam_T_tag, SE3Near(truth, 1e-9, 1e-9));
  }
}

TEST(TagPose, BothSolutionsAreMinimaOfTheReprojectionError) {
  Random random(3);
  int both = 0;
  for (const CameraModel& camera : {testing::plain_camera(), testing::distorting_camera()}) {
    for (int trial = 0; trial < 150; ++trial) {
      const double sigma = 0.3;
      TagDetection seen = with_noise(see_tag(camera, testing::random_view(random)).value(), sigma, random);
      if (trial % 2 == 1) seen.corner_covariance_px2 = some_covariance(random);
      const auto pose = estimate_tag_pose(seen, kTagSize, camera, {.corner_sigma_px = sigma});
      ASSERT_TRUE(pose);
      both += pose->other.has_value() ? 1 : 0;
      for (const TagPoseSolution* s : {&pose->best, pose->other ? &*pose->other : &pose->best}) {
        EXPECT_NEAR(s->chi2, cost(camera, seen, sigma, s->cam_T_tag), 1e-5 * (1 + s->chi2));
        // A step in any direction costs more: a twentieth of a standard deviation, or of what the standard
        // deviation would be if the residuals were noise. The end of the iteration lies within that.
        const double step = 0.05 * std::sqrt(1 + s->chi2 / 2);
        const Eigen::LLT<PoseCovariance> llt(s->covariance);
        for (int k = 0; k < 12; ++k) {
          const Vector6 direction = (k % 2 == 0 ? step : -step) * Vector6::Unit(k / 2);
          const SE3 moved = SE3::exp(llt.matrixL() * direction) * s->cam_T_tag;
          EXPECT_GT(cost(camera, seen, sigma, moved), cost(camera, seen, sigma, s->cam_T_tag));
        }
      }
    }
  }
  EXPECT_GT(both, 200);
}

TEST(TagPose, TheCovarianceIsTheInverseFisherInformation) {
  Random random(4);
  for (const CameraModel& camera : {testing::plain_camera(), testing::distorting_camera()}) {
    for (int trial = 0; trial < 40; ++trial) {
      TagDetection seen = see_tag(camera, testing::random_view(random, {.min_tilt_deg = 10})).value();
      seen.corner_covariance_px2 = some_covariance(random);
      const auto pose = estimate_tag_pose(seen, kTagSize, camera);
      ASSERT_TRUE(pose);
      const auto corners_px = [&](const Vector6& xi) {
        Eigen::Matrix<double, 8, 1> px;
        for (std::size_t i = 0; i < 4; ++i) {
          px.segment<2>(static_cast<Eigen::Index>(2 * i)) =
              camera.project(SE3::exp(xi) * pose->best.cam_T_tag * testing::tag_corners().at(i)).value();
        }
        return px;
      };
      const auto J = testing::numeric_jacobian<8, 6>(corners_px, Vector6::Zero().eval(), 1e-5);
      const PoseCovariance information = J.transpose() * seen.corner_covariance_px2->inverse() * J;
      EXPECT_THAT((information * pose->best.covariance).eval(), MatrixNear(PoseCovariance::Identity(), 1e-4));
    }
  }
}

TEST(TagPose, NoiseScalesTheCovarianceAndLeavesThePose) {
  Random random(5);
  const CameraModel camera = testing::plain_camera();
  const TagDetection seen = with_noise(see_tag(camera, testing::random_view(random)).value(), 0.2, random);
  const TagPose one = estimate_tag_pose(seen, kTagSize, camera, {.corner_sigma_px = 0.1}).value();
  const TagPose three = estimate_tag_pose(seen, kTagSize, camera, {.corner_sigma_px = 0.3}).value();
  EXPECT_THAT(one.best.cam_T_tag, SE3Near(three.best.cam_T_tag, 1e-5, 1e-5));
  EXPECT_THAT((9 * one.best.covariance).eval(),
              MatrixNear(three.best.covariance, 1e-4 * three.best.covariance.norm()));
  EXPECT_NEAR(one.best.chi2, 9 * three.best.chi2, 1e-4 * one.best.chi2);
  TagDetection full = seen;
  full.corner_covariance_px2 = 0.09 * CornerCovariance::Identity();
  const TagPose as_full = estimate_tag_pose(full, kTagSize, camera).value();
  EXPECT_THAT(as_full.best.covariance, MatrixNear(three.best.covariance, 1e-9));
  EXPECT_THAT(as_full.best.cam_T_tag, SE3Near(three.best.cam_T_tag, 1e-9, 1e-9));
}

TEST(TagPose, ScalesWithTheSizeOfTheTag) {
  Random random(6);
  const CameraModel camera = testing::plain_camera();
  const TagDetection seen = with_noise(see_tag(camera, testing::random_view(random)).value(), 0.2, random);
  const TagPose one = estimate_tag_pose(seen, 1.0, camera).value();
  for (const double size : {1e-3, 10.0, 1e4}) {
    const TagPose scaled = estimate_tag_pose(seen, size, camera).value();
    EXPECT_LT((scaled.best.cam_T_tag.translation() / size - one.best.cam_T_tag.translation()).norm(), 1e-6);
    EXPECT_NEAR(scaled.best.chi2, one.best.chi2, 1e-6);
    const PoseDeviations in_units = standard_deviations(scaled.best.cam_T_tag, scaled.best.covariance);
    const PoseDeviations of_one = standard_deviations(one.best.cam_T_tag, one.best.covariance);
    EXPECT_LT((in_units.position_m / size - of_one.position_m).norm(), 1e-6);
    EXPECT_LT((in_units.rotation_rad - of_one.rotation_rad).norm(), 1e-6);
  }
}

TEST(TagPose, ACornerWithLargeVarianceHardlyCounts) {
  Random random(7);
  const CameraModel camera = testing::plain_camera();
  const SE3 truth = testing::random_view(random, {.min_tilt_deg = 30});
  TagDetection seen = see_tag(camera, truth).value();
  seen.corners_px[2] += Eigen::Vector2d(3, -2);
  seen.corner_covariance_px2 = 0.01 * CornerCovariance::Identity();
  const SE3 pulled = estimate_tag_pose(seen, kTagSize, camera).value().best.cam_T_tag;
  seen.corner_covariance_px2->block<2, 2>(4, 4) *= 1e6;
  const SE3 freed = estimate_tag_pose(seen, kTagSize, camera).value().best.cam_T_tag;
  EXPECT_LT(testing::internal::distance(truth, freed).rotation,
            0.01 * testing::internal::distance(truth, pulled).rotation);
}

TEST(TagPose, SaysWhyThereIsNoSecondSolution) {
  const CameraModel camera = testing::plain_camera();
  // Facing the camera both solutions are one …
  const SE3 frontal(SO3(), {0, 0, 1.0});
  const TagPose facing = estimate_tag_pose(see_tag(camera, frontal).value(), kTagSize, camera).value();
  EXPECT_FALSE(facing.other);
  EXPECT_EQ(facing.other_state, OtherSolution::SameMinimum);
  EXPECT_EQ(facing.ambiguity_ratio(), 0);
  EXPECT_EQ(facing.likelihood_ratio(), 0);
  // … a tag that fills the view leaves no second minimum …
  const SE3 close(SO3::exp({0.9, 0.2, 0.3}), {0, 0, 0.15});
  EXPECT_FALSE(estimate_tag_pose(see_tag(camera, close).value(), kTagSize, camera).value().other);
  // … and a small tilted one has a second solution that fits nearly as well.
  const SE3 far(SO3::exp({0.5, 0.2, 0.3}), {0.1, 0, 5.0});
  Random random(8);
  const TagPose two =
      estimate_tag_pose(with_noise(see_tag(camera, far).value(), 0.1, random), kTagSize, camera).value();
  ASSERT_TRUE(two.other);
  EXPECT_EQ(two.other_state, OtherSolution::Found);
  EXPECT_GT(two.ambiguity_ratio(), 0.1);
  EXPECT_LE(two.ambiguity_ratio(), 1);
  EXPECT_NEAR(two.likelihood_ratio(), std::exp((two.best.chi2 - two.other->chi2) / 2), 1e-15);
}

TEST(TagPose, LooksUpTheSizeById) {
  const CameraModel camera = testing::plain_camera();
  const SE3 truth(SO3::exp({0.5, 0, 0}), {0, 0, 1.0});
  const TagSizes sizes{.default_size_m = 1.0, .size_by_tag_m = {{{FamilyId::Tag36h11, 7}, kTagSize}}};
  const auto pose = estimate_tag_pose(see_tag(camera, truth, kTagSize, 7).value(), sizes, camera);
  EXPECT_THAT(pose.value().best.cam_T_tag, SE3Near(truth, 1e-9, 1e-9));
  EXPECT_FALSE(estimate_tag_pose(see_tag(camera, truth).value(), TagSizes{}, camera));
}

TEST(TagPose, SameInputSameBits) {
  Random random(10);
  const CameraModel camera = testing::distorting_camera();
  const TagDetection seen = with_noise(see_tag(camera, testing::random_view(random)).value(), 0.2, random);
  const TagPose a = estimate_tag_pose(seen, kTagSize, camera).value();
  const TagPose b = estimate_tag_pose(seen, kTagSize, camera).value();
  EXPECT_EQ(a.best.cam_T_tag, b.best.cam_T_tag);
  EXPECT_EQ(a.best.covariance, b.best.covariance);
}

// A rotation by sigma about the camera's x axis moves a tag at distance z by z sigma along y: what the
// tangent calls a pure rotation is a position to a person.
TEST(StandardDeviations, AreThoseOfThePosition) {
  PoseCovariance covariance = PoseCovariance::Zero();
  covariance(3, 3) = 0.01 * 0.01;
  const PoseDeviations d = standard_deviations(SE3(SO3::exp({0.3, 1, 2}), {0, 0, 5.0}), covariance);
  EXPECT_THAT(d.position_m, MatrixNear(Eigen::Vector3d(0, 0.05, 0), 1e-12));
  EXPECT_THAT(d.rotation_rad, MatrixNear(Eigen::Vector3d(0.01, 0, 0), 1e-12));
}

}  // namespace
}  // namespace waymark
