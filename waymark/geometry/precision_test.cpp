// Tests the relative precision from 1e-12 rad to pi by comparison with the defining series, summed in long
// double.
#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>
#include <Eigen/LU>

#include "tests/support/geometry_samples.hpp"
#include "waymark/geometry/se2.hpp"
#include "waymark/geometry/se3.hpp"
#include "waymark/geometry/stumpff.hpp"

namespace waymark {
namespace {

constexpr bool kLongDoubleIsLonger = std::numeric_limits<long double>::digits >= 64;
#define WAYMARK_NEEDS_LONG_DOUBLE \
  if (!kLongDoubleIsLonger) GTEST_SKIP() << "long double has no more digits than double here: no reference"

template <int N>
using LongMatrix = Eigen::Matrix<long double, N, N>;

/// sum_n m^n / (n + first)!: the exponential for first = 0, and the left Jacobian for first = 1 and m =
/// ad(xi).
template <int N>
LongMatrix<N> power_series(const LongMatrix<N>& m, int first) {
  LongMatrix<N> term = LongMatrix<N>::Identity(), sum = term;
  for (int n = 1; n < 80; ++n) {
    term = term * m / static_cast<long double>(n + first);
    sum += term;
  }
  return sum;
}

long double stumpff_reference(int k, long double s) {
  long double term = 1, sum = 0;
  for (int i = 1; i <= k; ++i) term /= i;
  for (int n = k; n < k + 120; n += 2) {
    sum += term;
    term *= -s / static_cast<long double>((n + 1) * (n + 2));
  }
  return sum;
}

/// ‖computed - reference‖ / ‖reference‖ for one block.
template <class Computed, class Reference>
double relative_error(const Computed& computed, const Reference& reference) {
  const long double size = reference.norm();
  const long double error = (computed.template cast<long double>() - reference).norm();
  return static_cast<double>(size > 0 ? error / size : error);
}

std::vector<double> angles() {
  std::vector<double> all;
  for (double exponent = -12; exponent <= 0.5; exponent += 1.0 / 64) all.push_back(std::pow(10.0, exponent));
  for (const double angle : testing::critical_angles()) all.push_back(angle);
  all.push_back(std::numbers::pi);
  return all;
}

TEST(Stumpff, MatchesItsSeries) {
  WAYMARK_NEEDS_LONG_DOUBLE;
  auto all = angles();
  for (double angle = 3.2; angle < 6.28; angle += 0.01) all.push_back(angle);
  double worst = 0;
  for (const double angle : all) {
    const double s = angle * angle;
    const Stumpff c = stumpff(s);
    const double values[] = {c.c0, c.c1, c.c2, c.c3, c.c4, c.c5};
    for (int k = 0; k < 6; ++k) {
      const long double exact = stumpff_reference(k, s);
      const bool passes_zero = k < 2 || (k == 2 && angle > 5);
      const long double size = passes_zero ? 1.0L : exact;
      worst = std::max(worst, static_cast<double>(std::abs(values[k] - exact) / size));
    }
  }
  EXPECT_LE(worst, 4e-15);
}

TEST(Stumpff, InverseJacobianCoefficientMatchesItsDefinition) {
  WAYMARK_NEEDS_LONG_DOUBLE;
  for (const double angle : angles()) {
    const long double s = static_cast<long double>(angle) * angle;
    const long double exact =
        (stumpff_reference(2, s / 4) - stumpff_reference(3, s / 4)) / (4 * stumpff_reference(1, s / 4));
    EXPECT_LE(std::abs(inverse_jacobian_coefficient(angle * angle) / exact - 1), 1e-15) << angle;
    if (angle > 0.1) {  // also in the textbook form, where it is well-conditioned
      const long double half = angle / 2.0L;
      EXPECT_LE(std::abs((1 - half * std::cos(half) / std::sin(half)) / s / exact - 1), 1e-15L) << angle;
    }
  }
}

template <class G>
constexpr int kTranslationDof = G::kDof - G::kRotationDof;
template <class G>  // size of the rotation matrix in the upper left corner
constexpr int kSquare = G::kRotationDof == 1 ? 2 : 3;
template <class G>  // number of columns to the right of it
constexpr int kColumns = G::kMatrixSize - kSquare<G>;

template <class G>
std::vector<typename G::Tangent> tangents() {
  Random random(21);
  std::vector<typename G::Tangent> all;
  for (const double angle : angles()) all.push_back(testing::random_tangent<G>(random, angle, 1.0));
  return all;
}

template <class G>
LongMatrix<G::kDof> jacobian_reference(const typename G::Tangent& xi) {
  return power_series<G::kDof>(G::ad(xi).template cast<long double>(), 1);
}

/// The coupling of translation and rotation: the upper right block of a Jacobian.
template <class G, class Matrix>
auto coupling_block(const Matrix& J) {
  return J.template topRightCorner<kTranslationDof<G>, G::kRotationDof>().eval();
}

template <class G>
class Precision : public ::testing::Test {};

using Groups = ::testing::Types<SO2, SE2, SO3, SE3, SE23>;
TYPED_TEST_SUITE(Precision, Groups);

TYPED_TEST(Precision, Exp) {
  WAYMARK_NEEDS_LONG_DOUBLE;
  using G = TypeParam;
  for (const auto& xi : tangents<G>()) {
    const LongMatrix<G::kMatrixSize> exact =
        power_series<G::kMatrixSize>(G::hat(xi).template cast<long double>(), 0);
    const typename G::Matrix M = G::exp(xi).matrix();
    EXPECT_LE(relative_error(M, exact), 1e-15) << xi.transpose();
    // The skew-symmetric part is small, but all its digits must be correct even for small angles.
    const auto skew = [](const auto& m) {
      const auto R = m.template topLeftCorner<kSquare<G>, kSquare<G>>().eval();
      return (R - R.transpose()).eval();
    };
    if (xi.template tail<G::kRotationDof>().norm() < 2) {  // it vanishes at pi
      EXPECT_LE(relative_error(skew(M), skew(exact)), 2e-15) << xi.transpose();
    }
    if constexpr (kColumns<G> > 0) {
      const auto translations = [](const auto& m) {
        return m.template topRightCorner<kSquare<G>, kColumns<G>>().eval();
      };
      EXPECT_LE(relative_error(translations(M), translations(exact)), 1e-15) << xi.transpose();
    }
  }
}

TYPED_TEST(Precision, LogRecoversEachPartOfTheTangent) {
  using G = TypeParam;
  for (const auto& xi : tangents<G>()) {
    const typename G::Tangent back = G::exp(xi).log();
    const auto rotation = xi.template tail<G::kRotationDof>();
    if (rotation.norm() <
        std::numbers::pi) {  // at pi (which is rounded to slightly less) either sign is valid
      EXPECT_LE((back.template tail<G::kRotationDof>() - rotation).norm(), 1e-15 * rotation.norm())
          << xi.transpose();
      EXPECT_LE((back - xi).norm(), 2e-15 * xi.norm()) << xi.transpose();
    }
  }
}

TYPED_TEST(Precision, LeftJacobianBlockByBlock) {
  WAYMARK_NEEDS_LONG_DOUBLE;
  using G = TypeParam;
  for (const auto& xi : tangents<G>()) {
    const LongMatrix<G::kDof> exact = jacobian_reference<G>(xi);
    const typename G::Jacobian J = G::left_jacobian(xi);
    EXPECT_LE(relative_error(J, exact), 5e-16) << xi.transpose();
    if constexpr (kTranslationDof<G> > 0) {
      EXPECT_LE(relative_error(coupling_block<G>(J), coupling_block<G>(exact)), 2e-15) << xi.transpose();
    }
  }
}

TYPED_TEST(Precision, LeftJacobianInverseBlockByBlock) {
  WAYMARK_NEEDS_LONG_DOUBLE;
  using G = TypeParam;
  for (const auto& xi : tangents<G>()) {
    const LongMatrix<G::kDof> exact = jacobian_reference<G>(xi).inverse();
    const typename G::Jacobian J = G::left_jacobian_inverse(xi);
    EXPECT_LE(relative_error(J, exact), 1e-15) << xi.transpose();
    if constexpr (kTranslationDof<G> > 0) {
      EXPECT_LE(relative_error(coupling_block<G>(J), coupling_block<G>(exact)), 2e-15) << xi.transpose();
    }
  }
}

}  // namespace
}  // namespace waymark
