// Tests properties specific to rotations in space: quaternions, matrices, roll-pitch-yaw, and the angle pi.
#include "waymark/geometry/se3.hpp"

#include <limits>
#include <numbers>
#include <optional>

#include <gtest/gtest.h>
#include <Eigen/LU>
#include <Eigen/SVD>

#include "tests/support/geometry_matchers.hpp"
#include "tests/support/geometry_samples.hpp"
#include "tests/support/golden_page.hpp"

namespace waymark {
namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;
using testing::MatrixNear;
using testing::SO3Near;

constexpr double kHalfTurn = std::numbers::pi;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();

Vector3d random_axis(Random& random) { return testing::random_tangent<SO3>(random, 1.0, 1.0); }

Matrix3d random_matrix(Random& random) {
  return Matrix3d::NullaryExpr([&] { return random.normal(); });
}

TEST(SO3, MatrixRotatesAboutTheAxisByTheRightHand) {
  const SO3 quarter = SO3::exp({0, 0, kHalfTurn / 2});
  EXPECT_THAT(quarter * Vector3d::UnitX(), MatrixNear(Vector3d(Vector3d::UnitY()), 1e-15));
  EXPECT_THAT(SO3::hat({1, 2, 3}) * Vector3d(4, 5, 6),
              MatrixNear(Vector3d(1, 2, 3).cross(Vector3d(4, 5, 6)), 0.0));
  Random random(31);
  for (int i = 0; i < 50; ++i) {  // Rodrigues' formula as implemented in Eigen
    const Vector3d axis = random_axis(random);
    const double angle = random.uniform(0, 2 * kHalfTurn);
    EXPECT_THAT(SO3::exp(angle * axis).matrix(),
                MatrixNear(Eigen::AngleAxisd(angle, axis).toRotationMatrix(), 1e-15));
  }
}

TEST(SO3, LogNearPiKeepsItsDigits) {
  Random random(32);
  for (int i = 0; i < 50; ++i) {
    const Vector3d axis = random_axis(random);
    for (const double gap : {1e-3, 1e-6, 1e-9, 1e-12, 1e-14}) {
      EXPECT_THAT(SO3::exp((kHalfTurn - gap) * axis).log(),
                  MatrixNear(((kHalfTurn - gap) * axis).eval(), 2e-15))
          << gap;
      // Beyond pi, the shorter rotation is in the opposite direction.
      EXPECT_THAT(SO3::exp((kHalfTurn + gap) * axis).log(),
                  MatrixNear((-(kHalfTurn - gap) * axis).eval(), 4e-15))
          << gap;
      EXPECT_THAT(SO3::from_matrix(SO3::exp((kHalfTurn - gap) * axis).matrix()).log().cwiseAbs().eval(),
                  MatrixNear(((kHalfTurn - gap) * axis).cwiseAbs().eval(), 4e-15));
    }
  }
}

TEST(SO3, LogAtExactlyPiTakesThePositiveAxis) {
  const Matrix3d half_turn_x = Vector3d(1, -1, -1).asDiagonal();
  const Matrix3d half_turn_y = Vector3d(-1, 1, -1).asDiagonal();
  const Matrix3d half_turn_z = Vector3d(-1, -1, 1).asDiagonal();
  EXPECT_EQ(SO3::from_matrix(half_turn_x).log(), Vector3d(kHalfTurn, 0, 0));
  EXPECT_EQ(SO3::from_matrix(half_turn_y).log(), Vector3d(0, kHalfTurn, 0));
  EXPECT_EQ(SO3::from_matrix(half_turn_z).log(), Vector3d(0, 0, kHalfTurn));
  Random random(33);
  for (int i = 0; i < 50; ++i) {
    const Vector3d axis = random_axis(random);
    const SO3 X = SO3::from_quaternion({0, axis.x(), axis.y(), axis.z()});
    const SO3 same = SO3::from_quaternion({-0.0, -axis.x(), -axis.y(), -axis.z()});
    const double sign = axis.x() > 0 ? 1 : -1;
    EXPECT_EQ(X, same);
    EXPECT_THAT(X.log(), MatrixNear((sign * kHalfTurn * axis).eval(), 1e-15));
    EXPECT_DOUBLE_EQ(X.angle(), kHalfTurn);
    EXPECT_THAT(X * X, SO3Near(SO3(), 1e-15));
    EXPECT_THAT(SO3::exp(X.log()), SO3Near(X, 1e-15));
  }
}

TEST(SO3, BothSignsOfAQuaternionCompareEqual) {
  Random random(34);
  for (int i = 0; i < 100; ++i) {
    const Quaterniond q(random.normal(), random.normal(), random.normal(), random.normal());
    const SO3 X = SO3::from_quaternion(q), Y = SO3::from_quaternion(Quaterniond(-q.coeffs()));
    EXPECT_EQ(X, Y);
    EXPECT_GE(X.quaternion().w(), 0);
    EXPECT_NEAR(X.quaternion().norm(), 1, 5e-16);
    EXPECT_THAT(X.matrix(), MatrixNear(q.normalized().toRotationMatrix(), 2e-15));
    EXPECT_GE((X * Y).quaternion().w(), 0);
    EXPECT_GE(X.inverse().quaternion().w(), 0);
  }
  EXPECT_EQ(SO3::from_quaternion({1e-200, 0, 0, 0}), SO3());
  EXPECT_EQ(SO3::from_quaternion({-1e200, 0, 0, 0}), SO3());
}

TEST(SO3, MatrixRoundTripEverywhere) {
  for (const auto& xi : testing::critical_tangents<SO3>(35)) {
    const SO3 X = SO3::exp(xi);
    EXPECT_THAT(SO3::from_matrix(X.matrix()), SO3Near(X, 2e-15)) << xi.transpose();
    if (xi.norm() < 1) {
      EXPECT_LE((SO3::from_matrix(X.matrix()).log() - xi).norm(), 1e-14 * xi.norm()) << xi.transpose();
    }
  }
}

// The solution of Arun, Huang and Blostein by SVD, as an oracle for the quaternion method.
TEST(SO3, FromMatrixIsTheNearestRotation) {
  Random random(36);
  for (int i = 0; i < 200; ++i) {
    const SO3 X = testing::random_element<SO3>(random, kHalfTurn);
    const Matrix3d noisy = X.matrix() + random.uniform(0, 0.3) * random_matrix(random);
    const Eigen::JacobiSVD<Matrix3d> svd(noisy, Eigen::ComputeFullU | Eigen::ComputeFullV);
    const double sign = (svd.matrixU() * svd.matrixV().transpose()).determinant();
    const Matrix3d nearest = svd.matrixU() * Vector3d(1, 1, sign).asDiagonal() * svd.matrixV().transpose();
    const double gap = svd.singularValues()[1] + sign * svd.singularValues()[2];  // conditioning
    EXPECT_THAT(SO3::from_matrix(noisy).matrix(), MatrixNear(nearest, 1e-14 / gap));
  }
}

TEST(SO3, TryFromMatrixRejectsInvalidMatrices) {
  Matrix3d R = SO3::exp({0.1, -0.2, 0.3}).matrix();
  EXPECT_THAT(SO3::try_from_matrix(R).value(), SO3Near(SO3::exp({0.1, -0.2, 0.3}), 1e-15));
  EXPECT_TRUE(SO3::try_from_matrix(R * 1.0001).has_value());  // rounding error as in a text file

  const auto code = [](const Matrix3d& m) {
    const auto result = SO3::try_from_matrix(m);
    return result ? std::optional<ErrorCode>() : result.error().code;
  };
  for (const Matrix3d& bad :
       {Matrix3d(R * 1.1), Matrix3d(Matrix3d::Zero()), Matrix3d(R * 1e200), Matrix3d(-R)})
    EXPECT_EQ(code(bad), ErrorCode::InvalidArgument) << bad;
  testing::expect_on_page("pose", SO3::try_from_matrix(R * 1.1).error());
  testing::expect_on_page("pose", SO3::try_from_matrix(-R).error());
  EXPECT_NE(SO3::try_from_matrix(R * 1.1).error().message, SO3::try_from_matrix(-R).error().message);
  for (const double bad : {kNan, kInf, -kInf}) {
    Matrix3d broken = R;
    broken(1, 2) = bad;
    EXPECT_EQ(code(broken), ErrorCode::InvalidArgument);
    EXPECT_NE(SO3::try_from_matrix(broken).error().message, SO3::try_from_matrix(-R).error().message);
  }
}

TEST(SE3, TryFromMatrixRejectsInvalidMatrices) {
  const SE3 X(SO3::exp({0.1, -0.2, 0.3}), {1, 2, 3});
  EXPECT_THAT(SE3::try_from_matrix(X.matrix()).value(), testing::SE3Near(X, 0.0, 1e-15));
  const auto code = [](const Eigen::Matrix4d& m) {
    const auto result = SE3::try_from_matrix(m);
    return result ? std::optional<ErrorCode>() : result.error().code;
  };
  EXPECT_EQ(code(X.matrix().transpose()), ErrorCode::InvalidArgument);
  EXPECT_EQ(code(Eigen::Matrix4d::Zero()), ErrorCode::InvalidArgument);
  testing::expect_on_page("pose", SE3::try_from_matrix(X.matrix().transpose()).error());
  Eigen::Matrix4d stretched = X.matrix();
  stretched.col(0) *= 2;
  EXPECT_EQ(code(stretched), ErrorCode::InvalidArgument);
  for (int i = 0; i < 16; ++i) {
    Eigen::Matrix4d broken = X.matrix();
    broken.data()[i] = kNan;
    EXPECT_EQ(code(broken), ErrorCode::InvalidArgument);
  }
}

TEST(SO3, TryFromQuaternionRejectsInvalidQuaternions) {
  const Quaterniond q = SO3::exp({0.1, -0.2, 0.3}).quaternion();
  EXPECT_THAT(SO3::try_from_quaternion(q).value(), SO3Near(SO3::exp({0.1, -0.2, 0.3}), 1e-15));
  const auto message = [](const Quaterniond& x) {
    const auto result = SO3::try_from_quaternion(x);
    return result ? std::string("accepted") : to_string(result.error());
  };
  EXPECT_THAT(message(Quaterniond(0, 0, 0, 0)), ::testing::HasSubstr("length 0"));
  EXPECT_THAT(message(Quaterniond(2, 0, 0, 0)), ::testing::HasSubstr("length 2"));
  EXPECT_THAT(message(Quaterniond(1e300, 1e300, 0, 0)), ::testing::HasSubstr("length 1.41421e+300"));
  for (const double bad : {kNan, kInf, -kInf}) {
    const auto broken = SO3::try_from_quaternion(Quaterniond(1, bad, 0, 0));
    ASSERT_FALSE(broken);
    EXPECT_EQ(broken.error().code, ErrorCode::InvalidArgument);
  }
}

TEST(SO3, RollPitchYawAreAboutFixedAxes) {
  EXPECT_THAT(SO3::from_rpy(0.3, 0, 0), SO3Near(SO3::exp({0.3, 0, 0}), 1e-15));
  EXPECT_THAT(SO3::from_rpy(0, 0.3, 0), SO3Near(SO3::exp({0, 0.3, 0}), 1e-15));
  EXPECT_THAT(SO3::from_rpy(0, 0, 0.3), SO3Near(SO3::exp({0, 0, 0.3}), 1e-15));
  EXPECT_THAT(SO3::from_rpy(0.1, 0.2, 0.3),
              SO3Near(SO3::exp({0, 0, 0.3}) * SO3::exp({0, 0.2, 0}) * SO3::exp({0.1, 0, 0}), 1e-15));
  Random random(37);
  for (int i = 0; i < 100; ++i) {
    const Vector3d rpy(random.uniform(-kHalfTurn, kHalfTurn), random.uniform(-1.55, 1.55),
                       random.uniform(-kHalfTurn, kHalfTurn));
    EXPECT_THAT(SO3::from_rpy(rpy[0], rpy[1], rpy[2]).rpy(), MatrixNear(rpy, 1e-13));
  }
}

TEST(SO3, RollPitchYawRoundTripAtGimbalLockToo) {
  Random random(38);
  for (const double gap : {1e-3, 1e-6, 1e-8, 1e-12, 1e-15, 0.0}) {
    for (const double sign : {1.0, -1.0}) {
      const SO3 X = SO3::from_rpy(random.uniform(-kHalfTurn, kHalfTurn), sign * (kHalfTurn / 2 - gap),
                                  random.uniform(-kHalfTurn, kHalfTurn));
      const Vector3d rpy = X.rpy();
      EXPECT_TRUE(rpy.allFinite());
      EXPECT_THAT(SO3::from_rpy(rpy[0], rpy[1], rpy[2]), SO3Near(X, 1e-14)) << gap;
    }
  }
  const Matrix3d nose_down = (Matrix3d() << 0, 0, 1, 0, 1, 0, -1, 0, 0).finished();
  EXPECT_THAT(SO3::from_matrix(nose_down).rpy()[1], ::testing::DoubleNear(kHalfTurn / 2, 1e-15));
}

}  // namespace
}  // namespace waymark
