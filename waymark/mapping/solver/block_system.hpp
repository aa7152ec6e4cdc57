#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include <Eigen/Core>
#include <Eigen/SparseCore>

namespace waymark::internal {

/// Normal equations H x = g in block form. H is stored as the lower triangle of a sparse matrix with a fixed
/// sparsity pattern.
class BlockSystem {
 public:
  /// An unknown that a residual depends on, with its Jacobian J_r_unknown (rows x dimension of the unknown).
  struct Part {
    int unknown = -1;  ///< -1 if fixed, that is, not in the system
    Eigen::Ref<const Eigen::MatrixXd, 0, Eigen::OuterStride<>> J;
  };
  using Sparse = Eigen::SparseMatrix<double, Eigen::ColMajor, int>;

  /// `dimensions`: dimension of each unknown. `couplings`: pairs of unknowns that share a residual, in any
  /// order and possibly repeated.
  BlockSystem(std::vector<int> dimensions, std::vector<std::pair<int, int>> couplings);

  void clear();
  /// Adds weight J^T J to H and weight J^T r to g.
  void add(std::span<const Part> parts, const Eigen::Ref<const Eigen::VectorXd>& r, double weight = 1);

  /// Does the same for the corners of a tag, whose Jacobians with respect to rig, camera, body and tag are
  /// all 8x6. The Jacobian of the body is minus that of the rig, so it is not read if both are unknown.
  void add_corners(const std::array<int, 4>& unknowns,
                   const std::array<const Eigen::Matrix<double, 8, 6>*, 4>& J,
                   const Eigen::Matrix<double, 8, 1>& r, double weight);

  /// Does the same for the size of the tag, an unknown of one dimension, after add_corners() with the same
  /// unknowns and Jacobians.
  void add_corner_size(const std::array<int, 4>& unknowns,
                       const std::array<const Eigen::Matrix<double, 8, 6>*, 4>& J, int size,
                       const Eigen::Matrix<double, 8, 1>& J_size, const Eigen::Matrix<double, 8, 1>& r,
                       double weight);

  [[nodiscard]] const Eigen::VectorXd& gradient() const { return gradient_; }
  [[nodiscard]] const Sparse& lower() const { return H_; }
  using Block = Eigen::Map<const Eigen::MatrixXd, 0, Eigen::OuterStride<>>;
  /// A block of the lower triangle (row >= column); empty if its two unknowns share no residual.
  [[nodiscard]] std::optional<Block> block(int row, int column) const;
  /// Calls visit(row, block) for every block in a block column.
  template <class Visit>
  void for_column(int column, const Visit& visit) const {
    for (int at = first_[static_cast<std::size_t>(column)]; at < first_[static_cast<std::size_t>(column) + 1];
         ++at) {
      const auto& [row, start] = rows_[static_cast<std::size_t>(at)];
      visit(row, at_place(row, column, start));
    }
  }

  [[nodiscard]] int unknowns() const { return static_cast<int>(dimensions_.size()); }
  [[nodiscard]] int offset(int unknown) const { return offsets_[static_cast<std::size_t>(unknown)]; }
  [[nodiscard]] int dimension(int unknown) const { return dimensions_[static_cast<std::size_t>(unknown)]; }

 private:
  using Matrix6 = Eigen::Matrix<double, 6, 6>;
  /// Adds M to a block; for a block above the diagonal, adds its transpose to the mirrored block.
  void add_to_block(int row, int column, const Matrix6& M);
  /// Index of the first entry of block `row` within each scalar column of block column `column`.
  [[nodiscard]] int place(int row, int column) const;
  [[nodiscard]] Block at_place(int row, int column, int start) const;

  std::vector<int> dimensions_;
  std::vector<int> offsets_;               ///< index of the first scalar of each unknown
  std::vector<int> first_;                 ///< index in rows_ of the first entry of each block column
  std::vector<std::pair<int, int>> rows_;  ///< (block row, place), sorted by block column, then by row
  Sparse H_;
  Eigen::VectorXd gradient_;
};

}  // namespace waymark::internal
