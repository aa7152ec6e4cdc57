// Tests the laws of a Lie group and its tangent, as typed tests for every group. Every analytic Jacobian is
// compared with a numeric one, and the relations between them are checked. rapidcheck searches for
// counterexamples: rotations by any angle and translations of up to kilometres.
#include "waymark/geometry/lie.hpp"

#include <functional>
#include <numbers>

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>
#include <Eigen/Eigenvalues>

#include "tests/support/geometry_matchers.hpp"
#include "tests/support/geometry_samples.hpp"
#include "tests/support/numeric_jacobian.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/geometry/se2.hpp"
#include "waymark/geometry/se3.hpp"
#include "waymark/geometry/uncertainty.hpp"

namespace waymark {
namespace {

using testing::critical_tangents;
using testing::GroupNear;
using testing::MatrixNear;
using testing::random_element;

static_assert(LieGroup<SO2> && LieGroup<SE2> && LieGroup<SO3> && LieGroup<SE3> && LieGroup<SE23>);

template <class G>
class LieLaws : public ::testing::Test {
 public:
  const std::vector<typename G::Tangent> xs = critical_tangents<G>(1), ys = critical_tangents<G>(2),
                                         zs = critical_tangents<G>(3);

  /// Rounding is relative to the longest translation involved.
  static double tolerance(const typename G::Tangent& xi, double factor) { return factor * (1 + xi.norm()); }
};

class GroupNames {
 public:
  template <class G>
  static std::string GetName(int) {
    if (std::is_same_v<G, SO2>) return "SO2";
    if (std::is_same_v<G, SE2>) return "SE2";
    if (std::is_same_v<G, SO3>) return "SO3";
    return std::is_same_v<G, SE3> ? "SE3" : "SE23";
  }
};

using Groups = ::testing::Types<SO2, SE2, SO3, SE3, SE23>;
TYPED_TEST_SUITE(LieLaws, Groups, GroupNames);

TYPED_TEST(LieLaws, IdentityIsNeutral) {
  using G = TypeParam;
  EXPECT_EQ(G(), G::identity());
  EXPECT_EQ(G::exp(G::Tangent::Zero()), G::identity());
  EXPECT_EQ(G::identity().log(), G::Tangent::Zero());
  EXPECT_EQ(G::identity().matrix(), G::Matrix::Identity());
  for (const auto& xi : this->xs) {
    const G X = G::exp(xi);
    EXPECT_THAT(X * G::identity(), GroupNear(X, this->tolerance(xi, 1e-15)));
    EXPECT_THAT(G::identity() * X, GroupNear(X, this->tolerance(xi, 1e-15)));
  }
}

TYPED_TEST(LieLaws, InverseUndoes) {
  using G = TypeParam;
  for (const auto& xi : this->xs) {
    const G X = G::exp(xi);
    EXPECT_THAT(X * X.inverse(), GroupNear(G::identity(), this->tolerance(xi, 2e-15)));
    EXPECT_THAT(X.inverse() * X, GroupNear(G::identity(), this->tolerance(xi, 2e-15)));
    EXPECT_THAT(X.inverse().inverse(), GroupNear(X, this->tolerance(xi, 2e-15)));
    EXPECT_THAT(G::exp(-xi), GroupNear(X.inverse(), this->tolerance(xi, 2e-15)));
  }
}

TYPED_TEST(LieLaws, CompositionIsAssociativeAndAProductOfMatrices) {
  using G = TypeParam;
  for (std::size_t i = 0; i < this->xs.size(); ++i) {
    const G X = G::exp(this->xs[i]), Y = G::exp(this->ys[i]), Z = G::exp(this->zs[i]);
    const double tolerance = this->tolerance(this->xs[i], 1e-15) + this->tolerance(this->ys[i], 1e-15) +
                             this->tolerance(this->zs[i], 1e-15);
    EXPECT_THAT((X * Y) * Z, GroupNear(X * (Y * Z), tolerance));
    EXPECT_THAT((X * Y).matrix(), MatrixNear((X.matrix() * Y.matrix()).eval(), tolerance));
    EXPECT_THAT((X * Y).inverse(), GroupNear(Y.inverse() * X.inverse(), tolerance));
  }
}

TYPED_TEST(LieLaws, LogUndoesExp) {
  using G = TypeParam;
  for (const auto& xi : this->xs) {
    EXPECT_LE((G::exp(xi).log() - xi).norm(), 1e-14 * xi.norm())
        << xi.transpose();  // precise in all digits, even for 1e-12 rad
  }
}

TYPED_TEST(LieLaws, ExpUndoesLog) {
  using G = TypeParam;
  for (std::size_t i = 0; i < this->xs.size(); ++i) {
    const G X = G::exp(this->xs[i]) * G::exp(this->ys[i]);
    EXPECT_THAT(G::exp(X.log()),
                GroupNear(X, this->tolerance(this->xs[i], 1e-14) + this->tolerance(this->ys[i], 1e-14)));
  }
}

TYPED_TEST(LieLaws, VeeUndoesHatAndHatIsTheDerivativeOfExp) {
  using G = TypeParam;
  for (const auto& xi : this->xs) {
    EXPECT_EQ(G::vee(G::hat(xi)), xi);
    const auto along = [&](double s) { return G::exp(s * xi).matrix(); };
    EXPECT_THAT(testing::numeric_derivative(along), MatrixNear(G::hat(xi), this->tolerance(xi, 2e-12)));
  }
}

TYPED_TEST(LieLaws, ExpOfMultiplesOfOneTangentAdds) {
  using G = TypeParam;
  for (const auto& xi : this->xs) {
    EXPECT_THAT(G::exp(0.25 * xi) * G::exp(0.5 * xi),
                GroupNear(G::exp(0.75 * xi), this->tolerance(xi, 2e-15)));
  }
}

TYPED_TEST(LieLaws, AdjointMovesATangentThroughAnElement) {
  using G = TypeParam;
  for (std::size_t i = 0; i < this->xs.size(); ++i) {
    const G X = G::exp(this->xs[i]), Y = G::exp(this->zs[i]);
    const auto& xi = this->ys[i];
    const double size = (1 + this->xs[i].norm()) * (1 + xi.norm()) * (1 + this->zs[i].norm());
    EXPECT_THAT(X * G::exp(xi) * X.inverse(), GroupNear(G::exp(X.adjoint() * xi), 1e-15 * size));
    EXPECT_THAT((X * Y).adjoint(), MatrixNear((X.adjoint() * Y.adjoint()).eval(), 1e-15 * size));
    const typename G::Matrix commutator = G::hat(this->xs[i]) * G::hat(xi) - G::hat(xi) * G::hat(this->xs[i]);
    EXPECT_THAT((G::ad(this->xs[i]) * xi).eval(), MatrixNear(G::vee(commutator), 1e-15 * size));
  }
}

// The convention of docs/conventions.md: translation first, then rotation; X = Exp(xi) X_hat with xi in the
// parent frame; corrections add.
TYPED_TEST(LieLaws, CorrectionsAreInTheParentFrameAndAdd) {
  using G = TypeParam;
  Random random(4);
  for (int i = 0; i < 20; ++i) {
    const G X = random_element<G>(random);
    const typename G::Tangent xi = testing::random_tangent<G>(random, 0.3, 0.1);
    EXPECT_EQ(plus(xi, X), G::exp(xi) * X);
    EXPECT_THAT(minus(plus(xi, X), X), MatrixNear(xi, 1e-14));
    EXPECT_THAT(plus(xi, plus(xi, X)), GroupNear(plus((2 * xi).eval(), X), 1e-14));
  }
}

TYPED_TEST(LieLaws, PlusUndoesMinus) {
  using G = TypeParam;
  for (std::size_t i = 0; i < this->xs.size(); ++i) {
    const G X = G::exp(this->xs[i]), Y = G::exp(this->ys[i]);
    const double tolerance = this->tolerance(this->xs[i], 5e-15) + this->tolerance(this->ys[i], 5e-15);
    EXPECT_THAT(plus(minus(X, Y), Y), GroupNear(X, tolerance));
    EXPECT_THAT(X * between(X, Y), GroupNear(Y, tolerance));
  }
}

TYPED_TEST(LieLaws, InterpolationHitsItsEnds) {
  using G = TypeParam;
  for (std::size_t i = 0; i < this->xs.size(); ++i) {
    const G X = G::exp(this->xs[i]), Y = G::exp(this->ys[i]);
    const double tolerance = this->tolerance(this->xs[i], 5e-15) + this->tolerance(this->ys[i], 5e-15);
    EXPECT_THAT(interpolate(X, Y, 0.0), GroupNear(X, tolerance));
    EXPECT_THAT(interpolate(X, Y, 1.0), GroupNear(Y, tolerance));
  }
}

TYPED_TEST(LieLaws, InterpolationDoesNotDependOnTheFrame) {
  using G = TypeParam;
  Random random(5);
  for (int i = 0; i < 50; ++i) {
    const G X = random_element<G>(random), Y = plus(testing::random_tangent<G>(random, 2.0, 1.0), X);
    const G A = random_element<G>(random);
    const double s = random.uniform(-0.5, 1.5);
    EXPECT_THAT(interpolate(A * X, A * Y, s), GroupNear(A * interpolate(X, Y, s), 1e-13));
    EXPECT_THAT(interpolate(X * A, Y * A, s), GroupNear(interpolate(X, Y, s) * A, 1e-13));
    EXPECT_THAT(interpolate(Y, X, 1 - s), GroupNear(interpolate(X, Y, s), 1e-13));
    const G middle = interpolate(X, Y, 0.5);  // the middle, reached in equal steps
    EXPECT_THAT(minus(middle, X), MatrixNear(minus(Y, middle), 1e-13));
  }
}

TYPED_TEST(LieLaws, AHundredThousandProductsDoNotDrift) {
  using G = TypeParam;
  Random random(6);
  const G step = random_element<G>(random, 1.0, 1e-3);
  G X;
  for (int i = 0; i < 100000; ++i) X = X * step;
  constexpr int kSize = G::kRotationDof == 1 ? 2 : 3;
  const Eigen::Matrix<double, kSize, kSize> R = X.matrix().template topLeftCorner<kSize, kSize>();
  EXPECT_THAT((R.transpose() * R).eval(),
              MatrixNear(Eigen::Matrix<double, kSize, kSize>::Identity().eval(), 1e-15));
}

TYPED_TEST(LieLaws, SameInputSameBits) {
  using G = TypeParam;
  for (std::size_t i = 0; i < this->xs.size(); ++i) {
    const auto run = [&] { return (G::exp(this->xs[i]) * G::exp(this->ys[i]).inverse()); };
    EXPECT_EQ(run(), run());
    EXPECT_EQ(run().log(), run().log());
  }
}

/// d(result) / d(argument) for f: G -> G at X, with both perturbed on the left.
template <class G, class F>
typename G::Jacobian numeric_left(const F& f, const G& X) {
  const G Z = f(X);
  const auto moved = [&](const typename G::Tangent& xi) { return minus(f(plus(xi, X)), Z); };
  return testing::numeric_jacobian<G::kDof, G::kDof>(moved, G::Tangent::Zero().eval());
}

constexpr double kTolerance = 5e-11;  // error of the numeric Jacobians, for translations of a few metres

template <class G>
class LieJacobians : public ::testing::Test {
 public:
  Random random{11};
};

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
    // Both leave the tangent itself unchanged, because it commutes with itself.
    EXPECT_THAT((left * xi).eval(), MatrixNear(xi, 1e-15 * (1 + xi.squaredNorm())));
  }
}

