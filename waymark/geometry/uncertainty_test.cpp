// Compares covariances with Monte Carlo simulations (with a fixed seed), and tests exact algebraic
// identities.
#include "waymark/geometry/uncertainty.hpp"
#include "waymark/geometry/uncertain_draw.hpp"

#include <cmath>

#include <gtest/gtest.h>
#include <Eigen/Cholesky>

#include "tests/support/geometry_matchers.hpp"
#include "tests/support/geometry_samples.hpp"

namespace waymark {
namespace {

using testing::MatrixNear;
using testing::random_element;

constexpr int kDraws = 20000;
// The entries of a whitened sample covariance have a standard deviation of 1/sqrt(N) = 0.7 % (1 % on the
// diagonal). Second-order effects at the standard deviations used here are about 0.3 %.
constexpr double kMonteCarloTolerance = 0.05;

template <class G>
class Uncertainty : public ::testing::Test {
 public:
  Random random{51};

  /// A full covariance with standard deviations of about 3 cm and 2 degrees.
  Uncertain<G> uncertain() {
    const typename G::Jacobian A = G::Jacobian::NullaryExpr([&] { return random.normal(); });
    const typename G::Jacobian scaled = 0.03 / std::sqrt(static_cast<double>(G::kDof)) * A;
    const typename G::Jacobian P = scaled * scaled.transpose() + 1e-5 * G::Jacobian::Identity();
    return {random_element<G>(random), (P + P.transpose()) / 2};
  }
};

/// L^-1 (sample covariance of `draws` about 0) L^-T, where L L^T is the claimed covariance. This is the
/// identity if the claim holds.
template <int N>
Eigen::Matrix<double, N, N> whitened(const std::vector<Eigen::Matrix<double, N, 1>>& draws,
                                     const Eigen::Matrix<double, N, N>& claimed) {
  const Eigen::LLT<Eigen::Matrix<double, N, N>> llt(claimed);
  EXPECT_EQ(llt.info(), Eigen::Success);
  Eigen::Matrix<double, N, N> sum = Eigen::Matrix<double, N, N>::Zero();
  for (const auto& draw : draws) {
    const Eigen::Matrix<double, N, 1> white = llt.matrixL().solve(draw);
    sum += white * white.transpose();
  }
  return sum / static_cast<double>(draws.size());
}

/// Draws errors about `claimed`.mean with `draw_element`, and compares their covariance with the claimed one.
template <class G, class Draw>
void expect_covariance(const Uncertain<G>& claimed, const Draw& draw_element) {
  std::vector<typename G::Tangent> errors;
  for (int i = 0; i < kDraws; ++i) errors.push_back(minus(draw_element(), claimed.mean));
  EXPECT_THAT(whitened(errors, claimed.covariance),
              MatrixNear(G::Jacobian::Identity().eval(), kMonteCarloTolerance));
}

using Groups = ::testing::Types<SO2, SE2, SO3, SE3, SE23>;
TYPED_TEST_SUITE(Uncertainty, Groups);

TYPED_TEST(Uncertainty, SamplesHaveTheCovariance) {
  const auto X = this->uncertain();
  expect_covariance(X, [&] { return sample(X, this->random); });
}

TYPED_TEST(Uncertainty, ComposeAgainstMonteCarlo) {
  const auto a_X_b = this->uncertain(), b_X_c = this->uncertain();
  expect_covariance(compose(a_X_b, b_X_c),
                    [&] { return sample(a_X_b, this->random) * sample(b_X_c, this->random); });
}

TYPED_TEST(Uncertainty, InverseAgainstMonteCarlo) {
  const auto a_X_b = this->uncertain();
  expect_covariance(inverse(a_X_b), [&] { return sample(a_X_b, this->random).inverse(); });
}

TYPED_TEST(Uncertainty, BetweenAgainstMonteCarlo) {
  const auto a_X_b = this->uncertain(), a_X_c = this->uncertain();
  expect_covariance(between(a_X_b, a_X_c),
                    [&] { return sample(a_X_b, this->random).inverse() * sample(a_X_c, this->random); });
}

TYPED_TEST(Uncertainty, BetweenOfAChainNeedsTheCrossCovariance) {
  const auto a_X_b = this->uncertain(), b_X_c = this->uncertain();
  // The error of a_X_c contains that of a_X_b: E[xi_ab xi_ac^T] = cov(xi_ab).
  const auto a_X_c = compose(a_X_b, b_X_c);
  const auto back = between(a_X_b, a_X_c, a_X_b.covariance);
  EXPECT_THAT(back.mean, testing::GroupNear(b_X_c.mean, 1e-13));
  EXPECT_THAT(back.covariance, MatrixNear(b_X_c.covariance, 1e-14));
  EXPECT_GT(between(a_X_b, a_X_c).covariance.trace(), b_X_c.covariance.trace());
}

TYPED_TEST(Uncertainty, ChainsDoNotDependOnTheOrderOfEvaluation) {
  const auto x = this->uncertain(), y = this->uncertain(), z = this->uncertain();
  EXPECT_THAT(compose(compose(x, y), z).covariance, MatrixNear(compose(x, compose(y, z)).covariance, 1e-15));
  EXPECT_THAT(inverse(inverse(x)).covariance, MatrixNear(x.covariance, 1e-15));
  EXPECT_THAT(inverse(compose(x, y)).covariance,
              MatrixNear(compose(inverse(y), inverse(x)).covariance, 1e-15));
  EXPECT_THAT(between(x, y).covariance, MatrixNear(compose(inverse(x), y).covariance, 1e-15));
  const auto sum = compose(x, y).covariance;
  EXPECT_EQ(sum, sum.transpose());  // symmetric to the last bit
}

TYPED_TEST(Uncertainty, ACertainFactorAddsNothing) {
  using G = TypeParam;
  const auto x = this->uncertain();
  const Uncertain<G> certain{random_element<G>(this->random)};
  EXPECT_EQ(compose(x, certain).covariance,
            x.covariance);  // moving the child frame does not change a covariance in the parent frame
  const auto moved = compose(certain, x).covariance;
  const typename G::Jacobian Ad = certain.mean.adjoint();
  EXPECT_THAT(moved, MatrixNear((Ad * x.covariance * Ad.transpose()).eval(), 1e-16));
}

TYPED_TEST(Uncertainty, CoordinatesRoundTrip) {
  using G = TypeParam;
  const auto x = this->uncertain();
  const auto back = from_coordinate_covariance(x.mean, coordinate_covariance(x));
  EXPECT_EQ(back.mean, x.mean);
  EXPECT_THAT(back.covariance, MatrixNear(x.covariance, 1e-16));
  const typename G::Tangent variances = coordinate_covariance(x).diagonal();
  EXPECT_THAT(coordinate_deviations(x).cwiseAbs2().eval(), MatrixNear(variances, 1e-16));
}

TYPED_TEST(Uncertainty, SamplingASingularCovarianceStaysInItsRange) {
  using G = TypeParam;
  Uncertain<G> x{random_element<G>(this->random)};
  EXPECT_THAT(sample(x, this->random), testing::GroupNear(x.mean, 1e-15));
  x.covariance(0, 0) = 0.01;
  for (int i = 0; i < 20; ++i) {
    const typename G::Tangent error = minus(sample(x, this->random), x.mean);
    EXPECT_LE(error.template tail<G::kDof - 1>().norm(), 1e-14);
  }
}

// The displayed values: errors in x, y and z along the axes of the map, and rotations about these axes.
TEST(UncertaintyOfPoses, CoordinateCovarianceOfSE3AgainstMonteCarlo) {
  Random random(52);
  const SE3 map_T_base(SO3::from_rpy(0.1, 0.2, 2.0), {5, -3, 1});
  SE3::Jacobian P = SE3::Jacobian::Identity() * 1e-6;
  P(0, 0) = 4e-6;
  P(5, 5) = 9e-6;
  P(0, 5) = P(5, 0) = 2e-6;
  const Uncertain<SE3> x{map_T_base, P};
  std::vector<SE3::Tangent> errors;
  for (int i = 0; i < kDraws; ++i) {
    const SE3 drawn = sample(x, random);
    errors.emplace_back();
    errors.back() << drawn.translation() - map_T_base.translation(),
        (drawn.rotation() * map_T_base.rotation().inverse()).log();
  }
  EXPECT_THAT(whitened(errors, coordinate_covariance(x)),
              MatrixNear(SE3::Jacobian::Identity().eval(), kMonteCarloTolerance));
  // At 5 m from the origin, a heading error of 3 mrad displaces the position sideways by about 15 mm, whereas
  // the tangent's standard deviation is 1 mm.
  EXPECT_NEAR(coordinate_deviations(x)[1], std::hypot(0.001, 5 * 0.003, 1 * 0.001), 1e-12);
}

TEST(UncertaintyOfPoses, CoordinateCovarianceOfSE2AndSE23AgreeWithSE3) {
  const SE3 X(SO3::exp({0, 0, 0.7}), {2, 1, 0});
  const SE2 planar(2, 1, 0.7);
  const Eigen::Vector3d deviations(0.1, 0.2, 0.05);
  SE3::Jacobian P = SE3::Jacobian::Zero();
  P.diagonal() << 0.01, 0.04, 0, 0, 0, 0.0025;
  const Uncertain<SE2> x2{planar, deviations.cwiseAbs2().asDiagonal()};
  const SE3::Jacobian C3 = coordinate_covariance(Uncertain<SE3>{X, P});
  const std::array<int, 3> rows{0, 1, 5};
  EXPECT_THAT(coordinate_covariance(x2), MatrixNear(Eigen::Matrix3d(C3(rows, rows)), 1e-17));

  SE23::Jacobian P9 = SE23::Jacobian::Zero();
  P9.topLeftCorner<3, 3>() = P.topLeftCorner<3, 3>();
  P9.bottomRightCorner<3, 3>() = P.bottomRightCorner<3, 3>();
  const SE23::Jacobian C9 =
      coordinate_covariance(Uncertain<SE23>{SE23(X.rotation(), X.translation(), {0, 3, 0}), P9});
  const std::array<int, 6> pose{0, 1, 2, 6, 7, 8};
  EXPECT_THAT(SE3::Jacobian(C9(pose, pose)), MatrixNear(C3, 1e-17));
  EXPECT_NEAR(std::sqrt(C9(3, 3)), 3 * 0.05, 1e-15);  // a heading error rotates the velocity
}

TEST(UncertaintyOfPoses, SameSeedSameSample) {
  Random first(53), second(53);
  Uncertain<SE3> x;
  x.covariance = SE3::Jacobian::Identity();
  EXPECT_EQ(sample(x, first), sample(x, second));
}

}  // namespace
}  // namespace waymark
