#include "waymark/pose/pose_refinement.hpp"

#include <limits>

#include <gtest/gtest.h>
#include <Eigen/LU>

#include "tests/support/geometry_matchers.hpp"
#include "tests/support/numeric_jacobian.hpp"
#include "tests/support/tag_views.hpp"

namespace waymark::internal {
namespace {

using testing::MatrixNear;

Matrix6 random_information(Random& random) {
  Matrix6 A;
  for (double& entry : A.reshaped()) entry = random.normal();
  return A * A.transpose() + 0.01 * Matrix6::Identity();
}

CornerCovariance random_corner_covariance(Random& random) {
  CornerCovariance A;
  for (double& entry : A.reshaped()) entry = 0.1 * random.normal();
  return A * A.transpose() + 0.01 * CornerCovariance::Identity();
}

TEST(Cholesky6, SolvesAndInverts) {
  Random random(1);
  for (int trial = 0; trial < 200; ++trial) {
    const Matrix6 A = random_information(random);
    const Vector6 b = Vector6::NullaryExpr([&](Eigen::Index) { return random.normal(); });
    const auto cholesky = Cholesky6::of(A);
    ASSERT_TRUE(cholesky);
    EXPECT_THAT(A * cholesky->solve(b), MatrixNear(b, 1e-9));
    EXPECT_THAT(A * cholesky->inverse(), MatrixNear(Matrix6::Identity(), 1e-9));
    EXPECT_EQ(cholesky->inverse(), cholesky->inverse().transpose()) << "symmetric to the last bit";
  }
}

TEST(Cholesky6, RejectsMatricesThatAreNotPositiveDefinite) {
  Matrix6 singular = Matrix6::Identity();
  singular(5, 5) = 0;
  EXPECT_FALSE(Cholesky6::of(singular));
  Matrix6 rank_one = Vector6::Ones() * Vector6::Ones().transpose();
  EXPECT_FALSE(Cholesky6::of(rank_one));
  EXPECT_FALSE(Cholesky6::of(-Matrix6::Identity()));
  EXPECT_FALSE(Cholesky6::of(Matrix6::Constant(std::numeric_limits<double>::quiet_NaN())));
  EXPECT_FALSE(Cholesky6::of(std::numeric_limits<double>::infinity() * Matrix6::Ones()));
}

TEST(Reprojection, JacobianIsTheDerivative) {
  Random random(2);
  for (const CameraModel& camera :
       {testing::plain_camera(), testing::distorting_camera(), testing::fisheye_camera()}) {
    for (int trial = 0; trial < 50; ++trial) {
      const SE3 cam_T_tag = testing::random_view(random);
      const Corners2 measured = testing::see_tag(camera, testing::random_view(random)).value().corners_px;
      const Eigen::Vector3d pivot(random.normal(), random.normal(), random.normal());
      const auto residuals = [&](const SE3& T, Matrix86& J) {
        Corners3 cam_corners;
        for (std::size_t i = 0; i < 4; ++i) cam_corners[i] = T * testing::tag_corners()[i];
        Vector8 e;
        EXPECT_TRUE(corner_residuals(camera, cam_corners, pivot, measured, e, J));
        return e;
      };
      Matrix86 J, ignored;
      const Vector8 e = residuals(cam_T_tag, J);
      const auto numeric = testing::numeric_jacobian<8, 6>(
          [&](const Vector6& xi) { return residuals(perturbed(xi, cam_T_tag, pivot), ignored); },
          Vector6::Zero().eval(), 1e-4);
      EXPECT_THAT(J, MatrixNear(numeric, 1e-6 * numeric.norm()));
      EXPECT_NEAR((e - residuals(cam_T_tag, ignored)).norm(), 0, 0);
    }
  }
}

// exp at the pivot equals exp of the adjoint tangent at the origin, so the returned covariance is in the
// usual left tangent.
TEST(Reprojection, ThePivotOnlyChangesCoordinates) {
  Random random(3);
  for (int trial = 0; trial < 50; ++trial) {
    const Vector6 xi = Vector6::NullaryExpr([&](Eigen::Index) { return random.normal(); });
    const SE3 T = testing::random_view(random);
    const Eigen::Vector3d pivot(random.normal(), random.normal(), random.normal());
    EXPECT_THAT(perturbed(xi, T, pivot),
                testing::SE3Near(SE3::exp(shift_adjoint(pivot) * xi) * T, 1e-12, 1e-12));
  }
}

TEST(Whitening, MakesTheCovarianceTheIdentity) {
  Random random(4);
  for (int trial = 0; trial < 50; ++trial) {
    const CornerCovariance covariance = random_corner_covariance(random);
    const auto whitening = Whitening::of(covariance);
    ASSERT_TRUE(whitening);
    Matrix86 J;
    for (double& entry : J.reshaped()) entry = random.normal();
    Vector8 e = Vector8::NullaryExpr([&](Eigen::Index) { return random.normal(); });
    const Eigen::LLT<CornerCovariance> llt(covariance);
    const Matrix6 information = J.transpose() * llt.solve(J);
    const double chi2 = e.dot(llt.solve(e));
    double worst = 0;
    for (int i = 0; i < 8; i += 2) {
      worst = std::max(worst, e.segment<2>(i).dot(covariance.block<2, 2>(i, i).inverse() * e.segment<2>(i)));
    }
    EXPECT_NEAR(whitening->worst_corner_chi2(e), worst, 1e-9 * worst);
    whitening->apply(e, J);
    EXPECT_THAT((J.transpose() * J).eval(), MatrixNear(information, 1e-9 * information.norm()));
    EXPECT_NEAR(e.squaredNorm(), chi2, 1e-9 * chi2);
  }
}

TEST(Whitening, IsotropicIsTheDiagonalCovariance) {
  Random random(5);
  const Whitening plain(0.3);
  const Whitening full = Whitening::of(0.09 * CornerCovariance::Identity()).value();
  Vector8 a = Vector8::NullaryExpr([&](Eigen::Index) { return random.normal(); });
  Vector8 b = a;
  EXPECT_NEAR(plain.worst_corner_chi2(a), full.worst_corner_chi2(a), 1e-9);
  Matrix86 Ja = Matrix86::Ones(), Jb = Ja;
  plain.apply(a, Ja);
  full.apply(b, Jb);
  EXPECT_THAT(a, MatrixNear(b, 1e-12));
  EXPECT_THAT(Ja, MatrixNear(Jb, 1e-12));
}

TEST(Whitening, RejectsInvalidCovariances) {
  EXPECT_FALSE(Whitening::of(CornerCovariance::Zero()));
  EXPECT_FALSE(Whitening::of(-CornerCovariance::Identity()));
  CornerCovariance nan = CornerCovariance::Identity();
  nan(3, 3) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(Whitening::of(nan));
}

}  // namespace
}  // namespace waymark::internal
