// The laws, for every group with the same words.
#include "waymark/geometry/lie.hpp"

#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/numeric_jacobian.hpp"
#include "waymark/base/random.hpp"
#include "waymark/geometry/se2.hpp"
#include "waymark/geometry/se23.hpp"
#include "waymark/geometry/se3.hpp"
#include "waymark/geometry/so2.hpp"
#include "waymark/geometry/so3.hpp"

namespace waymark {
namespace {

constexpr double kPi = std::numbers::pi;

template <class G>
class LieLaws : public ::testing::Test {};
using Groups = ::testing::Types<SO2, SE2, SO3, SE3, SE23>;
TYPED_TEST_SUITE(LieLaws, Groups);

template <class G>
constexpr int kRotationDof =
    G::kMatrixSize == 2 || G::kDof == 3 && G::kMatrixSize == 3 && G::kPointSize == 2 ? 1 : 3;
template <>
constexpr int kRotationDof<SE23> = 3;

/// Tangents with rotations from 1e-12 to pi and translations from 1e-6 to 10.
template <class G>
std::vector<typename G::Tangent> tangents(std::uint64_t seed) {
  Random random(seed);
  std::vector<typename G::Tangent> all{G::Tangent::Zero()};
  for (const double angle : {1e-12, 1e-9, 1e-6, 1e-3, 0.1, 1.0, 1.99, 2.01, 3.0, kPi - 1e-6, kPi - 1e-9}) {
    for (const double size : {1e-6, 1.0, 10.0}) {
      typename G::Tangent xi;
      for (int i = 0; i < G::kDof; ++i) xi[i] = random.normal();
      xi *= size;
      xi.template tail<kRotationDof<G>>() *= angle / xi.template tail<kRotationDof<G>>().norm();
      all.push_back(xi);
    }
  }
  return all;
}

template <class G>
double difference(const G& X, const G& Y) {
  return (X.matrix() - Y.matrix()).cwiseAbs().maxCoeff();
}

TYPED_TEST(LieLaws, IdentityInverseAndAssociativity) {
  using G = TypeParam;
  const auto xs = tangents<G>(1), ys = tangents<G>(2), zs = tangents<G>(3);
  for (std::size_t i = 0; i < xs.size(); ++i) {
    const G X = G::exp(xs[i]), Y = G::exp(ys[i]), Z = G::exp(zs[i]);
    EXPECT_LT(difference(X * G::identity(), X), 1e-15);
    const double scale = 1 + xs[i].norm();  // rounding is relative to the longest translation
    EXPECT_LT(difference(X * X.inverse(), G::identity()), 2e-15 * scale);
    EXPECT_LT(difference((X * Y) * Z, X * (Y * Z)), 1e-13);
    EXPECT_LT((X.matrix() * Y.matrix() - (X * Y).matrix()).cwiseAbs().maxCoeff(), 1e-13);
    EXPECT_LT(difference(G::exp(-xs[i]), X.inverse()), 2e-15 * scale);
  }
}

TYPED_TEST(LieLaws, LogUndoesExp) {
  using G = TypeParam;
  for (const auto& xi : tangents<G>(4))
    EXPECT_LT((G::exp(xi).log() - xi).norm(), 1e-13 * (1 + xi.norm())) << xi;
}

TYPED_TEST(LieLaws, HatAndVee) {
  using G = TypeParam;
  for (const auto& xi : tangents<G>(5)) EXPECT_EQ(G::vee(G::hat(xi)), xi);
}

TYPED_TEST(LieLaws, Adjoint) {
  using G = TypeParam;
  const auto xs = tangents<G>(6), ys = tangents<G>(7);
  for (std::size_t i = 0; i < xs.size(); ++i) {
    const G X = G::exp(xs[i]);
    const typename G::Tangent xi = 0.3 * ys[i];
    EXPECT_LT(difference(X * G::exp(xi) * X.inverse(), G::exp(X.adjoint() * xi)), 1e-12);
    const typename G::Matrix x = G::hat(xs[i]), y = G::hat(ys[i]);
    EXPECT_LT((G::ad(xs[i]) * ys[i] - G::vee(x * y - y * x)).norm(),
              1e-13 * (1 + xs[i].norm() * ys[i].norm()));
  }
}

TYPED_TEST(LieLaws, Jacobians) {
  using G = TypeParam;
  using J = typename G::Jacobian;
  for (const auto& xi : tangents<G>(8)) {
    const J left = G::left_jacobian(xi);
    const double scale = 1 + xi.squaredNorm();
    EXPECT_LT((left * G::left_jacobian_inverse(xi) - J::Identity()).norm(), 1e-13 * scale);
    EXPECT_LT((G::right_jacobian(xi) * G::right_jacobian_inverse(xi) - J::Identity()).norm(), 1e-13 * scale);
    EXPECT_LT((G::right_jacobian(xi) - G::left_jacobian(-xi)).norm(), 1e-15);
    EXPECT_LT((left - G::exp(xi).adjoint() * G::right_jacobian(xi)).norm(), 1e-13 * scale);
    const G X = G::exp(xi);
    const J numeric = testing::numeric_jacobian<G::kDof, G::kDof>(
        [&](const typename G::Tangent& moved) { return (G::exp(moved) * X.inverse()).log(); }, xi);
    EXPECT_LT((left - numeric).norm(), 1e-9 * scale) << xi.transpose();
  }
}

TYPED_TEST(LieLaws, PlusMinusAndInterpolate) {
  using G = TypeParam;
  const auto xs = tangents<G>(9), ys = tangents<G>(10);
  for (std::size_t i = 0; i < xs.size(); ++i) {
    const G X = G::exp(xs[i]), Y = G::exp(0.5 * ys[i]) * X;
    EXPECT_LT(difference(plus(minus(Y, X), X), Y), 1e-13);
    EXPECT_LT(difference(interpolate(X, Y, 0), X), 1e-15);
    EXPECT_LT(difference(interpolate(X, Y, 1), Y), 1e-13);
  }
}

}  // namespace
}  // namespace waymark
