#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "waymark/mapping/solver/block_system.hpp"
#include "waymark/mapping/solver/front_kernels.hpp"

namespace waymark::internal {

/// Elimination order for a symmetric block system, and the grouping of its unknowns into fronts. A front is a
/// small dense matrix whose Schur complement is added to its parent (Liu, "The Multifrontal Method for Sparse
/// Matrix Solution: Theory and Practice", SIAM Review 34(1), 1992).
struct FrontPlan {
  struct Front {
    std::vector<int> unknowns{};  ///< the unknowns eliminated here, then the later unknowns coupled to them
    std::vector<int> offsets{};   ///< first scalar of each unknown within the front
    int own = 0;                  ///< number of unknowns eliminated here
    int own_size = 0, size = 0;   ///< number of scalars eliminated here, and in total
    int parent = -1;
    /// Whether it is the first of its parent's children, in the order of the fronts.
    bool first_child = false;
  };
  /// Children come before their parents, and the heaviest child of each parent comes first.
  std::vector<Front> fronts{};
  std::vector<int> front_of{};  ///< the front in which each unknown is eliminated
};

/// Eliminates the blocks in their elimination_order(). A front that passes nearly all of its rows to its
/// parent is merged with it. O(entries of the factor).
[[nodiscard]] FrontPlan front_plan(const BlockSystem& system);

/// Multifrontal Cholesky factor of the normal equations of a block system. The dense fronts determine time
/// and memory: both are O(unknowns) for a chain; for a grid, they are O(unknowns^1.5) and O(unknowns log
/// unknowns), respectively.
class FrontCholesky {
 public:
  /// If `kernels` is nullptr, uses the fastest kernels that this processor supports.
  FrontCholesky(const BlockSystem& system, const FrontPlan& plan, const FrontKernels* kernels = nullptr);

  /// Factorises H + damping diag(H) + floor I; returns false if this matrix is not positive definite.
  [[nodiscard]] bool factorize(double damping, double floor);
  /// The solution for a right-hand side in the order of the block system.
  [[nodiscard]] Eigen::VectorXd solve(const Eigen::VectorXd& rhs) const;
  /// Blocks (row, column) of the inverse, for pairs of unknowns that are equal or share a residual
  /// (Takahashi, Fagan and Chin, "Formation of a sparse bus impedance matrix", 1973, applied to fronts).
  /// Costs about as much as one more factorisation.
  [[nodiscard]] std::vector<Eigen::MatrixXd> inverse_blocks(
      std::span<const std::pair<int, int>> wanted) const;
  /// Calls `visit(i, block)` for each element of `wanted`, in any order, instead of storing all blocks. A
  /// block is valid until the call returns.
  using BlockVisitor = std::function<void(std::size_t i, const Eigen::Ref<const Eigen::MatrixXd>& block)>;
  void visit_inverse_blocks(std::span<const std::pair<int, int>> wanted, const BlockVisitor& visit) const;

 private:
  using Matrix = Eigen::MatrixXd;
  class Stack;

  void assemble(std::size_t front, double damping, double floor, const std::vector<int>& place,
                Eigen::Map<Matrix>& F) const;
  /// A run of rows of a front that are consecutive in its parent, too. Rows of both are in elimination order.
  struct Run {
    /// First scalar after the front's own, first scalar in the parent, number of scalars.
    int from = 0, to = 0, size = 0;
  };
  [[nodiscard]] std::vector<Run> runs_in_parent(std::size_t child, const std::vector<int>& place) const;
  void add_update(std::size_t child, const Stack& updates, const std::vector<int>& place,
                  Eigen::Map<Matrix>& F) const;
  /// Copies the part of the inverse that a front shares with its parent.
  void copy_known(std::size_t front, const Stack& inverses, const std::vector<int>& place,
                  Eigen::Map<Matrix>& Z) const;
  /// The factor's columns that are eliminated in a front, with all rows; the part above the diagonal is
  /// undefined.
  [[nodiscard]] Eigen::Map<const Matrix> columns(std::size_t front) const;
  /// The largest number of values on the stack, which contains updates for parents that have not been
  /// processed yet, or inverses for children.
  [[nodiscard]] std::size_t largest_stack_of_updates() const;
  [[nodiscard]] std::size_t largest_stack_of_inverses() const;

  const BlockSystem& system_;
  const FrontPlan& plan_;
  const FrontKernels& kernels_;
  std::vector<std::vector<std::pair<int, int>>>
      blocks_{};  ///< blocks of H for each front: (row, column) with row >= column
  std::vector<std::vector<std::size_t>> children_{};
  std::vector<std::size_t> first_{};  ///< start of each front's columns in L_, followed by the end
  int largest_ = 0;                   ///< size of the largest front in scalars
  Eigen::VectorXd L_{};               ///< columns() of all fronts, one after the other
};

/// -(H + damping diag(H))^-1 g; empty if the matrix is not positive definite.
[[nodiscard]] std::optional<Eigen::VectorXd> damped_step(FrontCholesky& cholesky, const BlockSystem& system,
                                                         double damping);

/// A factor of normal equations that is reused for later, similar equations with the same unknowns. These are
/// solved by conjugate gradients, preconditioned by the factor (Hestenes and Stiefel, "Methods of Conjugate
/// Gradients for Solving Linear Systems", J. Res. NBS 49(6), 1952). Weights and poses change little from step
/// to step of a search, and a factorisation may cost as much as a hundred iterations of conjugate gradients.
class KeptFactor {
 public:
  /// Computes -(H + damping diag(H))^-1 g, accurate to a thousandth of the step's gain or to
  /// `negligible_gain`. Empty if the matrix is not positive definite. Factorises again if conjugate gradients
  /// with the stored factor do not converge quickly.
  [[nodiscard]] std::optional<Eigen::VectorXd> step(const BlockSystem& system, double damping,
                                                    double negligible_gain = 0);
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

/// Whether a factorisation is so much more expensive than a product with the matrix that reusing it pays off.
[[nodiscard]] bool worth_keeping(const FrontPlan& plan, const BlockSystem& system);

}  // namespace waymark::internal
