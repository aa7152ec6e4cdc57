#include "waymark/geometry/dense.hpp"

#include <cassert>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

namespace waymark {

namespace {

/// Holds any size up to 9 x 9 without heap allocation, so the decomposition is compiled only once for all
/// sizes.
using Bounded = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 9, 9>;
using BoundedSolver = Eigen::SelfAdjointEigenSolver<Bounded>;

BoundedSolver decomposed(const Bounded& A, int options) {
  BoundedSolver solver(A.rows());
  solver.compute(A, options);
  return solver;
}

}  // namespace

template <int N>
SymmetricEigen<N> symmetric_eigen(const Eigen::Matrix<double, N, N>& A) {
  const BoundedSolver solver = decomposed(A, Eigen::ComputeEigenvectors);
  return {solver.eigenvalues(), solver.eigenvectors(), solver.info() == Eigen::Success};
}

template SymmetricEigen<1> symmetric_eigen<1>(const Eigen::Matrix<double, 1, 1>&);
template SymmetricEigen<3> symmetric_eigen<3>(const Eigen::Matrix<double, 3, 3>&);
template SymmetricEigen<4> symmetric_eigen<4>(const Eigen::Matrix<double, 4, 4>&);
template SymmetricEigen<6> symmetric_eigen<6>(const Eigen::Matrix<double, 6, 6>&);
template SymmetricEigen<8> symmetric_eigen<8>(const Eigen::Matrix<double, 8, 8>&);
template SymmetricEigen<9> symmetric_eigen<9>(const Eigen::Matrix<double, 9, 9>&);

template <int N>
Eigen::Matrix<double, N, 1> symmetric_eigenvalues(const Eigen::Matrix<double, N, N>& A) {
  return decomposed(A, Eigen::EigenvaluesOnly).eigenvalues();
}

template Eigen::Matrix<double, 2, 1> symmetric_eigenvalues<2>(const Eigen::Matrix<double, 2, 2>&);
template Eigen::Matrix<double, 3, 1> symmetric_eigenvalues<3>(const Eigen::Matrix<double, 3, 3>&);

Eigen::Quaterniond rotation_between(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  return Eigen::Quaterniond::FromTwoVectors(from, to);
}

Eigen::MatrixXd product(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B) {
  assert(A.cols() == B.rows());
  return A * B;
}

Eigen::MatrixXd transposed_product(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B) {
  assert(A.rows() == B.rows());
  return A.transpose() * B;
}

SymmetricSolution solve_symmetric(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B) {
  assert(A.rows() == A.cols() && A.cols() == B.rows());
  const Eigen::LDLT<Eigen::MatrixXd> factor(A);
  if (factor.info() != Eigen::Success || !factor.isPositive()) return {};
  return {factor.solve(B), true};
}

Cholesky::Cholesky(const Eigen::MatrixXd& A) {
  assert(A.rows() == A.cols());
  const Eigen::LLT<Eigen::MatrixXd> factor(A);
  positive_ = factor.info() == Eigen::Success;
  L_ = factor.matrixL();
}

Eigen::MatrixXd Cholesky::solve(const Eigen::MatrixXd& B) const {
  assert(positive_ && L_.cols() == B.rows());
  Eigen::MatrixXd X = B;
  L_.triangularView<Eigen::Lower>().solveInPlace(X);
  L_.triangularView<Eigen::Lower>().adjoint().solveInPlace(X);
  return X;
}

Eigen::MatrixXd Cholesky::whitening() const {
  assert(positive_);
  Eigen::MatrixXd inverse = Eigen::MatrixXd::Identity(L_.rows(), L_.cols());
  L_.triangularView<Eigen::Lower>().solveInPlace(inverse);
  return inverse;
}

}  // namespace waymark