// Baker-Campbell-Hausdorff formula to first order: log(exp(d) exp(xi)) = xi + J_l^-1(xi) d + O(|d|^2).
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
    if (error(1e-3) > 1e-12) {  // SO2 has no second-order term
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

TYPED_TEST(ActionJacobians, AProductActsLikeItsFactorsInSequence) {
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

constexpr double kPi = std::numbers::pi;

/// A log-uniform or uniform number, or sometimes exactly zero.
rc::Gen<double> number(double largest) {
  const auto make = [largest](int mantissa, int exponent) {
    return largest * mantissa / 1e6 * std::pow(10.0, -exponent);
  };
  return rc::gen::apply(make, rc::gen::inRange(-1000000, 1000001), rc::gen::inRange(0, 13));
}

/// A tangent with |rotation| < pi.
template <class G>
typename G::Tangent any_tangent(double largest_translation = 1000.0) {
  typename G::Tangent xi;
  for (int i = 0; i < G::kDof; ++i)
    xi[i] = *number(i < G::kDof - G::kRotationDof ? largest_translation : kPi);
  auto rotation = xi.template tail<G::kRotationDof>();
  const double angle = rotation.norm();
  if (angle >= kPi) rotation *= (kPi - 1e-9) / angle;
  return xi;
}

template <class G>
double distance(const G& X, const G& Y) {
  return (X.matrix() - Y.matrix()).cwiseAbs().maxCoeff();
}

template <class G>
double size(const G& X) {
  return X.matrix().cwiseAbs().maxCoeff();
}

/// A single type for all properties, because rapidcheck's code takes long to compile for each additional
/// type.
void check(const std::function<void()>& property) { rc::detail::checkGTest(property); }

template <class G>
class Properties : public ::testing::Test {};
TYPED_TEST_SUITE(Properties, Groups);

TYPED_TEST(Properties, GroupLaws) {
  using G = TypeParam;
  check([] {
    const G X = G::exp(any_tangent<G>()), Y = G::exp(any_tangent<G>()), Z = G::exp(any_tangent<G>());
    const double tolerance = 2e-15 * (size(X) + size(Y) + size(Z));
    RC_ASSERT(distance((X * Y) * Z, X * (Y * Z)) <= tolerance);
    RC_ASSERT(distance(X * X.inverse(), G::identity()) <= tolerance);
    RC_ASSERT(distance((X * Y).inverse(), Y.inverse() * X.inverse()) <= tolerance);
  });
}

TYPED_TEST(Properties, LogUndoesExpToTheLastDigits) {
  using G = TypeParam;
  check([] {
    const typename G::Tangent xi = any_tangent<G>();
    RC_ASSERT((G::exp(xi).log() - xi).norm() <= 1e-14 * xi.norm());
    RC_ASSERT(distance(G::exp(-xi), G::exp(xi).inverse()) <= 2e-15 * (1 + xi.norm()));
  });
}

TYPED_TEST(Properties, AnyFiniteTangentGivesAnElementWithAShortLog) {
  using G = TypeParam;
  check([] {
    typename G::Tangent xi;
    for (int i = 0; i < G::kDof; ++i) xi[i] = *number(1e6);
    const G X = G::exp(xi);
    RC_ASSERT(X.matrix().allFinite());
    RC_ASSERT(X.log().allFinite());
    RC_ASSERT(X.log().template tail<G::kRotationDof>().norm() <= kPi);
  });
}

TYPED_TEST(Properties, Adjoint) {
  using G = TypeParam;
  check([] {
    const G X = G::exp(any_tangent<G>(10.0));
    const typename G::Tangent xi = any_tangent<G>(10.0);
    RC_ASSERT(distance(X * G::exp(xi), G::exp(X.adjoint() * xi) * X) <= 1e-13);
  });
}

TYPED_TEST(Properties, JacobianTimesItsInverse) {
  using G = TypeParam;
  check([] {
    const typename G::Tangent xi = any_tangent<G>(10.0);
    const typename G::Jacobian product = G::left_jacobian(xi) * G::left_jacobian_inverse(xi);
    RC_ASSERT((product - G::Jacobian::Identity()).cwiseAbs().maxCoeff() <= 5e-14);
  });
}

TYPED_TEST(Properties, InterpolationIsEquivariant) {
  using G = TypeParam;
  check([] {
    const G X = G::exp(any_tangent<G>(10.0)), A = G::exp(any_tangent<G>(10.0));
    const typename G::Tangent xi = 0.9 * any_tangent<G>(10.0);  // at pi, both directions are equally short
    const G Y = plus(xi, X);
    const double s = *number(1.0);
    RC_ASSERT(distance(A * interpolate(X, Y, s), interpolate(A * X, A * Y, s)) <= 1e-11);
    RC_ASSERT(distance(interpolate(X, Y, s), G::exp(s * xi) * X) <= 1e-11);
  });
}

TYPED_TEST(Properties, CovarianceStaysACovariance) {
  using G = TypeParam;
  check([] {
    const auto any_uncertain = [] {
      typename G::Jacobian A;
      for (int i = 0; i < A.size(); ++i) A.data()[i] = *number(0.1);
      return Uncertain<G>{G::exp(any_tangent<G>(10.0)), A * A.transpose()};
    };
    const auto x = any_uncertain(), y = any_uncertain();
    for (const auto& z : {compose(x, y), inverse(x), between(x, y)}) {
      RC_ASSERT(z.covariance == z.covariance.transpose());
      const Eigen::SelfAdjointEigenSolver<Covariance<G>> solver(z.covariance);
      RC_ASSERT(solver.eigenvalues().minCoeff() >= -1e-13 * (1 + solver.eigenvalues().maxCoeff()));
    }
  });
}

}  // namespace
}  // namespace waymark
