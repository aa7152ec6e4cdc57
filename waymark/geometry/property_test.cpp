// Properties that rapidcheck tries to break, and shrinks when it does: rotations of any angle, translations
// up to kilometres.
#include <functional>
#include <numbers>

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>
#include <Eigen/Eigenvalues>

#include "waymark/geometry/planar.hpp"
#include "waymark/geometry/uncertainty.hpp"

namespace waymark {
namespace {

constexpr double kPi = std::numbers::pi;

/// Uniform over powers of ten as well as over values, and exactly zero now and then.
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

/// Of one type, whatever is checked: what rapidcheck makes of a type of its own takes long to compile.
void check(const std::function<void()>& property) { rc::detail::checkGTest(property); }

template <class G>
class Properties : public ::testing::Test {};
using Groups = ::testing::Types<SO2, SE2, SO3, SE3, SE23>;
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
    const typename G::Tangent xi = 0.9 * any_tangent<G>(10.0);  // at pi either way round is as short
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
