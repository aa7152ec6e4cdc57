// Factors for poses and for points on tags: analytic and numeric Jacobians, and zero residuals for values
// that equal the measurements.
#include "waymark/factors/pose_factors.hpp"

#include <gtest/gtest.h>

#include "tests/support/numeric_jacobian.hpp"
#include "tests/support/random_pose.hpp"
#include "waymark/base/random.hpp"
#include "waymark/geometry/lie.hpp"
#include "waymark/geometry/planar.hpp"

namespace waymark {
namespace {

using testing::numeric_jacobian;
using testing::random_pose;

Matrix6 random_covariance(Random& random) {
  Matrix6 A;
  for (double& a : A.reshaped()) a = random.normal();
  return A * A.transpose() + Matrix6::Identity();
}

/// Compares the Jacobians J_r_X of a residual that depends on two poses with numeric ones.
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

TEST(PoseFactors, PosesAsMeasuredHaveNoResidual) {
  Random random(17);
  const SE3 a = random_pose(random, 3, 1);
  const SE2 motion(0.2, -0.05, 0.3);
  EXPECT_LT(on_floor_residual({}, a, a * lift(motion)).norm(), 1e-9);
  EXPECT_NEAR(on_floor_residual({.height_sigma_m = 0.01}, {}, SE3({}, {1, 2, 0.03}))[0], 3, 1e-12);
  EXPECT_LT(pose_prior_residual({a}, a).norm(), 1e-15);
}

SE3 uniform_pose(Random& random) {
  SE3::Tangent xi;
  for (int i = 0; i < 6; ++i) xi[i] = random.uniform(-1, 1);
  return SE3::exp(xi);
}

TEST(PointFactors, JacobiansAgainstNumeric) {
  Random random(1);
  for (int k = 0; k < 20; ++k) {
    const SE3 body = uniform_pose(random);
    const SE3 tag = uniform_pose(random);
    const Eigen::Vector3d p(random.uniform(-1, 1), random.uniform(-1, 1), 0);
    const TagPoint point = tag_point(body, tag, p);
    const SE3::Tangent zero = SE3::Tangent::Zero();
    const auto of_body = [&](const SE3::Tangent& xi) { return tag_point(plus(xi, body), tag, p).map_p; };
    const auto of_tag = [&](const SE3::Tangent& xi) { return tag_point(body, plus(xi, tag), p).map_p; };
    EXPECT_LT((testing::numeric_jacobian<3, 6>(of_body, zero, 1e-3) - point.J_p_body).norm(), 1e-7);
    EXPECT_LT((testing::numeric_jacobian<3, 6>(of_tag, zero, 1e-3) - point.J_p_tag).norm(), 1e-7);
    const Eigen::Vector3d other(3, random.uniform(-1, 1), 1);
    Eigen::RowVector3d J;
    const double r = point_distance_residual(2, 0.1, point.map_p, other, &J);
    EXPECT_NEAR(r, ((point.map_p - other).norm() - 2) / 0.1, 1e-12);
    const auto of_point = [&](const Eigen::Vector3d& d) {
      return Eigen::Matrix<double, 1, 1>(point_distance_residual(2, 0.1, point.map_p + d, other));
    };
    EXPECT_LT((testing::numeric_jacobian<1, 3>(of_point, Eigen::Vector3d::Zero().eval(), 1e-3) - J).norm(),
              1e-6);
  }
}

TEST(PointFactors, DirectionIsZeroAlongTheAxisWithNumericJacobians) {
  Random random(2);
  for (int k = 0; k < 20; ++k) {
    const SE3 body = uniform_pose(random);
    const SE3 tag = uniform_pose(random);
    DirectionFactor factor{.map_direction = Eigen::Vector3d(0.2, -0.3, 0.9).normalized(), .sigma_rad = 0.1};
    Matrix26 J_body;
    Matrix26 J_tag;
    const Eigen::Vector2d r = direction_residual(factor, body, tag, &J_body, &J_tag);
    const Eigen::Vector3d axis = body.rotation() * (tag.rotation() * factor.tag_axis);
    EXPECT_NEAR(r.norm(), axis.cross(factor.map_direction).norm() / factor.sigma_rad, 1e-9);
    const SE3::Tangent zero = SE3::Tangent::Zero();
    const auto of_body = [&](const SE3::Tangent& xi) {
      return direction_residual(factor, plus(xi, body), tag);
    };
    const auto of_tag = [&](const SE3::Tangent& xi) {
      return direction_residual(factor, body, plus(xi, tag));
    };
    EXPECT_LT((testing::numeric_jacobian<2, 6>(of_body, zero, 1e-3) - J_body).norm(), 1e-6);
    EXPECT_LT((testing::numeric_jacobian<2, 6>(of_tag, zero, 1e-3) - J_tag).norm(), 1e-6);
  }
}

TEST(PointFactors, CoincidentPointsGiveNoNan) {
  Eigen::RowVector3d J;
  EXPECT_DOUBLE_EQ(point_distance_residual(0, 1, Eigen::Vector3d::Ones(), Eigen::Vector3d::Ones(), &J), 0);
  EXPECT_TRUE(J.allFinite());
}

}  // namespace
}  // namespace waymark
