#include "waymark/camera/distortion.hpp"

#include <cmath>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "tests/support/random_camera.hpp"

namespace waymark {
namespace {

TEST(Polynomial, Arithmetic) {
  const Polynomial a = {1, 2};
  const Polynomial b = {0, 1, 3};
  EXPECT_EQ(a + b, (Polynomial{1, 3, 3}));
  EXPECT_EQ(a - b, (Polynomial{1, 1, -3}));
  EXPECT_EQ(a * b, (Polynomial{0, 1, 5, 6}));
  EXPECT_EQ(derivative(a * b), (Polynomial{1, 10, 18}));
  EXPECT_DOUBLE_EQ(evaluate(a * b, 2.0), evaluate(a, 2.0) * evaluate(b, 2.0));
}

TEST(Polynomial, FindsTheFirstOfManyRoots) {
  Polynomial p = {1};
  for (const double root : {0.3, 0.31, 0.9, 2.0, 7.0, 7.001}) p = p * Polynomial{1, -1 / root};
  const auto first = last_positive_before_root(p, 100);
  ASSERT_TRUE(first);
  EXPECT_NEAR(*first, 0.3, 1e-12);
  EXPECT_GT(evaluate(p, *first), 0);
  EXPECT_FALSE(last_positive_before_root(p, 0.29));
  EXPECT_FALSE(last_positive_before_root({1, 0, 1}, 1e6));
  EXPECT_FALSE(last_positive_before_root({2}, 1));
}

TEST(Polynomial, FindsADipThatSamplingWouldMiss) {
  // (x - 1)^2 - 1e-12 is negative only within 1e-6 of 1.
  const auto first = last_positive_before_root({1 - 1e-12, -2, 1}, 1e3);
  ASSERT_TRUE(first);
  EXPECT_NEAR(*first, 1 - 1e-6, 1e-9);
}

TEST(RadtanDomain, OfASingleRadialTermEndsWhereTheSlopeVanishes) {
  EXPECT_NEAR((Radtan{{-0.3}}.domain()), std::sqrt(1 / 0.9), 1e-12);
  EXPECT_EQ((Radtan{{1e-7}}.domain()), Radtan::kLargestRadius);
  EXPECT_EQ(Radtan{}.domain(), std::numeric_limits<double>::infinity());
}

TEST(RadtanDomain, EndsWhereTheMapStretchesBeyondAnyLens) {
  EXPECT_NEAR((Radtan{{0.3}}.domain()), std::sqrt(99 / 0.9), 1e-12);
  // g = 1 / (1 - r^2 / 4) increases up to its pole at 2; d(r g)/dr = (1 + s / 4) / (1 - s / 4)^2 reaches 100
  // before the pole.
  const double limit = Radtan{{0, 0, 0, 0, 0, -0.25, 0, 0}}.domain();
  EXPECT_LT(limit, 2.0);
  const double q = limit * limit / 4;
  EXPECT_NEAR((1 + q) / ((1 - q) * (1 - q)), 100, 1e-9);
}

TEST(RadtanDomain, OfTangentialDistortionEndsWhereItsLargestEigenvalueReachesOne) {
  EXPECT_NEAR((Radtan{{0, 0, 0.03, 0.04}}.domain()), 1 / (6 * 0.05), 1e-12);
}

TEST(RadtanDomain, OfPincushionWithTangentialDistortionEndsWithItsSmallerSlope) {
  // B = 1 + 0.01 r^2 meets 6 |p| r = 0.6 r at 1.716, whereas A = 1 + 0.03 r^2 meets it only at 1.835.
  EXPECT_NEAR((Radtan{{0.01, 0, 0.06, 0.08}}.domain()), (0.6 - std::sqrt(0.36 - 0.04)) / 0.02, 1e-12);
}

TEST(RadtanDomain, EndsWhereTheDenominatorVanishesEvenIfItCancels) {
  // The numerator and denominator are both 1 - r^2 / 4, so g is 1, except at 2, where it is 0 / 0.
  EXPECT_NEAR((Radtan{{-0.25, 0, 0, 0, 0, -0.25, 0, 0}}.domain()), 2.0, 1e-6);
}

/// The smaller eigenvalue of a symmetric matrix.
double smaller_eigenvalue(const Eigen::Matrix2d& J) {
  return 0.5 * (J.trace() - std::hypot(J(0, 0) - J(1, 1), 2 * J(0, 1)));
}

RC_GTEST_PROP(RadtanDomain, TheJacobianIsSymmetricPositiveDefiniteInside, ()) {
  const Radtan lens{testing::any_radtan().k};
  const double limit = std::min(lens.domain(), 20.0);
  const Eigen::Vector3d bearing = testing::direction(1.0);
  const Eigen::Vector2d x = limit * testing::near_one() * bearing.head<2>().normalized();
  Eigen::Matrix2d J;
  (void)lens.distort(x, &J);
  RC_ASSERT(J(0, 1) == J(1, 0));
  RC_ASSERT(smaller_eigenvalue(J) > -1e-12 * J.norm());
}

RC_GTEST_PROP(RadtanDomain, IsNotSmallerThanItMustBe, ()) {
  // With barrel distortion (slope A below B), the Jacobian loses rank exactly at the limit in the direction
  // opposite to p.
  PinholeRadtan camera = testing::any_radtan();
  camera.k[0] = -std::abs(camera.k[0]) - 0.01;
  camera.k[1] = camera.k[4] = camera.k[5] = camera.k[6] = camera.k[7] = 0;
  const Radtan lens{camera.k};
  const Eigen::Vector2d p(camera.k[3], camera.k[2]);
  const Eigen::Vector2d against = p.norm() > 0 ? Eigen::Vector2d(-p.normalized()) : Eigen::Vector2d(1, 0);
  Eigen::Matrix2d J;
  (void)lens.distort(lens.domain() * against, &J);
  RC_ASSERT(std::abs(smaller_eigenvalue(J)) < 1e-9);
}

RC_GTEST_PROP(RadtanDomain, EveryPixelBelowTheRimHasASource, ()) {
  const Radtan lens{testing::any_radtan().k};
  const double limit = lens.domain();
  RC_PRE(std::isfinite(limit));
  const double rim = std::min(lens.distorted_radius(limit), 10.0);
  RC_PRE(rim > 0);
  const Eigen::Vector2d distorted =
      rim * testing::near_one() * testing::direction(1.0).head<2>().normalized();
  const auto undistorted = lens.undistort(distorted, limit);
  RC_ASSERT(undistorted.has_value());
  RC_ASSERT(undistorted->norm() < limit);
  RC_ASSERT((lens.distort(*undistorted) - distorted).norm() < 1e-12);
}

RC_GTEST_PROP(EquidistantDomain, ThetaIncreasesUpToTheLimitAndNotBeyond, ()) {
  const EquidistantAngle lens{testing::any_equidistant().k};
  const double limit = lens.domain();
  double slope = 0;
  (void)lens.distort(limit * testing::near_one(), &slope);
  RC_ASSERT(slope > 0);
  (void)lens.distort(limit * (1 + 1e-9), &slope);
  RC_ASSERT(slope <= 0 || limit == std::numbers::pi);
}

TEST(EquidistantDomain, OfASingleTermEndsWhereTheSlopeVanishes) {
  EXPECT_NEAR((EquidistantAngle{{-0.3, 0, 0, 0}}.domain()), std::sqrt(1 / 0.9), 1e-12);
  EXPECT_EQ((EquidistantAngle{{0.3, 0, 0, 0}}.domain()), std::numbers::pi);
  EXPECT_FALSE((EquidistantAngle{}.undistort(3.2, std::numbers::pi)));
}

}  // namespace
}  // namespace waymark
