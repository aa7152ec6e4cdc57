// Compares analytic with numeric Jacobians; the residual is zero if the motion equals the measured one.
#include "waymark/factors/odometry_factor.hpp"

#include <gtest/gtest.h>

#include "tests/support/numeric_jacobian.hpp"
#include "tests/support/random_pose.hpp"
#include "waymark/base/random.hpp"
#include "waymark/factors/pose_factors.hpp"
#include "waymark/geometry/lie.hpp"
#include "waymark/geometry/planar.hpp"

namespace waymark {
namespace {

using testing::numeric_jacobian;
using testing::random_pose;

Eigen::Matrix3d random_whitening(Random& random) {
  Matrix6 A;
  for (double& a : A.reshaped()) a = random.normal();
  const Matrix6 covariance = A * A.transpose() + Matrix6::Identity();
  return whitening_of(Eigen::Matrix3d(covariance.topLeftCorner<3, 3>()));
}

TEST(OdometryFactor, JacobiansAgainstNumeric) {
  Random random(18);
  for (int round = 0; round < 20; ++round) {
    const SE3 a = random_pose(random, 3, 1.5);
    const SE3 b = a * lift(SE2(0.3, 0.1, 0.4)) * random_pose(random, 0.05, 0.1);
    const OdometryFactor factor{SE2(0.28, 0.12, 0.45), random_whitening(random), 0.7,
                                SE2::Tangent(0.4, -0.1, 0.6)};
    const OdometryScales scales{1.1, 0.8, -0.2, 0.1, -0.05, 0.03};
    OdometryJacobians J;
    (void)odometry_residual(factor, scales, a, b, &J);
    const auto of_a = [&](const SE3::Tangent& xi) {
      return odometry_residual(factor, scales, plus(xi, a), b);
    };
    const auto of_b = [&](const SE3::Tangent& xi) {
      return odometry_residual(factor, scales, a, plus(xi, b));
    };
    const SE3::Tangent zero = SE3::Tangent::Zero();
    EXPECT_LT((numeric_jacobian<3, 6>(of_a, zero, 1e-3) - J.a).norm(), 1e-7 * (1 + J.a.norm()));
    EXPECT_LT((numeric_jacobian<3, 6>(of_b, zero, 1e-3) - J.b).norm(), 1e-7 * (1 + J.b.norm()));
    const auto of_scales = [&](const OdometryScales::Vector& s) {
      return odometry_residual(factor, OdometryScales::of(s), a, b);
    };
    EXPECT_LT(
        (numeric_jacobian<3, OdometryScales::kCount>(of_scales, scales.vector(), 1e-3) - J.scales).norm(),
        1e-8 * (1 + J.scales.norm()));
  }
}

TEST(OdometryFactor, AMotionAsMeasuredHasNoResidual) {
  Random random(17);
  const SE3 a = random_pose(random, 3, 1);
  const SE2 motion(0.2, -0.05, 0.3);
  EXPECT_LT(odometry_residual({motion}, {}, a, a * lift(motion)).norm(), 1e-12);
  EXPECT_LT(odometry_residual({SE2::exp(motion.log() / 2)}, {2, 2}, a, a * lift(motion)).norm(), 1e-12);
  const SE2 slipped = SE2::exp({0.2, 0.05 * 0.2 * 0.3 / 0.5, 0.3});  // 0.05 s * v * yaw_rate to the left
  EXPECT_LT(odometry_residual({SE2::exp({0.2, 0, 0.3}), Eigen::Matrix3d::Identity(), 0.5}, {1, 1, 0.05, 0}, a,
                              a * lift(slipped))
                .norm(),
            1e-12);
  const SE2 earlier = SE2::exp({0.2 - 0.1 * 0.3, 0, 0.3});  // 0.1 s earlier, the speed was 0.3 m/s lower
  EXPECT_LT(odometry_residual({SE2::exp({0.2, 0, 0.3}), Eigen::Matrix3d::Identity(), 0.5, {0.3, 0, 0}},
                              {1, 1, 0, 0.1}, a, a * lift(earlier))
                .norm(),
            1e-12);
  const SE2 turned_earlier =
      SE2::exp({0.2, 0, 0.3 - 0.02 * 0.5 - 0.01 * 0.5});  // turns measured 0.02 s early, plus a bias
  EXPECT_LT(odometry_residual({SE2::exp({0.2, 0, 0.3}), Eigen::Matrix3d::Identity(), 0.5, {0, 0, 0.5}},
                              {1, 1, 0, 0, 0.02, 0.01}, a, a * lift(turned_earlier))
                .norm(),
            1e-12);
}

}  // namespace
}  // namespace waymark
