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

/// In which order the unknowns of a symmetric system by blocks are eliminated, and which of them together:
/// fronts, small dense matrices that hand what is left over to their parent (Liu, "The Multifrontal Method
/// for Sparse Matrix Solution: Theory and Practice", SIAM Review 34(1), 1992).
struct FrontPlan {
  struct Front {
    std::vector<int> unknowns{};  ///< those eliminated here, then those coupled to them that are later
    std::vector<int> offsets{};   ///< of each: its first scalar in the front
    int own = 0;                  ///< so many of the unknowns are eliminated here
    int own_size = 0, size = 0;   ///< scalars
    int parent = -1;
    bool first_child = false;  ///< of its parent, in the order of the fronts
  };
  std::vector<Front> fronts{};  ///< children before their parents, the heaviest child of each first
  std::vector<int> front_of{};  ///< where each unknown is eliminated
};

/// Approximate minimum degree by blocks (Amestoy, Davis and Duff, SIAM J. Matrix Anal. Appl. 17(4), 1996);
/// fronts that would hand on nearly all they hold are eliminated with their parent. O(entries of the factor).
[[nodiscard]] FrontPlan front_plan(const BlockSystem& system);

/// Cholesky factor of the normal equations of a block system, by fronts. Time and memory: that of the dense
/// fronts, O(unknowns) for a chain, O(unknowns^1.5) and O(unknowns log unknowns) for a grid.
class FrontCholesky {
 public:
  /// By the quickest kernels unless told otherwise.
  FrontCholesky(const BlockSystem& system, const FrontPlan& plan, const FrontKernels* kernels = nullptr);

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
  class Stack;

  void assemble(std::size_t front, double damping, double floor, const std::vector<int>& place,
                Eigen::Map<Matrix>& F) const;
  /// Rows of a front that lie together in its parent too: both are in the order of elimination.
  struct Run {
    int from = 0, to = 0, size = 0;  ///< first scalar behind the front's own, in the parent; how many
  };
  [[nodiscard]] std::vector<Run> runs_in_parent(std::size_t child, const std::vector<int>& place) const;
  void add_update(std::size_t child, const Stack& updates, const std::vector<int>& place,
                  Eigen::Map<Matrix>& F) const;
  /// Of the parent's inverse, what a front has in common with it.
  void copy_known(std::size_t front, const Stack& inverses, const std::vector<int>& place,
                  Eigen::Map<Matrix>& Z) const;
  /// Of the factor: own columns of a front, all its rows; what is above the diagonal means nothing.
  [[nodiscard]] Eigen::Map<const Matrix> columns(std::size_t front) const;
  /// Numbers that wait for a parent, or are waited for by children, at most.
  [[nodiscard]] std::size_t largest_stack_of_updates() const;
  [[nodiscard]] std::size_t largest_stack_of_inverses() const;

  const BlockSystem& system_;
  const FrontPlan& plan_;
  const FrontKernels& kernels_;
  std::vector<std::vector<std::pair<int, int>>> blocks_{};  ///< of H by front: (row, column), row >= column
  std::vector<std::vector<std::size_t>> children_{};
  std::vector<std::size_t> first_{};  ///< where in L_ the columns of each front begin, and the end
  int largest_ = 0;                   ///< scalars of a front
  Eigen::VectorXd L_{};               ///< columns() of one front after the other
};

/// -(H + damping diag(H))^-1 g; nothing when that is not positive definite.
[[nodiscard]] std::optional<Eigen::VectorXd> damped_step(FrontCholesky& cholesky, const BlockSystem& system,
                                                         double damping);

/// A factor of normal equations that later ones of the same unknowns are solved with, for as long as they are
/// alike: by conjugate gradients, preconditioned by the factor (Hestenes and Stiefel, "Methods of Conjugate
/// Gradients for Solving Linear Systems", J. Res. NBS 49(6), 1952). From step to step of a search weights and
/// poses change little, and a factorisation may cost as much as a hundred steps of conjugate gradients.
class KeptFactor {
 public:
  /// -(H + damping diag(H))^-1 g, to a thousandth of what the step gains or to `next_to_nothing`; nothing
  /// when that is not positive definite. Factorises anew where the factor that is kept does not lead there
  /// soon.
  [[nodiscard]] std::optional<Eigen::VectorXd> step(const BlockSystem& system, double damping,
                                                    double next_to_nothing = 0);
  /// Gives the memory back.
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

/// A factorisation costs so much more than a product with the matrix that it pays to keep it.
[[nodiscard]] bool worth_keeping(const FrontPlan& plan, const BlockSystem& system);

}  // namespace waymark::internal
