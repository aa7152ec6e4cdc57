// Tests the conversion between a camera and its parameters, and derivatives with respect to the parameters.
#include "waymark/camera/intrinsics.hpp"

#include <gtest/gtest.h>

#include "tests/support/numeric_jacobian.hpp"
#include "waymark/base/random.hpp"

namespace waymark {
namespace {

std::vector<CameraModel> cameras() {
  std::vector<CameraModel> all;
  PinholeRadtan pinhole{.fx = 442, .fy = 444, .cx = 323, .cy = 247};
  const std::array<double, 8> k = {0.05, -0.08, 1e-3, -2e-3, 0.01, 0.03, -0.02, 0.004};
  for (const int n : {0, 4, 5, 8}) {
    pinhole.coefficients = n;
    pinhole.k = {};
    std::copy_n(k.begin(), n, pinhole.k.begin());
    all.push_back(CameraModel::make(pinhole, 640, 480).value());
  }
  all.push_back(
      CameraModel::make(Equidistant{300, 310, 320, 240, {-0.01, 0.02, -0.005, 0.001}}, 640, 480).value());
  return all;
}

TEST(Intrinsics, ACameraRoundTripsThroughItsParameters) {
  for (const CameraModel& camera : cameras()) {
    const Eigen::VectorXd numbers = intrinsics_of(camera);
    ASSERT_EQ(static_cast<std::size_t>(numbers.size()), intrinsics_names(camera).size());
    ASSERT_LE(numbers.size(), kMaxIntrinsics);
    EXPECT_EQ(with_intrinsics(camera, numbers).value(), camera);
  }
}

TEST(Intrinsics, JacobianAgainstNumeric) {
  Random random(31);
  for (const CameraModel& camera : cameras()) {
    for (int round = 0; round < 20; ++round) {
      const Eigen::Vector3d cam_p(random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(1.5, 4));
      const auto J = intrinsics_jacobian(camera, cam_p);
      ASSERT_TRUE(J);
      const Eigen::VectorXd numbers = intrinsics_of(camera);
      for (Eigen::Index i = 0; i < numbers.size(); ++i) {
        const auto along = [&](double step) {
          Eigen::VectorXd moved = numbers;
          moved[i] += step;
          return Eigen::Vector2d(*with_intrinsics(camera, moved)->project(cam_p));
        };
        EXPECT_LT((testing::numeric_derivative(along, 1e-3) - J->col(i)).norm(),
                  1e-7 * (1 + J->col(i).norm()))
            << intrinsics_names(camera)[static_cast<std::size_t>(i)];
      }
    }
  }
}

TEST(Intrinsics, OnTheAxisOnlyThePrincipalPointMatters) {
  for (const CameraModel& camera : cameras()) {
    const auto J = intrinsics_jacobian(camera, {0, 0, 2});
    ASSERT_TRUE(J && J->allFinite());
    Eigen::MatrixXd expected = Eigen::MatrixXd::Zero(2, J->cols());
    expected(0, 2) = expected(1, 3) = 1;
    EXPECT_LT((*J - expected).norm(), 1e-12);
  }
}

TEST(Intrinsics, ACovarianceIsSymmetricAndPositiveSemidefinite) {
  const Eigen::Vector3d sigma(1e-3, 10, 2);
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  R(0, 1) = R(1, 0) = 1;  // singular, but valid
  const auto covariance = [&] { return IntrinsicsCovariance(sigma.asDiagonal() * R * sigma.asDiagonal()); };
  EXPECT_TRUE(is_covariance(covariance()));
  EXPECT_TRUE(is_covariance(IntrinsicsCovariance::Zero(4, 4)));
  R(1, 2) = R(2, 1) = 0.1;
  EXPECT_FALSE(is_covariance(covariance())) << "inconsistent with the correlation of 1";
  R(0, 2) = 0.1;
  EXPECT_FALSE(is_covariance(covariance())) << "asymmetric";
  R(2, 0) = 0.1;
  EXPECT_TRUE(is_covariance(covariance()));
  EXPECT_FALSE(is_covariance(IntrinsicsCovariance()));
  EXPECT_FALSE(is_covariance(covariance().topRows(2)));
  EXPECT_FALSE(is_covariance(-covariance()));
  IntrinsicsCovariance without_variance = IntrinsicsCovariance::Zero(2, 2);
  without_variance(1, 1) = 1;
  EXPECT_TRUE(is_covariance(without_variance));
  without_variance(0, 1) = without_variance(1, 0) = 0.1;
  EXPECT_FALSE(is_covariance(without_variance));
}

TEST(Intrinsics, RejectsInvalidParameters) {
  for (const CameraModel& camera : cameras()) {
    EXPECT_FALSE(intrinsics_jacobian(camera, {0, 0, -1}) && camera.max_angle_rad() < 1.6);
    Eigen::VectorXd numbers = intrinsics_of(camera);
    numbers[0] = -400;
    EXPECT_FALSE(with_intrinsics(camera, numbers));
    numbers[0] = std::nan("");
    EXPECT_FALSE(with_intrinsics(camera, numbers));
  }
}

}  // namespace
}  // namespace waymark
