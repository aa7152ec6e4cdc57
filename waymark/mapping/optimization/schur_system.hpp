#pragma once

#include <optional>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/Core>

#include "waymark/mapping/optimization/block_system.hpp"

namespace waymark::internal {

/// Which unknowns are eliminated first, in small groups that share no residual with each other (the poses of
/// one picture), and which are kept (tags, extrinsics): Triggs, McLauchlan, Hartley and Fitzgibbon, "Bundle
/// Adjustment - A Modern Synthesis", 2000, section 6.1.
struct SchurPlan {
  struct Group {
    std::vector<int> members{};  ///< unknowns
    std::vector<int> kept{};     ///< those outside that share a residual with one of them, ascending
    int size = 0, kept_size = 0;
  };
  std::vector<Group> groups{};
  std::vector<int> group_of{};  ///< of each unknown; -1: kept
  std::vector<int> place{};     ///< of each unknown: first scalar in its group, or in the reduced system
  int reduced = 0;              ///< scalars that are kept

  /// Few enough are kept for a dense reduced system.
  [[nodiscard]] bool worth_it() const;
};

/// Unknowns with few couplings go first; a group grows to at most some poses.
[[nodiscard]] SchurPlan schur_plan(const std::vector<int>& dimensions,
                                   const std::vector<std::pair<int, int>>& couplings);

/// Solves the normal equations of a block system by eliminating the groups of a plan.
class SchurSystem {
 public:
  SchurSystem(const BlockSystem& system, const SchurPlan& plan);

  /// Of H + damping diag(H) + floor I; false when that is not positive definite.
  [[nodiscard]] bool factorize(double damping, double floor);
  /// The solution for a right-hand side in the order of the block system.
  [[nodiscard]] Eigen::VectorXd solve(const Eigen::VectorXd& rhs) const;
  /// The diagonal blocks of the inverse, by unknown.
  [[nodiscard]] std::vector<Eigen::MatrixXd> diagonal_blocks() const;

 private:
  struct Factor {
    Eigen::LLT<Eigen::MatrixXd> A{};  ///< of the group's own block
    Eigen::MatrixXd W{};              ///< L^-1 B, B between the group and what is kept
  };

  /// A block of the system and where it belongs among those of a group.
  struct Piece {
    BlockSystem::Block block;
    int row = 0, column = 0;
    bool own = false;         ///< both unknowns are of the group
    bool transposed = false;  ///< the system has the other triangle's
  };

  [[nodiscard]] std::vector<Piece> pieces_of(const SchurPlan::Group& group) const;
  void gather(std::size_t group, double damping, double floor, Eigen::MatrixXd& A, Eigen::MatrixXd& B) const;

  const BlockSystem& system_;
  const SchurPlan& plan_;
  std::vector<std::vector<Piece>> pieces_{};  ///< by group
  std::vector<Factor> factors_{};
  Eigen::LLT<Eigen::MatrixXd> reduced_{};
};

}  // namespace waymark::internal
