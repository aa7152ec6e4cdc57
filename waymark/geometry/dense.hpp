#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace waymark {

/// Dense linear algebra with templates that are instantiated only in dense.cpp, because Eigen's
/// decompositions take seconds to compile in every file that uses them. Only the sizes instantiated there are
/// available.

/// The decomposition A = V diag(values) V^T of a symmetric matrix A; only the lower triangle is read.
template <int N>
struct SymmetricEigen {
  Eigen::Matrix<double, N, 1> values;   ///< in ascending order
  Eigen::Matrix<double, N, N> vectors;  ///< orthonormal, one per column
  bool converged = false;               ///< false if A is not finite
};

/// N may be 1, 3, 4, 6, 8 or 9. O(N^3); see Golub and Van Loan, "Matrix Computations", section 8.3.
template <int N>
[[nodiscard]] SymmetricEigen<N> symmetric_eigen(const Eigen::Matrix<double, N, N>& A);

/// Only the eigenvalues, in ascending order. N may be 2 or 3.
template <int N>
[[nodiscard]] Eigen::Matrix<double, N, 1> symmetric_eigenvalues(const Eigen::Matrix<double, N, N>& A);

/// The smallest rotation that turns the direction of `from` to that of `to` (both of any non-zero length).
/// For opposite directions, the axis is an arbitrary one perpendicular to them.
[[nodiscard]] Eigen::Quaterniond rotation_between(const Eigen::Vector3d& from, const Eigen::Vector3d& to);

/// A B and A^T B for matrices of any size. O(rows inner columns).
[[nodiscard]] Eigen::MatrixXd product(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B);
[[nodiscard]] Eigen::MatrixXd transposed_product(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B);

/// The solution of A X = B for a symmetric matrix A of any size, by L D L^T factorisation with pivoting
/// (Golub and Van Loan, section 4.2.9). Only the lower triangle is read.
struct SymmetricSolution {
  Eigen::MatrixXd X{};
  bool positive = false;  ///< whether A is finite and positive semidefinite; if not, X is empty
};
[[nodiscard]] SymmetricSolution solve_symmetric(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B);

/// The factorisation A = L L^T of a symmetric positive definite matrix A of any size; only the lower triangle
/// is read.
class Cholesky {
 public:
  explicit Cholesky(const Eigen::MatrixXd& A);

  [[nodiscard]] bool positive() const { return positive_; }
  /// A^-1 B. Requires positive().
  [[nodiscard]] Eigen::MatrixXd solve(const Eigen::MatrixXd& B) const;
  /// L^-1, which whitens a vector with covariance A. Requires positive().
  [[nodiscard]] Eigen::MatrixXd whitening() const;

 private:
  Eigen::MatrixXd L_{};
  bool positive_ = false;
};

}  // namespace waymark
