#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>

#include "waymark/mapping/block_system.hpp"

namespace waymark::internal {

/// Entries of A^-1 where the Cholesky factor of A is not zero, which holds all entries of A and its diagonal
/// blocks.
class SelectedInverse {
 public:
  /// Of the factorised matrix P A P^T = L D L^T. O(sum of squares of the column counts of L).
  explicit SelectedInverse(const BlockSystem::Cholesky& cholesky);

  /// A^-1 (rows first … first + size) of the diagonal block; entries outside the pattern of L, which cannot
  /// occur within a block of unknowns that share a residual, are 0.
  [[nodiscard]] Eigen::MatrixXd block(int first, int size) const;

 private:
  [[nodiscard]] double at(int row, int column) const;

  Eigen::SparseMatrix<double> L_;  ///< pattern and, below the diagonal, entries of L
  std::vector<double> Z_;          ///< entries of the inverse at the places of L
  Eigen::VectorXd diagonal_;
  Eigen::VectorXi permutation_;
};

}  // namespace waymark::internal
