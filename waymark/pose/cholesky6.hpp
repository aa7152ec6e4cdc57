#pragma once

#include <cmath>
#include <optional>

#include <Eigen/Core>

namespace waymark::internal {

/// Cholesky factorisation A = L L^T of a symmetric 6x6 matrix, for the inner loop of pose refinement. Loops
/// of constant length, which compilers unroll: a third of the time of Eigen's LLT at this size
/// (benchmarks/pose_benchmark.cpp).
class Cholesky6 {
 public:
  using Vector = Eigen::Matrix<double, 6, 1>;
  using Matrix = Eigen::Matrix<double, 6, 6>;

  /// Nothing when A is not positive definite, or not finite. Reads the lower triangle.
  static std::optional<Cholesky6> of(const Matrix& A) {
    Cholesky6 c;
    for (int j = 0; j < 6; ++j) {
      double pivot = A(j, j);
      for (int k = 0; k < j; ++k) pivot -= c.L_(j, k) * c.L_(j, k);
      // Below rounding of what was subtracted there is no information left in this direction.
      if (!(pivot > 1e-15 * A(j, j)) || !std::isfinite(pivot)) return std::nullopt;
      c.L_(j, j) = std::sqrt(pivot);
      c.inverse_diagonal_[j] = 1.0 / c.L_(j, j);
      for (int i = j + 1; i < 6; ++i) {
        double sum = A(i, j);
        for (int k = 0; k < j; ++k) sum -= c.L_(i, k) * c.L_(j, k);
        c.L_(i, j) = sum * c.inverse_diagonal_[j];
      }
    }
    return c;
  }

  [[nodiscard]] Vector solve(Vector b) const {
    for (int i = 0; i < 6; ++i) {
      for (int k = 0; k < i; ++k) b[i] -= L_(i, k) * b[k];
      b[i] *= inverse_diagonal_[i];
    }
    for (int i = 5; i >= 0; --i) {
      for (int k = i + 1; k < 6; ++k) b[i] -= L_(k, i) * b[k];
      b[i] *= inverse_diagonal_[i];
    }
    return b;
  }

  /// A^-1 = L^-T L^-1.
  [[nodiscard]] Matrix inverse() const {
    Matrix M = Matrix::Zero();  // L^-1
    for (int j = 0; j < 6; ++j) {
      M(j, j) = inverse_diagonal_[j];
      for (int i = j + 1; i < 6; ++i) {
        double sum = 0;
        for (int k = j; k < i; ++k) sum -= L_(i, k) * M(k, j);
        M(i, j) = sum * inverse_diagonal_[i];
      }
    }
    return M.transpose().lazyProduct(M);
  }

 private:
  Matrix L_;  ///< only the lower triangle is set
  Vector inverse_diagonal_;
};

}  // namespace waymark::internal
