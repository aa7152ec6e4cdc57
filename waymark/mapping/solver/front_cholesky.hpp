#pragma once

#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "waymark/mapping/solver/block_system.hpp"
#include "waymark/mapping/solver/front_kernels.hpp"

namespace waymark::internal {

/// Elimination order of a symmetric block system, and the grouping of its unknowns into fronts. A front is a
/// small dense matrix whose Schur complement is added to its parent (Liu, "The Multifrontal Method for Sparse
/// Matrix Solution: Theory and Practice", SIAM Review 34(1), 1992).
struct FrontPlan {
  struct Front {
    std::vector<int> unknowns{};  ///< those eliminated here, then later unknowns coupled to them
    std::vector<int> offsets{};   ///< first scalar of each unknown in the front
    int own = 0;                  ///< number of unknowns eliminated here
    int own_size = 0, size = 0;   ///< scalars
    int parent = -1;
    bool first_child = false;  ///< it is the first child of its parent, in the order of the fronts
  };
  std::vector<Front> fronts{};  ///< children before their parents, the heaviest child of each first
  std::vector<int> front_of{};  ///< front in which each unknown is eliminated
};

/// Approximate minimum degree by blocks (Amestoy, Davis and Duff, SIAM J. Matrix Anal. Appl. 17(4), 1996). A
/// front that passes nearly all of its rows to its parent is merged with it. O(entries of the factor).
[[nodiscard]] FrontPlan front_plan(const BlockSystem& system);

/// Multifrontal Cholesky factor of the normal equations of a block system. Time and memory are those of the
/// dense fronts: both O(unknowns) for a chain; O(unknowns^1.5) and O(unknowns log unknowns) for a grid.
class FrontCholesky {
 public:
  /// If `kernels` is nullptr, uses the fastest that this processor supports.
  FrontCholesky(const BlockSystem& system, const FrontPlan& plan, const FrontKernels* kernels = nullptr);

  /// Factorises H + damping diag(H) + floor I; false if that is not positive definite.
  [[nodiscard]] bool factorize(double damping, double floor);
  /// The solution for a right-hand side in the order of the block system.
  [[nodiscard]] Eigen::VectorXd solve(const Eigen::VectorXd& rhs) const;
  /// Blocks (row, column) of the inverse, for unknowns that are equal or share a residual (Takahashi, Fagan
  /// and Chin, "Formation of a sparse bus impedance matrix", 1973, applied to fronts). Costs about as much as
  /// one more factorisation.
  [[nodiscard]] std::vector<Eigen::MatrixXd> inverse_blocks(
      std::span<const std::pair<int, int>> wanted) const;

 private:
  using Matrix = Eigen::MatrixXd;
  class Stack;

  void assemble(std::size_t front, double damping, double floor, const std::vector<int>& place,
                Eigen::Map<Matrix>& F) const;
  /// Consecutive rows of a front that are also consecutive in its parent; both are in elimination order.
  struct Run {
    int from = 0, to = 0, size = 0;  ///< first scalar after the front's own, in the parent; count
  };
  [[nodiscard]] std::vector<Run> runs_in_parent(std::size_t child, const std::vector<int>& place) const;
  void add_update(std::size_t child, const Stack& updates, const std::vector<int>& place,
                  Eigen::Map<Matrix>& F) const;
  /// Copies the part of the parent's inverse that a front shares with it.
  void copy_known(std::size_t front, const Stack& inverses, const std::vector<int>& place,
                  Eigen::Map<Matrix>& Z) const;
  /// Own columns of a front of the factor, with all rows; the part above the diagonal is undefined.
  [[nodiscard]] Eigen::Map<const Matrix> columns(std::size_t front) const;
  /// Largest number of values on the stack of updates waiting for their parents, or of inverses kept for
  /// children.
  [[nodiscard]] std::size_t largest_stack_of_updates() const;
  [[nodiscard]] std::size_t largest_stack_of_inverses() const;

  const BlockSystem& system_;
  const FrontPlan& plan_;
  const FrontKernels& kernels_;
  std::vector<std::vector<std::pair<int, int>>>
      blocks_{};  ///< blocks of H by front: (row, column), row >= column
  std::vector<std::vector<std::size_t>> children_{};
  std::vector<std::size_t> first_{};  ///< start of each front's columns in L_, and the end
  int largest_ = 0;                   ///< size of the largest front in scalars
  Eigen::VectorXd L_{};               ///< columns() of all fronts, one after the other
};

/// -(H + damping diag(H))^-1 g; empty if the matrix is not positive definite.
[[nodiscard]] std::optional<Eigen::VectorXd> damped_step(FrontCholesky& cholesky, const BlockSystem& system,
                                                         double damping);

/// A factor of normal equations that is reused for later, similar ones with the same unknowns. They are
/// solved by conjugate gradients, preconditioned by the factor (Hestenes and Stiefel, "Methods of Conjugate
/// Gradients for Solving Linear Systems", J. Res. NBS 49(6), 1952). Weights and poses change little from step
/// to step of a search, and a factorisation may cost as much as a hundred iterations of conjugate gradients.
class KeptFactor {
 public:
  /// -(H + damping diag(H))^-1 g, within a thousandth of the gain of the step or within `negligible_gain`;
  /// empty if the matrix is not positive definite. Factorises again if conjugate gradients with the stored
  /// factor do not converge quickly.
  [[nodiscard]] std::optional<Eigen::VectorXd> step(const BlockSystem& system, double damping,
                                                    double negligible_gain = 0);
  /// Frees the memory.
  void forget() { factor_.reset(); }

 private:
  struct Factor {
    explicit Factor(const BlockSystem& of);
    BlockSystem system;
    FrontPlan plan;
    FrontCholesky cholesky;
  };

  [[nodiscard]] bool fits(const BlockSystem& system) const;

  std::unique_ptr<Factor> factor_{};
};

/// Whether a factorisation costs so much more than a product with the matrix that reuse pays.
[[nodiscard]] bool worth_keeping(const FrontPlan& plan, const BlockSystem& system);

}  // namespace waymark::internal
