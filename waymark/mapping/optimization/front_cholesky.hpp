#pragma once

#include <optional>
#include <span>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "waymark/mapping/optimization/block_system.hpp"
#include "waymark/mapping/optimization/front_plan.hpp"

namespace waymark::internal {

/// Cholesky factor of the normal equations of a block system, by fronts.
class FrontCholesky {
 public:
  FrontCholesky(const BlockSystem& system, const FrontPlan& plan);

  /// Of H + damping diag(H) + floor I; false when that is not positive definite.
  [[nodiscard]] bool factorize(double damping, double floor);
  /// The solution for a right-hand side in the order of the block system.
  [[nodiscard]] Eigen::VectorXd solve(const Eigen::VectorXd& rhs) const;
  /// Blocks (row, column) of the inverse, for unknowns that share a residual or are the same (Takahashi,
  /// Fagan and Chin, "Formation of a sparse bus impedance matrix", 1973, by fronts), at the cost of about one
  /// more factorisation.
  [[nodiscard]] std::vector<Eigen::MatrixXd> inverse_blocks(
      std::span<const std::pair<int, int>> wanted) const;

 private:
  using Matrix = Eigen::MatrixXd;

  void assemble(std::size_t front, double damping, double floor, const std::vector<int>& place,
                Matrix& F) const;
  void add_update(std::size_t child, const Matrix& update, const std::vector<int>& place, Matrix& F) const;
  [[nodiscard]] Matrix inverse_of_front(std::size_t front, const Matrix& of_rows) const;

  const BlockSystem& system_;
  const FrontPlan& plan_;
  std::vector<std::vector<std::pair<int, int>>> blocks_{};  ///< of H by front: (row, column), row >= column
  std::vector<std::vector<std::size_t>> children_{};
  std::vector<Matrix> L_{};  ///< of each front: own columns, below the diagonal
};

/// -(H + damping diag(H))^-1 g; nothing when that is not positive definite.
[[nodiscard]] std::optional<Eigen::VectorXd> damped_step(FrontCholesky& cholesky, const BlockSystem& system,
                                                         double damping);

}  // namespace waymark::internal
