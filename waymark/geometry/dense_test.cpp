#include "waymark/geometry/dense.hpp"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "waymark/base/random.hpp"

namespace waymark {
namespace {

Eigen::MatrixXd drawn(Random& random, Eigen::Index rows, Eigen::Index columns) {
  return Eigen::MatrixXd::NullaryExpr(rows, columns, [&] { return random.normal(); });
}

template <int N>
void expect_decomposition(Random& random) {
  using Matrix = Eigen::Matrix<double, N, N>;
  const Matrix J = drawn(random, N, N);
  const Matrix A = J + J.transpose();
  Matrix lower = A;
  lower.template triangularView<Eigen::StrictlyUpper>().setConstant(7);  // this part is not read
  const SymmetricEigen<N> of = symmetric_eigen<N>(lower);
  ASSERT_TRUE(of.converged);
  EXPECT_LT((of.vectors * of.values.asDiagonal() * of.vectors.transpose() - A).norm(), 1e-13 * A.norm());
  EXPECT_LT((of.vectors.transpose() * of.vectors - Matrix::Identity()).norm(), 1e-13);
  for (int i = 1; i < N; ++i) EXPECT_LE(of.values[i - 1], of.values[i]);
}

TEST(Dense, EigenvectorsReconstructTheMatrix) {
  Random random(1);
  for (int i = 0; i < 50; ++i) {
    expect_decomposition<1>(random);
    expect_decomposition<3>(random);
    expect_decomposition<4>(random);
    expect_decomposition<6>(random);
    expect_decomposition<8>(random);
    expect_decomposition<9>(random);
  }
}

TEST(Dense, EigenvaluesMatchTraceAndDeterminant) {
  Random random(2);
  for (int i = 0; i < 50; ++i) {
    const Eigen::Matrix3d J = drawn(random, 3, 3);
    const Eigen::Matrix3d A = J + J.transpose();
    const Eigen::Vector3d values = symmetric_eigenvalues<3>(A);
    EXPECT_NEAR(values.sum(), A.trace(), 1e-13 * A.norm());
    EXPECT_NEAR(values.prod(), A.determinant(), 1e-12 * std::pow(A.norm(), 3));
    const Eigen::Vector2d two = symmetric_eigenvalues<2>(A.topLeftCorner<2, 2>());
    EXPECT_NEAR(two.prod(), A.topLeftCorner(2, 2).determinant(), 1e-13 * A.squaredNorm());
  }
}

TEST(Dense, EigenvaluesOfANonFiniteMatrixDoNotConverge) {
  Eigen::Matrix3d A = Eigen::Matrix3d::Identity();
  A(1, 0) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(symmetric_eigen<3>(A).converged);
}

TEST(Dense, RotationBetweenMapsOneDirectionToTheOther) {
  Random random(3);
  for (int i = 0; i < 100; ++i) {
    const Eigen::Vector3d from = drawn(random, 3, 1);
    const Eigen::Vector3d to =
        i % 10 == 0 ? Eigen::Vector3d(-2 * from) : Eigen::Vector3d(drawn(random, 3, 1));
    const Eigen::Quaterniond turn = rotation_between(from, to);
    EXPECT_LT((turn * from.normalized() - to.normalized()).norm(), 1e-7);
    const double angle_rad = std::atan2(from.cross(to).norm(), from.dot(to));
    EXPECT_NEAR(Eigen::AngleAxisd(turn).angle(), angle_rad, 1e-7);
  }
}

TEST(Dense, ProductsMatchEigen) {
  Random random(4);
  const Eigen::MatrixXd A = drawn(random, 40, 17);
  const Eigen::MatrixXd B = drawn(random, 17, 23);
  EXPECT_LT((product(A, B) - A.lazyProduct(B)).norm(), 1e-12);
  EXPECT_LT((transposed_product(A, A) - A.transpose().lazyProduct(A)).norm(), 1e-12);
}

TEST(Dense, ASymmetricSystemIsSolvedOrRejected) {
  Random random(5);
  const Eigen::MatrixXd J = drawn(random, 30, 12);
  Eigen::MatrixXd A = J.transpose() * J;
  const Eigen::MatrixXd B = drawn(random, 12, 2);
  const SymmetricSolution solution = solve_symmetric(A, B);
  ASSERT_TRUE(solution.positive);
  EXPECT_LT((A * solution.X - B).norm(), 1e-11 * B.norm());
  A(3, 3) = -1;
  EXPECT_FALSE(solve_symmetric(A, B).positive);
}

TEST(Dense, CholeskySolvesAndWhitensOrRejects) {
  Random random(6);
  const Eigen::MatrixXd J = drawn(random, 20, 7);
  Eigen::MatrixXd A = J.transpose() * J;
  const Cholesky factor(A);
  ASSERT_TRUE(factor.positive());
  const Eigen::MatrixXd B = drawn(random, 7, 3);
  EXPECT_LT((A * factor.solve(B) - B).norm(), 1e-11 * B.norm());
  const Eigen::MatrixXd W = factor.whitening();
  EXPECT_LT((W * A * W.transpose() - Eigen::MatrixXd::Identity(7, 7)).norm(), 1e-10);
  A(2, 2) = -1;
  EXPECT_FALSE(Cholesky(A).positive());
}

}  // namespace
}  // namespace waymark
