#include "waymark/mapping/solver/correlated_errors.hpp"

#include <algorithm>
#include <iterator>
#include <map>
#include <utility>
#include <vector>

#include "waymark/mapping/solver/bundle.hpp"
#include "waymark/mapping/solver/front_cholesky.hpp"

namespace waymark {
namespace {

using Residual = Eigen::Matrix<double, 8, 1>;
using Series = std::vector<std::pair<std::size_t, Residual>>;  ///< residuals by frame, in ascending order

using AllSeries = std::map<std::pair<std::size_t, PoseIndex>, Series>;

/// The residuals in use, one series for each camera and tag.
AllSeries residuals_in_use(const Bundle& bundle, const std::vector<std::size_t>& frames) {
  AllSeries all;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const CornerTerm& term = bundle.corners[i];
    if (!term.used) continue;
    const auto r = corner_residual(term.factor, bundle.cameras[term.camera], poses_of(bundle, term));
    if (r) all[{term.camera, term.tag}].emplace_back(frames[i], *r);
  }
  const auto frame_of = [](const auto& entry) { return entry.first; };
  for (auto& [key, series] : all) {
    std::ranges::stable_sort(series, {}, frame_of);
    const auto repeated = std::ranges::unique(series, {}, frame_of);  // an id that occurs twice in an image
    series.erase(repeated.begin(), repeated.end());
  }
  return all;
}

/// Mean product of residuals that are `lag` frames apart; 0 if there are none. O(residuals).
double correlation(const AllSeries& all, std::size_t lag) {
  double product = 0;
  std::size_t pairs = 0;
  for (const auto& [key, series] : all) {
    auto later = series.begin();
    for (const auto& [frame, r] : series) {
      while (later != series.end() && later->first < frame + lag) ++later;
      if (later == series.end()) break;
      if (later->first != frame + lag) continue;
      product += r.dot(later->second);
      ++pairs;
    }
  }
  return pairs == 0 ? 0 : product / static_cast<double>(pairs);
}

}  // namespace

double correlated_frames(const Bundle& bundle, const std::vector<std::size_t>& frames) {
  const auto all = residuals_in_use(bundle, frames);
  double square = 0;
  std::size_t count = 0;
  std::size_t longest = 0;
  for (const auto& [key, series] : all) {
    for (const auto& [frame, r] : series) square += r.squaredNorm();
    count += series.size();
    longest = std::max(longest, series.size());
  }
  if (count == 0 || !(square > 0)) return 1;
  square /= static_cast<double>(count);
  double factor = -1;
  for (std::size_t lag = 0; lag < longest; lag += 2) {
    const double pair = correlation(all, lag) + correlation(all, lag + 1);
    if (!(pair > 0)) break;
    factor += 2 * pair / square * (1 - (static_cast<double>(lag) + 0.5) / static_cast<double>(longest));
  }
  return std::clamp(factor, 1.0, static_cast<double>(longest));
}

namespace {

using internal::BlockSystem;

/// The bundle with its unknowns but without its measurements.
Bundle without_terms(const Bundle& all) {
  return {.cameras = all.cameras,
          .intrinsics = all.intrinsics,
          .poses = all.poses,
          .odometry_scales = all.odometry_scales,
          .sizes = all.sizes,
          .common_size = all.common_size};
}

/// The measurements in stretch `which` and the priors on its poses; if `which` is -1, the priors on poses in
/// no stretch.
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

/// Columns of the inverse for the given unknowns, in the same order.
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

/// The change in the requested parameters due to the measurements of each stretch; one row per stretch.
Eigen::MatrixXd influences(const Bundle& bundle, const internal::Unknowns& unknowns,
                           const std::vector<int>& stretch, const Eigen::MatrixXd& X, BlockSystem& system) {
  internal::accumulate(without_terms(bundle), unknowns, 0, &system);
  const Eigen::VectorXd of_nothing =
      system.gradient();  // contains only the priors on scales, intrinsics and sizes
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

/// Covariances between stretches that are up to this many stretches apart are included, with decreasing
/// weights.
constexpr Eigen::Index kBandwidth = 4;

/// Covariance of the sum of the rows (Newey and West, equation (5)). It is enlarged to correct the bias that
/// arises because the rows sum to nearly zero (Kiefer and Vogelsang, section 3). It is also enlarged to
/// account for its own uncertainty, by the ratio of the variances of Student's t and a normal distribution.
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
  constexpr Eigen::Index kMinStretches = 4 * kBandwidth;
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
  if (moved.rows() < kMinStretches) return std::nullopt;
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
