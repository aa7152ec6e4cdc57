#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace waymark {

/// Dense algebra whose templates are instantiated once, in dense.cpp, because Eigen's decompositions take
/// seconds to compile in every file that uses them. Only the sizes instantiated there are available.

/// The decomposition A = V diag(values) V^T of a symmetric A; only the lower triangle is read.
template <int N>
struct SymmetricEigen {
  Eigen::Matrix<double, N, 1> values;   ///< ascending
  Eigen::Matrix<double, N, N> vectors;  ///< orthonormal, one per column
  bool converged = false;               ///< false if A is not finite
};

/// N: 1, 3, 4, 6, 8, 9. O(N^3); Golub and Van Loan, "Matrix Computations", section 8.3.
template <int N>
[[nodiscard]] SymmetricEigen<N> symmetric_eigen(const Eigen::Matrix<double, N, N>& A);

/// The eigenvalues alone, ascending. N: 2, 3.
template <int N>
[[nodiscard]] Eigen::Matrix<double, N, 1> symmetric_eigenvalues(const Eigen::Matrix<double, N, N>& A);

/// The rotation by the smallest angle that turns the direction of `from` to that of `to` (any non-zero
/// lengths). For opposite directions, it is about an arbitrary axis perpendicular to them.
[[nodiscard]] Eigen::Quaterniond rotation_between(const Eigen::Vector3d& from, const Eigen::Vector3d& to);

/// A B and A^T B of matrices of any size. O(rows inner columns).
[[nodiscard]] Eigen::MatrixXd product(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B);
[[nodiscard]] Eigen::MatrixXd transposed_product(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B);

/// Solves A X = B for a symmetric A of any size by L D L^T with pivoting; only the lower triangle is read
/// (Golub and Van Loan, section 4.2.9).
struct SymmetricSolution {
  Eigen::MatrixXd X{};
  bool positive = false;  ///< whether A is finite and positive semidefinite; X is empty if not
};
[[nodiscard]] SymmetricSolution solve_symmetric(const Eigen::MatrixXd& A, const Eigen::MatrixXd& B);

/// The factorisation A = L L^T of a symmetric positive definite A of any size; only the lower triangle is
/// read.
class Cholesky {
 public:
  explicit Cholesky(const Eigen::MatrixXd& A);

  [[nodiscard]] bool positive() const { return positive_; }
  /// A^-1 B. Only if positive().
  [[nodiscard]] Eigen::MatrixXd solve(const Eigen::MatrixXd& B) const;
  /// L^-1, which whitens a vector with the covariance A. Only if positive().
  [[nodiscard]] Eigen::MatrixXd whitening() const;

 private:
  Eigen::MatrixXd L_{};
  bool positive_ = false;
};

}  // namespace waymark
