#include "waymark/mapping/bundle.hpp"
#include "waymark/mapping/bundle_terms.hpp"
#include "waymark/mapping/schur_system.hpp"
#include "waymark/mapping/selected_inverse.hpp"

namespace waymark {

BundleCovariance covariance(const Bundle& bundle) {
  using internal::BlockSystem;
  BundleCovariance result;
  result.poses.assign(bundle.poses.size(), Matrix6::Zero());
  result.scales.assign(bundle.odometry_scales.size(), Eigen::Matrix2d::Zero());
  const internal::Unknowns unknowns = internal::unknowns_of(bundle);
  if (unknowns.dimensions.empty()) return result;
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
      if (result.poses[i].diagonal().maxCoeff() > kUndetermined) result.undetermined.push_back(i);
    }
    for (std::size_t i = 0; i < bundle.odometry_scales.size(); ++i) {
      const int unknown = unknowns.of_scales[i];
      if (unknown >= 0) result.scales[i] = block_of(unknown);
    }
  };
  const internal::SchurPlan plan = internal::schur_plan(unknowns.dimensions, unknowns.couplings);
  internal::SchurSystem schur(system, plan);
  if (plan.worth_it() && schur.factorize(0, kFloor)) {
    const std::vector<Eigen::MatrixXd> blocks = schur.diagonal_blocks();
    read([&](int unknown) -> const Eigen::MatrixXd& { return blocks[static_cast<std::size_t>(unknown)]; });
    return result;
  }
  BlockSystem::Sparse H = system.lower();
  for (int i = 0; i < H.rows(); ++i) H.coeffRef(i, i) += kFloor;
  const BlockSystem::Cholesky cholesky(H);
  if (cholesky.info() != Eigen::Success) {
    for (std::size_t i = 0; i < bundle.poses.size(); ++i) result.undetermined.push_back(i);
    return result;
  }
  const internal::SelectedInverse inverse(cholesky);
  read([&](int unknown) { return inverse.block(system.offset(unknown), system.dimension(unknown)); });
  return result;
}

}  // namespace waymark
