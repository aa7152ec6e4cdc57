#include "tests/support/numeric_jacobian.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "tests/support/geometry_matchers.hpp"

namespace waymark::testing {
namespace {

TEST(NumericJacobian, OfAFunctionWhoseDerivativeIsKnown) {
  const Eigen::Vector2d x(0.7, -1.3);
  const auto f = [](const Eigen::Vector2d& v) {
    return Eigen::Vector3d(std::sin(v[0]) * v[1], std::exp(v[0] * v[1]), v[0] / v[1]);
  };
  Eigen::Matrix<double, 3, 2> exact;
  const double e = std::exp(x[0] * x[1]);
  exact << std::cos(x[0]) * x[1], std::sin(x[0]), e * x[1], e * x[0], 1 / x[1], -x[0] / (x[1] * x[1]);
  EXPECT_THAT((numeric_jacobian<3, 2>(f, x)), MatrixNear(exact, 1e-12));
}

TEST(NumericJacobian, IsExactForPolynomialsOfDegreeSix) {
  const auto f = [](double t) {
    return Eigen::Matrix<double, 1, 1>(1 + 3 * t + std::pow(t, 5) + std::pow(t, 6));
  };
  EXPECT_NEAR(numeric_derivative(f, 0.5)(0, 0), 3.0, 1e-14);
}

TEST(NumericJacobian, OfAGroupValuedArgumentByItsTangent) {
  const SE3 a_T_b(SO3::exp({0.1, 0.2, 0.3}), {1, 2, 3});
  const Eigen::Vector3d b_p(0.3, 0.2, 0.1);
  const auto moved = [&](const SE3::Tangent& xi) { return Eigen::Vector3d(SE3::exp(xi) * a_T_b * b_p); };
  Eigen::Matrix<double, 3, 6> J_p_T;
  const Eigen::Vector3d a_p = a_T_b.act(b_p, &J_p_T);
  EXPECT_THAT((numeric_jacobian<3, 6>(moved, SE3::Tangent::Zero().eval())), MatrixNear(J_p_T, 1e-12));
  EXPECT_THAT(a_p, MatrixNear(moved(SE3::Tangent::Zero()), 0.0));
}

}  // namespace
}  // namespace waymark::testing
