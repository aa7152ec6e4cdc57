// Every Jacobian against a numeric one; whitening; what a factor must not notice.
#include <gtest/gtest.h>

#include "tests/support/numeric_jacobian.hpp"
#include "tests/support/random_pose.hpp"
#include "waymark/base/random.hpp"
#include "waymark/factors/corner_factor.hpp"
#include "waymark/factors/corner_intrinsics.hpp"
#include "waymark/factors/odometry_factor.hpp"
#include "waymark/factors/pose_factors.hpp"
#include "waymark/geometry/lie.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/samples/visibility.hpp"

namespace waymark {
namespace {

using testing::random_pose;

using testing::numeric_jacobian;

Matrix6 random_covariance(Random& random) {
  Matrix6 A;
  for (double& a : A.reshaped()) a = random.normal();
  return A * A.transpose() + Matrix6::Identity();
}

CameraModel lens(bool fisheye) {
  if (fisheye)
    return CameraModel::make(Equidistant{400, 410, 320, 240, {-0.01, 0.02, -0.005, 0.001}}, 640, 480).value();
  PinholeRadtan radtan{.fx = 442, .fy = 444, .cx = 323, .cy = 247, .coefficients = 5};
  radtan.k = {0.05, -0.08, 1e-3, -2e-3, 0.01, 0, 0, 0};
  return CameraModel::make(radtan, 640, 480).value();
}

/// A camera on a rig somewhere in the map and a tag on a body before it.
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
    CornerJacobians J;
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
  EXPECT_NEAR(chi2 / kDraws, 8, 4 * 4 / std::sqrt(kDraws));  // four deviations of a mean of chi-square, 8 dof
}

TEST(CornerFactor, NothingBehindTheCamera) {
  Random random(14);
  const CameraModel camera = lens(false);
  Scene scene = random_scene(random, camera);
  scene.poses.rig_T_cam = scene.poses.rig_T_cam * SE3(SO3::exp({0, 3.1, 0}), Eigen::Vector3d::Zero());
  EXPECT_FALSE(corner_residual(scene.factor, camera, scene.poses));
}

TEST(CornerFactor, RefusesWhatIsNoMeasurement) {
  TagDetection detection;
  EXPECT_FALSE(corner_factor(detection, -1, 0.2));
  detection.corner_covariance_px2 = -CornerCovariance::Identity();
  EXPECT_FALSE(corner_factor(detection, 0.1, 0.2));
  detection.corner_covariance_px2.reset();
  detection.corners_px[2].x() = std::nan("");
  EXPECT_FALSE(corner_factor(detection, 0.1, 0.2));
}

/// J_r_X of a residual of two poses against numeric ones.
template <int N, class Residual, class Jacobian>
void expect_jacobians(const Residual& residual, const SE3& a, const SE3& b, const Jacobian& J_a,
                      const Jacobian& J_b) {
  const auto of_a = [&](const SE3::Tangent& xi) { return residual(plus(xi, a), b); };
  const auto of_b = [&](const SE3::Tangent& xi) { return residual(a, plus(xi, b)); };
  const SE3::Tangent zero = SE3::Tangent::Zero();
  EXPECT_LT((numeric_jacobian<N, 6>(of_a, zero, 1e-3) - J_a).norm(), 1e-7 * (1 + J_a.norm()));
  EXPECT_LT((numeric_jacobian<N, 6>(of_b, zero, 1e-3) - J_b).norm(), 1e-7 * (1 + J_b.norm()));
}

TEST(PoseFactors, JacobiansAgainstNumeric) {
  Random random(15);
  for (int round = 0; round < 20; ++round) {
    const SE3 a = random_pose(random, 3, 1.5);
    const SE3 b = random_pose(random, 3, 1.5);
    const RelativePoseFactor relative{a.inverse() * b * random_pose(random, 0.1, 0.2),
                                      random_pose(random, 1, 1), whitening_of(random_covariance(random))};
    Matrix6 J_a;
    Matrix6 J_b;
    (void)relative_pose_residual(relative, a, b, &J_a, &J_b);
    expect_jacobians<6>([&](const SE3& x, const SE3& y) { return relative_pose_residual(relative, x, y); }, a,
                        b, J_a, J_b);
    const SE3 near = a * lift(SE2(0.3, 0.1, 0.4)) * random_pose(random, 0.05, 0.1);
    Matrix36 K_a;
    Matrix36 K_b;
    (void)on_floor_residual({}, a, near, &K_a, &K_b);
    expect_jacobians<3>([&](const SE3& x, const SE3& y) { return on_floor_residual({}, x, y); }, a, near, K_a,
                        K_b);
    const PosePairPriorFactor pair{random_pose(random, 0.2, 0.3) * a, random_pose(random, 0.2, 0.3) * b,
                                   random_covariance(random), whitening_of(random_covariance(random))};
    (void)pose_pair_prior_residual(pair, a, b, &J_a, &J_b);
    expect_jacobians<6>([&](const SE3& x, const SE3& y) { return pose_pair_prior_residual(pair, x, y); }, a,
                        b, J_a, J_b);
    const PosePriorFactor prior{random_pose(random, 0.5, 0.8) * a, whitening_of(random_covariance(random))};
    (void)pose_prior_residual(prior, a, &J_a);
    const auto of_a = [&](const SE3::Tangent& xi) { return pose_prior_residual(prior, plus(xi, a)); };
    EXPECT_LT((numeric_jacobian<6, 6>(of_a, SE3::Tangent::Zero().eval(), 1e-3) - J_a).norm(),
              1e-7 * (1 + J_a.norm()));
  }
}

TEST(OdometryFactor, JacobiansAgainstNumeric) {
  Random random(18);
  for (int round = 0; round < 20; ++round) {
    const SE3 a = random_pose(random, 3, 1.5);
    const SE3 b = a * lift(SE2(0.3, 0.1, 0.4)) * random_pose(random, 0.05, 0.1);
    const OdometryFactor factor{
        SE2(0.28, 0.12, 0.45), whitening_of(Eigen::Matrix3d(random_covariance(random).topLeftCorner<3, 3>())),
        0.7, SE2::Tangent(0.4, -0.1, 0.6)};
    const OdometryScales scales{1.1, 0.8, -0.2, 0.1, -0.05, 0.03};
    OdometryJacobians J;
    (void)odometry_residual(factor, scales, a, b, &J);
    expect_jacobians<3>([&](const SE3& x, const SE3& y) { return odometry_residual(factor, scales, x, y); },
                        a, b, J.a, J.b);
    const auto of_scales = [&](const OdometryScales::Vector& s) {
      return odometry_residual(factor, OdometryScales::of(s), a, b);
    };
    EXPECT_LT(
        (numeric_jacobian<3, OdometryScales::kCount>(of_scales, scales.vector(), 1e-3) - J.scales).norm(),
        1e-8 * (1 + J.scales.norm()));
  }
}

TEST(PoseFactors, DistanceAndCoordinateJacobians) {
  Random random(16);
  using Row = Eigen::Matrix<double, 1, 6>;
  using One = Eigen::Matrix<double, 1, 1>;
  for (int round = 0; round < 20; ++round) {
    const SE3 a = random_pose(random, 3, 1.5);
    const SE3 b = random_pose(random, 3, 1.5);
    Row J_a;
    Row J_b;
    (void)distance_residual({1.0, 0.1}, a, b, &J_a, &J_b);
    expect_jacobians<1>(
        [](const SE3& x, const SE3& y) {
          return One(distance_residual({1.0, 0.1}, x, y));
        },
        a, b, J_a, J_b);
    const CoordinateFactor coordinate{Eigen::Vector3d(1, 2, -2) / 3, 0.5, 0.02};
    (void)coordinate_residual(coordinate, a, &J_a);
    const auto of_a = [&](const SE3::Tangent& xi) {
      return One(coordinate_residual(coordinate, plus(xi, a)));
    };
    EXPECT_LT((numeric_jacobian<1, 6>(of_a, SE3::Tangent::Zero().eval(), 1e-3) - J_a).norm(),
              1e-7 * (1 + J_a.norm()));
  }
}

TEST(PoseFactors, WhatIsAsMeasuredLeavesNothing) {
  Random random(17);
  const SE3 a = random_pose(random, 3, 1);
  const SE2 motion(0.2, -0.05, 0.3);
  EXPECT_LT(odometry_residual({motion}, {}, a, a * lift(motion)).norm(), 1e-12);
  EXPECT_LT(odometry_residual({SE2::exp(motion.log() / 2)}, {2, 2}, a, a * lift(motion)).norm(), 1e-12);
  const SE2 slipped = SE2::exp({0.2, 0.05 * 0.2 * 0.3 / 0.5, 0.3});  // to the left by 0.05 s v yaw_rate
  EXPECT_LT(odometry_residual({SE2::exp({0.2, 0, 0.3}), Eigen::Matrix3d::Identity(), 0.5}, {1, 1, 0.05, 0}, a,
                              a * lift(slipped))
                .norm(),
            1e-12);
  const SE2 earlier = SE2::exp({0.2 - 0.1 * 0.3, 0, 0.3});  // 0.1 s earlier it was slower by 0.3 m/s
  EXPECT_LT(odometry_residual({SE2::exp({0.2, 0, 0.3}), Eigen::Matrix3d::Identity(), 0.5, {0.3, 0, 0}},
                              {1, 1, 0, 0.1}, a, a * lift(earlier))
                .norm(),
            1e-12);
  const SE2 turned_earlier =
      SE2::exp({0.2, 0, 0.3 - 0.02 * 0.5 - 0.01 * 0.5});  // told 0.02 s ahead, and a bias
  EXPECT_LT(odometry_residual({SE2::exp({0.2, 0, 0.3}), Eigen::Matrix3d::Identity(), 0.5, {0, 0, 0.5}},
                              {1, 1, 0, 0, 0.02, 0.01}, a, a * lift(turned_earlier))
                .norm(),
            1e-12);
  EXPECT_LT(on_floor_residual({}, a, a * lift(motion)).norm(), 1e-9);
  EXPECT_NEAR(on_floor_residual({.height_sigma_m = 0.01}, {}, SE3({}, {1, 2, 0.03}))[0], 3, 1e-12);
  EXPECT_LT(pose_prior_residual({a}, a).norm(), 1e-15);
}

}  // namespace
}  // namespace waymark
