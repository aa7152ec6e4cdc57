// A robot in the plane among points: analytic and numeric Jacobians, and cases with zero residual.
#include "waymark/factors/planar_factors.hpp"

#include <numbers>

#include <gtest/gtest.h>

#include "tests/support/numeric_jacobian.hpp"
#include "waymark/base/random.hpp"

namespace waymark {
namespace {

using testing::numeric_jacobian;

Eigen::Vector3d random_pose(Random& random) {
  return {random.uniform(-3, 3), random.uniform(-3, 3), random.uniform(-7, 7)};
}

TEST(PlanarFactors, PointJacobiansAgainstNumeric) {
  Random random(21);
  for (int round = 0; round < 20; ++round) {
    PlanarPointFactor factor{{random.normal(), random.normal()}};
    for (double& w : factor.whitening.reshaped()) w = random.normal();
    const Eigen::Vector3d base = random_pose(random);
    const Eigen::Vector2d point(random.uniform(-3, 3), random.uniform(-3, 3));
    const Eigen::Vector3d mounting = 0.2 * random_pose(random);
    PlanarPointJacobians J;
    (void)planar_point_residual(factor, base, point, mounting, &J);
    const auto of_base = [&](const Eigen::Vector3d& x) {
      return planar_point_residual(factor, x, point, mounting);
    };
    const auto of_point = [&](const Eigen::Vector2d& p) {
      return planar_point_residual(factor, base, p, mounting);
    };
    const auto of_mounting = [&](const Eigen::Vector3d& m) {
      return planar_point_residual(factor, base, point, m);
    };
    EXPECT_LT((numeric_jacobian<2, 3>(of_base, base) - J.base).norm(), 1e-8 * (1 + J.base.norm()));
    EXPECT_LT((numeric_jacobian<2, 2>(of_point, point) - J.point).norm(), 1e-8 * (1 + J.point.norm()));
    EXPECT_LT((numeric_jacobian<2, 3>(of_mounting, mounting) - J.mounting).norm(),
              1e-8 * (1 + J.mounting.norm()));
  }
}

TEST(PlanarFactors, MotionJacobiansAgainstNumeric) {
  Random random(22);
  for (int round = 0; round < 20; ++round) {
    // Small, large and zero turns.
    const double turn = round == 0 ? 0 : random.uniform(-2.5, 2.5);
    const PlanarMotionFactor factor{{random.normal(), 0.2 * random.normal(), turn}, {10, 20, 50}};
    const Eigen::Vector3d a = random_pose(random);
    const Eigen::Vector3d b = a + 0.5 * random_pose(random);
    const Eigen::Vector2d scales(random.uniform(0.8, 1.2), random.uniform(0.5, 1.5));
    PlanarMotionJacobians J;
    (void)planar_motion_residual(factor, a, b, scales, &J);
    const auto of_a = [&](const Eigen::Vector3d& x) { return planar_motion_residual(factor, x, b, scales); };
    const auto of_b = [&](const Eigen::Vector3d& x) { return planar_motion_residual(factor, a, x, scales); };
    const auto of_scales = [&](const Eigen::Vector2d& s) { return planar_motion_residual(factor, a, b, s); };
    EXPECT_LT((numeric_jacobian<3, 3>(of_a, a) - J.a).norm(), 1e-8 * J.a.norm());
    EXPECT_LT((numeric_jacobian<3, 3>(of_b, b) - J.b).norm(), 1e-8 * J.b.norm());
    EXPECT_LT((numeric_jacobian<3, 2>(of_scales, scales) - J.scales).norm(), 1e-8 * (1 + J.scales.norm()));
  }
}

TEST(PlanarFactors, ValuesAsMeasuredHaveNoResidual) {
  Random random(23);
  for (int round = 0; round < 20; ++round) {
    const Eigen::Vector3d a = random_pose(random);
    const SE2 map_X_a(a.x(), a.y(), a.z());
    const SE2::Tangent twist(0.4, -0.1, random.uniform(-2, 2));
    const SE2 map_X_b = map_X_a * SE2::exp(twist);
    const Eigen::Vector3d b(map_X_b.x(), map_X_b.y(), a.z() + twist.z());
    EXPECT_LT(planar_motion_residual({twist / 2}, a, b, {2, 2}).norm(), 1e-12);
    const Eigen::Vector2d map_p(random.normal(), random.normal());
    const Eigen::Vector3d mounting(0.03, -0.02, 0.1);
    const Eigen::Vector2d by_sensor =
        SE2(mounting.x(), mounting.y(), mounting.z()).inverse() * (map_X_a.inverse() * map_p);
    EXPECT_LT(planar_point_residual({by_sensor}, a, map_p, mounting).norm(), 1e-12);
  }
}

TEST(PlanarFactors, MovingEverythingTogetherChangesNothing) {
  Random random(24);
  const PlanarPointFactor seen{{1.2, 0.3}};
  const PlanarMotionFactor gone{{0.3, 0, 0.2}};
  const Eigen::Vector3d a(1, 2, 0.5);
  const Eigen::Vector3d b(1.2, 2.3, 0.8);
  const Eigen::Vector2d p(2, 3);
  for (int round = 0; round < 20; ++round) {
    const Eigen::Vector3d by = random_pose(random);
    const SE2 move(by.x(), by.y(), by.z());
    const auto moved = [&](const Eigen::Vector3d& x) {
      const SE2 X = move * SE2(x.x(), x.y(), x.z());
      return Eigen::Vector3d(X.x(), X.y(), x.z() + by.z());
    };
    const Eigen::Vector3d mounting(0.1, 0, 0.05);
    EXPECT_LT((planar_point_residual(seen, moved(a), move * p, mounting) -
               planar_point_residual(seen, a, p, mounting))
                  .norm(),
              1e-12);
    EXPECT_LT((planar_motion_residual(gone, moved(a), moved(b), {1.1, 0.9}) -
               planar_motion_residual(gone, a, b, {1.1, 0.9}))
                  .norm(),
              1e-12);
  }
}

TEST(PlanarFactors, FullTurnsAreNotWrapped) {
  const PlanarMotionFactor factor{{0.1, 0, 0.2}};
  const Eigen::Vector3d a(0, 0, 3.1);
  const SE2 end = SE2(0, 0, 3.1) * SE2::exp(factor.twist);
  const Eigen::Vector3d b(end.x(), end.y(), 3.3);
  EXPECT_LT(planar_motion_residual(factor, a, b, {1, 1}).norm(), 1e-12);
  const Eigen::Vector3d once_more = b + 2 * std::numbers::pi * Eigen::Vector3d::UnitZ();
  EXPECT_NEAR(planar_motion_residual(factor, a, once_more, {1, 1}).z(), 2 * std::numbers::pi, 1e-12);
}

}  // namespace
}  // namespace waymark
