// Points of tags on bodies: Jacobians against numeric ones.
#include "waymark/factors/point_factors.hpp"

#include <gtest/gtest.h>

#include "tests/support/numeric_jacobian.hpp"
#include "waymark/base/random.hpp"
#include "waymark/geometry/lie.hpp"

namespace waymark {
namespace {

SE3 random_pose(Random& random) {
  SE3::Tangent xi;
  for (int i = 0; i < 6; ++i) xi[i] = random.uniform(-1, 1);
  return SE3::exp(xi);
}

TEST(PointFactors, JacobiansAgainstNumeric) {
  Random random(1);
  for (int k = 0; k < 20; ++k) {
    const SE3 body = random_pose(random);
    const SE3 tag = random_pose(random);
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

TEST(PointFactors, DirectionIsZeroAlongTheAxisAndItsJacobiansAreThoseOfNumbers) {
  Random random(2);
  for (int k = 0; k < 20; ++k) {
    const SE3 body = random_pose(random);
    const SE3 tag = random_pose(random);
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

TEST(PointFactors, PointsThatFallTogetherGiveNoNan) {
  Eigen::RowVector3d J;
  EXPECT_DOUBLE_EQ(point_distance_residual(0, 1, Eigen::Vector3d::Ones(), Eigen::Vector3d::Ones(), &J), 0);
  EXPECT_TRUE(J.allFinite());
}

}  // namespace
}  // namespace waymark
