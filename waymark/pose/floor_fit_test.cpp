// Tests the fit of a pose to a floor: it is exact without noise, and its covariance is consistent with noise.
#include "waymark/pose/floor_fit.hpp"

#include <gtest/gtest.h>

#include "waymark/base/random.hpp"
#include "waymark/geometry/lie.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/geometry/uncertain_draw.hpp"

namespace waymark {
namespace {

SE3 upright_shape() {
  const Eigen::Matrix3d R = (Eigen::Matrix3d() << 0, 0, 1, -1, 0, 0, 0, -1, 0).finished();
  return {SO3::from_matrix(R), {0, 0, 0.3}};
}

TEST(FloorFit, ExactWithoutNoise) {
  Random random(1);
  for (int i = 0; i < 200; ++i) {
    const SE2 X(random.uniform(0.3, 4), random.uniform(-2, 2), random.uniform(-3, 3));
    const FloorFit fit = fit_to_floor(
        {lift(X) * upright_shape(), Eigen::Matrix<double, 6, 6>::Identity() * 1e-4}, upright_shape());
    EXPECT_LT(minus(fit.a_X_b.mean, X).norm(), 1e-9);
    EXPECT_LT(fit.chi2, 1e-12);
  }
}

// If uncertain tilts are correlated with the position, the floor constrains the tilts and thereby improves
// the position.
TEST(FloorFit, IsMorePreciseThanTheProjectionAndConsistent) {
  Random random(2);
  Covariance<SE3> P = Covariance<SE3>::Identity() * 1e-5;
  P.block<3, 3>(3, 3) *= 400;
  P(0, 4) = P(4, 0) = 0.9 * std::sqrt(P(0, 0) * P(4, 4));
  const SE2 X(2, 0.5, 0.3);
  const SE3 truth = lift(X) * upright_shape();
  const FloorOptions exact{.tilt_sigma_rad = 1e-5, .height_sigma_m = 1e-5};
  double fitted = 0;
  double projected = 0;
  double nees = 0;
  double chi2 = 0;
  constexpr int kDraws = 4000;
  for (int i = 0; i < kDraws; ++i) {
    const SE3 measured = sample(Uncertain<SE3>{truth, P}, random);
    const FloorFit fit = fit_to_floor({measured, P}, upright_shape(), exact);
    const SE2::Tangent e = minus(fit.a_X_b.mean, X);
    fitted += e.head<2>().squaredNorm();
    projected += minus(project_to_plane(measured * upright_shape().inverse()), X).head<2>().squaredNorm();
    nees += e.dot(fit.a_X_b.covariance.inverse() * e);
    chi2 += fit.chi2;
  }
  EXPECT_LT(fitted, 0.7 * projected);
  EXPECT_NEAR(nees / kDraws, 3, 0.15) << "3 degrees of freedom, standard error 0.04";
  EXPECT_NEAR(chi2 / kDraws, 3, 0.15);
}

TEST(FloorFit, ZeroCovarianceDoesNotDivideByZero) {
  const FloorFit fit = fit_to_floor({lift(SE2(1, 2, 3)) * upright_shape()}, upright_shape());
  EXPECT_LT(minus(fit.a_X_b.mean, SE2(1, 2, 3)).norm(), 1e-9);
  EXPECT_TRUE(fit.a_X_b.covariance.allFinite());
}

}  // namespace
}  // namespace waymark
