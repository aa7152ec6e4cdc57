// Every analytic Jacobian against a numeric one, and the relations among them.
#include <gtest/gtest.h>

#include "tests/support/geometry_matchers.hpp"
#include "tests/support/geometry_samples.hpp"
#include "tests/support/numeric_jacobian.hpp"
#include "waymark/geometry/lie.hpp"
#include "waymark/geometry/se2.hpp"
#include "waymark/geometry/se23.hpp"
#include "waymark/geometry/se3.hpp"
#include "waymark/geometry/so2.hpp"
#include "waymark/geometry/so3.hpp"

namespace waymark {
namespace {

using testing::critical_tangents;
using testing::MatrixNear;
using testing::random_element;

/// d(result) / d(argument) of f: G -> G at X, both perturbed on the left.
template <class G, class F>
typename G::Jacobian numeric_left(const F& f, const G& X) {
  const G Z = f(X);
  const auto moved = [&](const typename G::Tangent& xi) { return minus(f(plus(xi, X)), Z); };
  return testing::numeric_jacobian<G::kDof, G::kDof>(moved, G::Tangent::Zero().eval());
}

constexpr double kTolerance = 5e-11;  // of the numeric ones, with translations of metres

template <class G>
class LieJacobians : public ::testing::Test {
 public:
  Random random{11};
};

using Groups = ::testing::Types<SO2, SE2, SO3, SE3, SE23>;
TYPED_TEST_SUITE(LieJacobians, Groups);

TYPED_TEST(LieJacobians, OfExpAgainstNumeric) {
  using G = TypeParam;
  for (const auto& xi : critical_tangents<G>(12)) {
    const G inverse_X = G::exp(xi).inverse();
    const auto numeric = testing::numeric_jacobian<G::kDof, G::kDof>(
        [&](const typename G::Tangent& moved) { return (G::exp(moved) * inverse_X).log(); }, xi);
    EXPECT_THAT(G::left_jacobian(xi), MatrixNear(numeric, 2e-12 * (1 + xi.norm()))) << xi.transpose();
    const auto right = testing::numeric_jacobian<G::kDof, G::kDof>(
        [&](const typename G::Tangent& moved) { return (inverse_X * G::exp(moved)).log(); }, xi);
    EXPECT_THAT(G::right_jacobian(xi), MatrixNear(right, 2e-12 * (1 + xi.norm()))) << xi.transpose();
  }
}

TYPED_TEST(LieJacobians, InverseOnesAreInverses) {
  using G = TypeParam;
  const typename G::Jacobian identity = G::Jacobian::Identity();
  for (const auto& xi : critical_tangents<G>(13)) {
    const double tolerance = 2e-15 * (1 + xi.squaredNorm());
    EXPECT_THAT((G::left_jacobian(xi) * G::left_jacobian_inverse(xi)).eval(),
                MatrixNear(identity, tolerance));
    EXPECT_THAT((G::right_jacobian_inverse(xi) * G::right_jacobian(xi)).eval(),
                MatrixNear(identity, tolerance));
  }
}

TYPED_TEST(LieJacobians, LeftAndRightAreTheSameUpToSignAndAdjoint) {
  using G = TypeParam;
  for (const auto& xi : critical_tangents<G>(14)) {
    const auto left = G::left_jacobian(xi);
    const auto right = G::right_jacobian(xi);
    EXPECT_EQ(right, G::left_jacobian(-xi));
    EXPECT_EQ(G::right_jacobian_inverse(xi), G::left_jacobian_inverse(-xi));
    EXPECT_THAT((G::exp(xi).adjoint() * right).eval(), MatrixNear(left, 1e-15 * (1 + xi.squaredNorm())));
    // Both leave the tangent itself alone: it commutes with itself.
    EXPECT_THAT((left * xi).eval(), MatrixNear(xi, 1e-15 * (1 + xi.squaredNorm())));
  }
}

// Baker, Campbell, Hausdorff to first order: log(exp(d) exp(xi)) = xi + J_l^-1(xi) d + O(|d|^2).
TYPED_TEST(LieJacobians, FirstOrderOfBakerCampbellHausdorff) {
  using G = TypeParam;
  for (int i = 0; i < 20; ++i) {
    const typename G::Tangent xi = testing::random_tangent<G>(this->random, 1.5, 1.0);
    const typename G::Tangent d = testing::random_tangent<G>(this->random, 1.0, 1.0);
    const auto error = [&](double size) {
      const typename G::Tangent exact = (G::exp(size * d) * G::exp(xi)).log();
      return (exact - xi - G::left_jacobian_inverse(xi) * (size * d)).norm();
    };
    EXPECT_LE(error(1e-4), 1e-7);
    if (error(1e-3) > 1e-12) {  // SO2 has no second order
      EXPECT_NEAR(error(2e-3) / error(1e-3), 4.0, 0.1);
    }
  }
}

TYPED_TEST(LieJacobians, OfInverseComposeAndBetween) {
  using G = TypeParam;
  const G X = random_element<G>(this->random), Y = random_element<G>(this->random);
  typename G::Jacobian J_X, J_Y;
  EXPECT_EQ(inverse(X, &J_X), X.inverse());
  EXPECT_THAT(J_X, MatrixNear(numeric_left([](const G& x) { return x.inverse(); }, X), kTolerance));

  EXPECT_EQ(compose(X, Y, &J_X, &J_Y), X * Y);
  EXPECT_THAT(J_X, MatrixNear(numeric_left([&](const G& x) { return x * Y; }, X), kTolerance));
  EXPECT_THAT(J_Y, MatrixNear(numeric_left([&](const G& y) { return X * y; }, Y), kTolerance));

  EXPECT_EQ(between(X, Y, &J_X, &J_Y), X.inverse() * Y);
  EXPECT_THAT(J_X, MatrixNear(numeric_left([&](const G& x) { return between(x, Y); }, X), kTolerance));
  EXPECT_THAT(J_Y, MatrixNear(numeric_left([&](const G& y) { return between(X, y); }, Y), kTolerance));
}

TYPED_TEST(LieJacobians, OfMinus) {
  using G = TypeParam;
  using Tangent = typename G::Tangent;
  const G X = random_element<G>(this->random),
          Y = plus(testing::random_tangent<G>(this->random, 2.0, 1.0), X);
  typename G::Jacobian J_X, J_Y;
  EXPECT_EQ(minus(X, Y, &J_X, &J_Y), (X * Y.inverse()).log());
  const auto numeric = [](const auto& f) {
    return testing::numeric_jacobian<G::kDof, G::kDof>(f, Tangent::Zero().eval());
  };
  EXPECT_THAT(J_X, MatrixNear(numeric([&](const Tangent& xi) { return minus(plus(xi, X), Y); }), kTolerance));
  EXPECT_THAT(J_Y, MatrixNear(numeric([&](const Tangent& xi) { return minus(X, plus(xi, Y)); }), kTolerance));
}

TYPED_TEST(LieJacobians, OfInterpolate) {
  using G = TypeParam;
  const G X = random_element<G>(this->random),
          Y = plus(testing::random_tangent<G>(this->random, 2.0, 1.0), X);
  typename G::Jacobian J_X, J_Y;
  for (const double s : {0.0, 0.3, 1.0, 1.2}) {
    EXPECT_EQ(interpolate(X, Y, s, &J_X, &J_Y), interpolate(X, Y, s));
    EXPECT_THAT(J_X,
                MatrixNear(numeric_left([&](const G& x) { return interpolate(x, Y, s); }, X), kTolerance));
    EXPECT_THAT(J_Y,
                MatrixNear(numeric_left([&](const G& y) { return interpolate(X, y, s); }, Y), kTolerance));
  }
}

template <class G>
class ActionJacobians : public ::testing::Test {};
using ActingGroups = ::testing::Types<SO2, SE2, SO3, SE3>;
TYPED_TEST_SUITE(ActionJacobians, ActingGroups);

TYPED_TEST(ActionJacobians, AgainstNumeric) {
  using G = TypeParam;
  using Point = typename G::Point;
  constexpr int kDim = G::kPointSize;
  Random random(15);
  for (int i = 0; i < 20; ++i) {
    const G X = random_element<G>(random);
    const Point p = 3 * Point::NullaryExpr([&] { return random.normal(); });
    Eigen::Matrix<double, kDim, G::kDof> J_p_X;
    Eigen::Matrix<double, kDim, kDim> J_p_p;
    EXPECT_EQ(X.act(p, &J_p_X, &J_p_p), X * p);
    EXPECT_EQ(X.act(p, nullptr), X * p);
    EXPECT_THAT(J_p_X, MatrixNear((testing::numeric_jacobian<kDim, G::kDof>(
                                      [&](const typename G::Tangent& xi) { return Point(plus(xi, X) * p); },
                                      G::Tangent::Zero().eval())),
                                  2e-11));
    EXPECT_THAT(
        J_p_p,
        MatrixNear((testing::numeric_jacobian<kDim, kDim>([&](const Point& q) { return Point(X * q); }, p)),
                   2e-11));
  }
}

TYPED_TEST(ActionJacobians, AProductActsAsItsFactorsInTurn) {
  using G = TypeParam;
  using Point = typename G::Point;
  Random random(16);
  for (int i = 0; i < 50; ++i) {
    const G X = random_element<G>(random), Y = random_element<G>(random);
    const Point p = 3 * Point::NullaryExpr([&] { return random.normal(); });
    EXPECT_THAT((X * Y) * p, MatrixNear(Point(X * (Y * p)), 1e-14));
    EXPECT_THAT(X.inverse() * (X * p), MatrixNear(p, 1e-14));
    Eigen::Matrix<double, G::kMatrixSize, 1> homogeneous = Eigen::Matrix<double, G::kMatrixSize, 1>::Ones();
    homogeneous.template head<G::kPointSize>() = p;
    EXPECT_THAT(X * p, MatrixNear((X.matrix() * homogeneous).template head<G::kPointSize>().eval(), 1e-14));
  }
}

}  // namespace
}  // namespace waymark
