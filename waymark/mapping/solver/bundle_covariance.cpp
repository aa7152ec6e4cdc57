#include <algorithm>
#include <iterator>

#include "waymark/mapping/solver/bundle.hpp"
#include "waymark/mapping/solver/bundle_terms.hpp"
#include "waymark/mapping/solver/front_cholesky.hpp"

namespace waymark {

BundleCovariance covariance(const Bundle& bundle, const std::vector<std::pair<PoseIndex, PoseIndex>>& pairs) {
  using internal::BlockSystem;
  BundleCovariance result;
  result.poses.assign(bundle.poses.size(), Matrix6::Zero());
  result.scales.assign(bundle.odometry_scales.size(), Matrix6::Zero());
  result.intrinsics.resize(bundle.cameras.size());
  internal::Unknowns unknowns = internal::unknowns_of(bundle);
  if (unknowns.dimensions.empty()) return result;
  result.pairs.assign(pairs.size(), Matrix6::Zero());
  std::vector<std::pair<int, int>> wanted;
  for (const auto& [a, b] : pairs) wanted.emplace_back(unknowns.of_pose[a], unknowns.of_pose[b]);
  const auto both = [](const std::pair<int, int>& pair) { return pair.first >= 0 && pair.second >= 0; };
  std::ranges::copy_if(wanted, std::back_inserter(unknowns.couplings), both);
  BlockSystem system(unknowns.dimensions, unknowns.couplings);
  internal::accumulate(bundle, unknowns, 0, &system);
  // A direction that nothing determines gets a standard deviation of 1e3 m or rad instead of an infinite one.
  constexpr double kFloor = 1e-6;
  constexpr double kUndetermined = 1e3;
  const auto read = [&](const auto& block_of) {
    for (std::size_t i = 0; i < bundle.poses.size(); ++i) {
      const int unknown = unknowns.of_pose[i];
      if (unknown < 0) continue;
      result.poses[i] = block_of(unknown);
      if (!(result.poses[i].diagonal().maxCoeff() <= kUndetermined)) result.undetermined.push_back(i);
    }
    for (std::size_t i = 0; i < bundle.odometry_scales.size(); ++i) {
      const int unknown = unknowns.of_scales[i];
      const int n = bundle.odometry_scales[i].unknowns();
      if (unknown >= 0) result.scales[i].topLeftCorner(n, n) = block_of(unknown);
    }
    for (std::size_t i = 0; i < unknowns.of_intrinsics.size(); ++i) {
      if (unknowns.of_intrinsics[i] >= 0) result.intrinsics[i] = block_of(unknowns.of_intrinsics[i]);
    }
  };
  const internal::FrontPlan fronts = internal::front_plan(system);
  internal::FrontCholesky cholesky(system, fronts);
  if (!cholesky.factorize(0, kFloor)) {
    // Nothing can be said of how certain anything is; a zero would say that all is exact.
    read([&](int unknown) {
      const int n = system.dimension(unknown);
      return Eigen::MatrixXd(kUndetermined * kUndetermined * Eigen::MatrixXd::Identity(n, n));
    });
    result.undetermined.clear();
    for (std::size_t i = 0; i < bundle.poses.size(); ++i) {
      if (unknowns.of_pose[i] >= 0) result.undetermined.push_back(i);
    }
    return result;
  }
  std::vector<std::pair<int, int>> diagonal;
  for (int u = 0; u < system.unknowns(); ++u) diagonal.emplace_back(u, u);
  const std::size_t all = diagonal.size();
  std::ranges::copy_if(wanted, std::back_inserter(diagonal), both);
  const std::vector<Eigen::MatrixXd> blocks = cholesky.inverse_blocks(diagonal);
  std::size_t next = all;
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    if (both(wanted[i])) result.pairs[i] = blocks[next++];
  }
  read([&](int unknown) -> const Eigen::MatrixXd& { return blocks[static_cast<std::size_t>(unknown)]; });
  return result;
}

}  // namespace waymark
