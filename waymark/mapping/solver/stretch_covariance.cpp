#include "waymark/mapping/solver/stretch_covariance.hpp"

#include <algorithm>
#include <iterator>

#include "waymark/mapping/solver/bundle_terms.hpp"
#include "waymark/mapping/solver/front_cholesky.hpp"

namespace waymark {
namespace {

using internal::BlockSystem;

/// Poses and numbers, and no measurement.
Bundle without_terms(const Bundle& all) {
  return {.cameras = all.cameras,
          .intrinsics = all.intrinsics,
          .poses = all.poses,
          .odometry_scales = all.odometry_scales};
}

/// What is measured in one stretch, or known beforehand of its poses; of stretch -1: of poses in none.
Bundle terms_of(const Bundle& all, const std::vector<int>& stretch, int which) {
  Bundle part = without_terms(all);
  std::ranges::copy_if(all.priors, std::back_inserter(part.priors),
                       [&](const PriorTerm& term) { return stretch[term.pose] == which; });
  std::ranges::copy_if(all.pair_priors, std::back_inserter(part.pair_priors),
                       [&](const PairPriorTerm& term) { return stretch[term.b] == which; });
  std::ranges::copy_if(all.relatives, std::back_inserter(part.relatives),
                       [&](const RelativeTerm& term) { return stretch[term.b] == which; });
  if (which < 0) {
    part.distances = all.distances;
    part.coordinates = all.coordinates;
    part.point_distances = all.point_distances;
    part.point_coordinates = all.point_coordinates;
  }
  std::ranges::copy_if(all.corners, std::back_inserter(part.corners),
                       [&](const CornerTerm& term) { return term.used && stretch[term.rig] == which; });
  std::ranges::copy_if(all.odometry, std::back_inserter(part.odometry),
                       [&](const OdometryTerm& term) { return stretch[term.a] == which; });
  std::ranges::copy_if(all.on_floor, std::back_inserter(part.on_floor),
                       [&](const OnFloorTerm& term) { return stretch[term.base] == which; });
  return part;
}

/// Columns of the inverse, of some unknowns one after the other.
Eigen::MatrixXd inverse_columns(const BlockSystem& system, const internal::FrontCholesky& cholesky,
                                const std::vector<int>& unknowns) {
  std::vector<Eigen::Index> scalars;
  for (const int unknown : unknowns) {
    for (int i = 0; i < system.dimension(unknown); ++i) scalars.push_back(system.offset(unknown) + i);
  }
  const Eigen::Index all = system.gradient().size();
  Eigen::MatrixXd columns(all, static_cast<Eigen::Index>(scalars.size()));
  for (std::size_t i = 0; i < scalars.size(); ++i)
    columns.col(static_cast<Eigen::Index>(i)) = cholesky.solve(Eigen::VectorXd::Unit(all, scalars[i]));
  return columns;
}

/// By how much the measurements of each stretch move the numbers asked for, one row a stretch.
Eigen::MatrixXd influences(const Bundle& bundle, const internal::Unknowns& unknowns,
                           const std::vector<int>& stretch, const Eigen::MatrixXd& X, BlockSystem& system) {
  internal::accumulate(without_terms(bundle), unknowns, 0, &system);
  const Eigen::VectorXd of_nothing = system.gradient();  // priors of scales and of intrinsics
  const int last = stretch.empty() ? -1 : *std::ranges::max_element(stretch);
  Eigen::MatrixXd moved(last + 1, X.cols());
  Eigen::Index stretches = 0;
  for (int which = 0; which <= last; ++which) {
    const Bundle part = terms_of(bundle, stretch, which);
    if (part.corners.empty() && part.odometry.empty()) continue;
    internal::accumulate(part, unknowns, 0, &system);
    moved.row(stretches++) = (system.gradient() - of_nothing).transpose() * X;
  }
  return moved.topRows(stretches);
}

/// What a stretch has in common with those up to so many after it counts, too, the less the later they are.
constexpr Eigen::Index kBandwidth = 4;

/// Covariance of the sum of the rows (Newey and West, equation (5)), larger by what it falls short of on
/// average because the rows sum to nearly nothing (Kiefer and Vogelsang, section 3), and by what it is itself
/// known to: the variance of Student's t over that of a normal distribution.
Eigen::MatrixXd long_run_covariance(const Eigen::MatrixXd& rows) {
  Eigen::MatrixXd P = rows.transpose() * rows;
  const Eigen::Index count = rows.rows();
  for (Eigen::Index lag = 1; lag < kBandwidth; ++lag) {
    const Eigen::MatrixXd common = rows.bottomRows(count - lag).transpose() * rows.topRows(count - lag);
    const double weight = 1 - static_cast<double>(lag) / static_cast<double>(kBandwidth);
    P += weight * (common + common.transpose());
  }
  const double share = static_cast<double>(kBandwidth) / static_cast<double>(count);
  const double freedom = 1.5 / share;
  return freedom / (freedom - 2) / (1 - share + share * share / 3) * P;
}

}  // namespace

std::optional<StretchCovariance> stretch_covariance(const Bundle& bundle, const StretchQuestion& question) {
  constexpr Eigen::Index kFewest = 4 * kBandwidth;
  constexpr double kFloor = 1e-6;
  const internal::Unknowns unknowns = internal::unknowns_of(bundle);
  std::vector<int> asked{unknowns.of_pose[question.pose], unknowns.of_scales[question.scales]};
  if (std::ranges::find(asked, -1) != asked.end()) return std::nullopt;
  const int lens = unknowns.of_intrinsics.empty() ? -1 : unknowns.of_intrinsics[question.camera];
  if (lens >= 0) asked.push_back(lens);
  BlockSystem system(unknowns.dimensions, unknowns.couplings);
  internal::accumulate(bundle, unknowns, 0, &system);
  const internal::FrontPlan fronts = internal::front_plan(system);
  internal::FrontCholesky cholesky(system, fronts);
  if (!cholesky.factorize(0, kFloor)) return std::nullopt;
  const Eigen::MatrixXd X = inverse_columns(system, cholesky, asked);
  const Eigen::MatrixXd moved = influences(bundle, unknowns, question.stretch, X, system);
  if (moved.rows() < kFewest) return std::nullopt;
  internal::accumulate(terms_of(bundle, question.stretch, -1), unknowns, 0, &system);
  const Eigen::MatrixXd stated = system.lower().selfadjointView<Eigen::Lower>() * X;
  const Eigen::MatrixXd P = long_run_covariance(moved) + X.transpose() * stated;
  StretchCovariance result{.stretches = static_cast<int>(moved.rows())};
  result.pose = P.topLeftCorner<6, 6>();
  const Eigen::Index n = system.dimension(asked[1]);
  result.scales.topLeftCorner(n, n) = P.block(6, 6, n, n);
  if (lens >= 0) result.intrinsics = P.bottomRightCorner(system.dimension(lens), system.dimension(lens));
  return result;
}

}  // namespace waymark
