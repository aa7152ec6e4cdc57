// Analytic and numeric Jacobians, whitening, and invariance under a common motion.
#include "waymark/factors/corner_factor.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "tests/support/numeric_jacobian.hpp"
#include "tests/support/random_pose.hpp"
#include "waymark/base/random.hpp"
#include "waymark/geometry/lie.hpp"
#include "waymark/samples/visibility.hpp"

namespace waymark {
namespace {

using testing::numeric_jacobian;
using testing::random_pose;

CameraModel lens(bool fisheye) {
  if (fisheye)
    return CameraModel::make(Equidistant{400, 410, 320, 240, {-0.01, 0.02, -0.005, 0.001}}, 640, 480).value();
  PinholeRadtan radtan{.fx = 442, .fy = 444, .cx = 323, .cy = 247, .coefficients = 5};
  radtan.k = {0.05, -0.08, 1e-3, -2e-3, 0.01, 0, 0, 0};
  return CameraModel::make(radtan, 640, 480).value();
}

/// A camera on a rig in the map and a tag on a body in front of it.
struct Scene {
  CornerPoses poses{};
  CornerFactor factor{};
};

Scene random_scene(Random& random, const CameraModel& camera) {
  Scene scene;
  scene.poses.map_T_rig = random_pose(random, 5, 2);
  scene.poses.rig_T_cam = random_pose(random, 0.5, 1);
  scene.poses.map_T_body = random_pose(random, 5, 2);
  const SE3 cam_T_tag = SE3({}, {0.1, -0.2, 1.5}) * random_pose(random, 0.2, 0.6);
  scene.poses.body_T_tag =
      scene.poses.map_T_body.inverse() * scene.poses.map_T_rig * scene.poses.rig_T_cam * cam_T_tag;
  TagDetection detection;
  const auto corners = tag_corners(0.16);
  for (std::size_t i = 0; i < 4; ++i)
    detection.corners_px[i] =
        *camera.project(cam_T_tag * corners[i]) + Eigen::Vector2d(random.normal(), random.normal());
  CornerCovariance A;
  for (double& a : A.reshaped()) a = 0.1 * random.normal();
  detection.corner_covariance_px2 = A * A.transpose() + 0.04 * CornerCovariance::Identity();
  scene.factor = corner_factor(detection, 0.16, 0.2).value();
  return scene;
}

class CornerFactorOf : public ::testing::TestWithParam<bool> {};
INSTANTIATE_TEST_SUITE_P(Lenses, CornerFactorOf, ::testing::Bool());

TEST_P(CornerFactorOf, JacobiansAgainstNumeric) {
  const CameraModel camera = lens(GetParam());
  Random random(11);
  for (int round = 0; round < 20; ++round) {
    const Scene scene = random_scene(random, camera);
    CornerJacobians J{.wants_size = true};
    ASSERT_TRUE(corner_residual(scene.factor, camera, scene.poses, &J));
    const auto expect = [&](SE3 CornerPoses::*member, const Eigen::Matrix<double, 8, 6>& analytic) {
      const auto moved = [&](const SE3::Tangent& xi) {
        CornerPoses poses = scene.poses;
        poses.*member = plus(xi, poses.*member);
        return *corner_residual(scene.factor, camera, poses);
      };
      const auto numeric = numeric_jacobian<8, 6>(moved, SE3::Tangent::Zero().eval(), 1e-3);
      EXPECT_LT((numeric - analytic).norm(), 1e-6 * analytic.norm());
    };
    expect(&CornerPoses::map_T_rig, J.rig);
    expect(&CornerPoses::rig_T_cam, J.cam);
    expect(&CornerPoses::map_T_body, J.body);
    expect(&CornerPoses::body_T_tag, J.tag);
    const auto resized = [&](const Eigen::Matrix<double, 1, 1>& log_scale) {
      CornerPoses poses = scene.poses;
      poses.size_scale = std::exp(log_scale[0]);
      return *corner_residual(scene.factor, camera, poses);
    };
    const auto numeric = numeric_jacobian<8, 1>(resized, Eigen::Matrix<double, 1, 1>::Zero().eval(), 1e-3);
    EXPECT_LT((numeric - J.size).norm(), 1e-6 * J.size.norm());
  }
}

TEST_P(CornerFactorOf, JacobianForTheIntrinsicsAgainstNumeric) {
  const CameraModel camera = lens(GetParam());
  const Eigen::VectorXd numbers = intrinsics_of(camera);
  Random random(19);
  for (int round = 0; round < 20; ++round) {
    const Scene scene = random_scene(random, camera);
    const auto J = corner_intrinsics_jacobian(scene.factor, camera, scene.poses);
    ASSERT_TRUE(J);
    for (Eigen::Index i = 0; i < numbers.size(); ++i) {
      const auto along = [&](double step) {
        Eigen::VectorXd moved = numbers;
        moved[i] += step;
        return Eigen::Matrix<double, 8, 1>(
            *corner_residual(scene.factor, *with_intrinsics(camera, moved), scene.poses));
      };
      EXPECT_LT((testing::numeric_derivative(along, 1e-3) - J->col(i)).norm(), 1e-6 * (1 + J->col(i).norm()));
    }
  }
}

TEST_P(CornerFactorOf, MovingEverythingTogetherChangesNothing) {
  const CameraModel camera = lens(GetParam());
  Random random(12);
  Scene scene = random_scene(random, camera);
  const auto before = *corner_residual(scene.factor, camera, scene.poses);
  const SE3 move = random_pose(random, 10, 3);
  scene.poses.map_T_rig = move * scene.poses.map_T_rig;
  scene.poses.map_T_body = move * scene.poses.map_T_body;
  EXPECT_LT((*corner_residual(scene.factor, camera, scene.poses) - before).norm(), 1e-9);
}

TEST(CornerFactor, ResidualHasUnitVarianceUnderItsOwnNoise) {
  const CameraModel camera = lens(false);
  Random random(13);
  Scene scene = random_scene(random, camera);
  const CornerCovariance L = scene.factor.whitening.inverse();
  CornerFactor truth = scene.factor;
  const auto r0 = *corner_residual(scene.factor, camera, scene.poses);
  const Eigen::Matrix<double, 8, 1> offset = L * r0;
  for (std::size_t i = 0; i < 4; ++i)
    truth.corners_px[i] += offset.segment<2>(2 * static_cast<Eigen::Index>(i));
  double chi2 = 0;
  constexpr int kDraws = 4000;
  for (int k = 0; k < kDraws; ++k) {
    Eigen::Matrix<double, 8, 1> n;
    for (double& x : n) x = random.normal();
    const Eigen::Matrix<double, 8, 1> noise = L * n;
    CornerFactor noisy = truth;
    for (std::size_t i = 0; i < 4; ++i)
      noisy.corners_px[i] += noise.segment<2>(2 * static_cast<Eigen::Index>(i));
    chi2 += corner_residual(noisy, camera, scene.poses)->squaredNorm();
  }
  EXPECT_NEAR(chi2 / kDraws, 8,
              4 * 4 / std::sqrt(kDraws));  // 4 sigma for the mean of chi-square with 8 dof
}

TEST(CornerFactor, HasNoResidualBehindTheCamera) {
  Random random(14);
  const CameraModel camera = lens(false);
  Scene scene = random_scene(random, camera);
  scene.poses.rig_T_cam = scene.poses.rig_T_cam * SE3(SO3::exp({0, 3.1, 0}), Eigen::Vector3d::Zero());
  EXPECT_FALSE(corner_residual(scene.factor, camera, scene.poses));
}

TEST(CornerFactor, RejectsInvalidMeasurements) {
  TagDetection detection;
  EXPECT_FALSE(corner_factor(detection, -1, 0.2));
  EXPECT_TRUE(corner_factor(detection, 0.1, 0.2));
  detection.corner_state = CornerState::Unreliable;
  EXPECT_FALSE(corner_factor(detection, 0.1, 0.2));
  detection.corner_state = CornerState::Measured;
  detection.corner_covariance_px2 = -CornerCovariance::Identity();
  EXPECT_FALSE(corner_factor(detection, 0.1, 0.2));
  detection.corner_covariance_px2.reset();
  detection.corners_px[2].x() = std::nan("");
  EXPECT_FALSE(corner_factor(detection, 0.1, 0.2));
}

}  // namespace
}  // namespace waymark
