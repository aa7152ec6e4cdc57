#pragma once

#include <span>
#include <vector>

#include "waymark/mapping/solver/block_system.hpp"
#include "waymark/mapping/solver/bundle.hpp"

namespace waymark::internal {

/// Which poses and scales of a bundle are unknowns of the linear system, and where.
struct Unknowns {
  std::vector<int> of_pose{};  ///< number of the unknown; -1: fixed or in no term
  std::vector<int> of_scales{};
  std::vector<int> of_intrinsics{};  ///< by camera; empty when all are known
  std::vector<int> dimensions{};
  std::vector<std::pair<int, int>> couplings{};
};

[[nodiscard]] Unknowns unknowns_of(const Bundle& bundle);

/// Adds every term in use to the system (nullptr: only the cost). Cauchy's loss on tags from robust_chi2 on,
/// as reweighted least squares. The cost; infinite when a corner term in use cannot be seen.
double accumulate(const Bundle& bundle, const Unknowns& unknowns, double robust_chi2, BlockSystem* system);

/// Applies a step of the system: poses by exp on the left, scales and intrinsics by addition.
void apply(const Unknowns& unknowns, const BlockSystem& system, const Eigen::VectorXd& step, Bundle& bundle);

}  // namespace waymark::internal
