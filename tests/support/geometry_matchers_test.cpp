// The matchers must reject values outside their tolerances.
#include "tests/support/geometry_matchers.hpp"

#include <limits>

#include <gtest/gtest.h>

#include "waymark/geometry/se3.hpp"

namespace waymark::testing {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

template <class Matcher, class Value>
std::string explanation(const Matcher& matcher, const Value& value) {
  ::testing::StringMatchResultListener listener;
  ::testing::ExplainMatchResult(matcher, value, &listener);
  return listener.str();
}

TEST(GeometryMatchers, MatrixNearComparesEveryEntry) {
  const Eigen::Matrix2d m = (Eigen::Matrix2d() << 1, 2, 3, 4).finished();
  EXPECT_THAT(m, MatrixNear(m, 0.0));
  for (int i = 0; i < 4; ++i) {
    Eigen::Matrix2d other = m;
    other.data()[i] += 0.1;
    EXPECT_THAT(other, MatrixNear(m, 0.11));
    EXPECT_THAT(other, Not(MatrixNear(m, 0.09)));
    other.data()[i] = kNan;
    EXPECT_THAT(other, Not(MatrixNear(m, 1e9)));
    EXPECT_THAT(m, Not(MatrixNear(other, 1e9)));
  }
  EXPECT_THAT(Eigen::MatrixXd(2, 3), Not(MatrixNear(Eigen::MatrixXd(3, 2), 1e9)));
  EXPECT_THAT(explanation(MatrixNear(m, 0.0), Eigen::Matrix2d(m.array() + 0.25)), HasSubstr("0.25"));
}

TEST(GeometryMatchers, PosesNearInBothParts) {
  const SE3 X(SO3::exp({0.1, 0.2, 0.3}), {1, 2, 3});
  const SE3 shifted(X.rotation(), X.translation() + Eigen::Vector3d(0, 0.1, 0));
  const SE3 turned(X.rotation() * SO3::exp({0.1, 0, 0}), X.translation());
  EXPECT_THAT(X, SE3Near(X, 0.0, 1e-15));
  EXPECT_THAT(shifted, SE3Near(X, 0.11, 1e-15));
  EXPECT_THAT(shifted, Not(SE3Near(X, 0.09, 1.0)));
  EXPECT_THAT(turned, SE3Near(X, 0.0, 0.11));
  EXPECT_THAT(turned, Not(SE3Near(X, 1.0, 0.09)));
  EXPECT_THAT(SE3(X.rotation(), {kNan, 0, 0}), Not(SE3Near(X, 1e9, 1e9)));
  EXPECT_THAT(explanation(SE3Near(X, 0.0, 0.0), shifted), HasSubstr("0.1 m"));
  EXPECT_THAT(turned.rotation(), SO3Near(X.rotation(), 0.11));
  EXPECT_THAT(turned.rotation(), Not(SO3Near(X.rotation(), 0.09)));
  EXPECT_THAT(explanation(SO3Near(X.rotation(), 0.0), turned.rotation()), HasSubstr("0.1 rad"));
}

TEST(GeometryMatchers, PlanarPosesNearInBothParts) {
  const SE2 X(1, 2, 3.1);
  EXPECT_THAT(SE2(1, 2.1, 3.1), SE2Near(X, 0.11, 1e-15));
  EXPECT_THAT(SE2(1, 2.1, 3.1), Not(SE2Near(X, 0.09, 1.0)));
  EXPECT_THAT(SE2(1, 2, 3.2), SE2Near(X, 0.0, 0.11));  // across the discontinuity at pi
  EXPECT_THAT(SE2(1, 2, 3.2), Not(SE2Near(X, 1.0, 0.09)));
  EXPECT_THAT(SE2(1, 2, 3.0), Not(SE2Near(X, 1.0, 0.09)));  // in either direction
}

TEST(GeometryMatchers, GroupNearComparesTheVelocityToo) {
  const SE23 X(SO3(), {1, 2, 3}, {4, 5, 6});
  EXPECT_THAT(X, GroupNear(X, 0.0));
  EXPECT_THAT(SE23(SO3(), {1, 2, 3}, {4, 5, 6.1}), GroupNear(X, 0.11));
  EXPECT_THAT(SE23(SO3(), {1, 2, 3}, {4, 5, 6.1}), Not(GroupNear(X, 0.09)));
}

}  // namespace
}  // namespace waymark::testing
