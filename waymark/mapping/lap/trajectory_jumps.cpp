#include "waymark/mapping/lap/trajectory_jumps.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <vector>

#include "waymark/base/order_statistics.hpp"
#include "waymark/mapping/lap/lost_poses.hpp"

namespace waymark::internal {
namespace {

/// Squared whitened residual of each motion.
std::vector<double> wheel_chi2(const Bundle& bundle) {
  std::vector<double> chi2;
  chi2.reserve(bundle.odometry.size());
  for (const OdometryTerm& term : bundle.odometry) {
    chi2.push_back(odometry_residual(term.factor, bundle.odometry_scales[term.scales].value,
                                     bundle.poses[term.a].value, bundle.poses[term.b].value)
                       .squaredNorm());
  }
  return chi2;
}

/// By how much the wheels' noise is less than is assumed, where one motion is far off all the others; 1: none
/// is.
double exactness_beside_a_jump(const Bundle& bundle) {
  constexpr std::size_t kEnough = 30;
  constexpr double kFarOff = 50;
  constexpr double kMedianChi2 = 2.366;  // of chi-square with 3 degrees of freedom
  constexpr double kMost = 30;
  const std::vector<double> chi2 = wheel_chi2(bundle);
  if (chi2.size() < kEnough) return 1;
  const double worst = *std::ranges::max_element(chi2);
  const double usual = median(chi2);
  if (worst < kFarOff * usual) return 1;
  return std::clamp(std::sqrt(kMedianChi2 / std::max(usual, 1e-12)), 1.0, kMost);
}

/// Tags that contradict the solution often, those first that do most.
std::vector<PoseIndex> suspects(const LapBundle& lap, double outlier_chi2) {
  constexpr int kOften = 8;
  constexpr std::size_t kMost = 3;
  const std::vector<double> chi2 = corner_chi2(lap.bundle);
  std::map<PoseIndex, int> contradictions;
  for (std::size_t i = 0; i < chi2.size(); ++i) {
    if (!(chi2[i] < outlier_chi2)) ++contradictions[lap.bundle.corners[i].tag];
  }
  std::vector<PoseIndex> tags;
  for (const auto& [tag, count] : contradictions) {
    if (count >= kOften && !lap.is_held(tag)) tags.push_back(tag);
  }
  std::ranges::stable_sort(tags, std::greater<>{}, [&](PoseIndex tag) { return contradictions[tag]; });
  tags.resize(std::min(tags.size(), kMost));
  return tags;
}

}  // namespace

void mend_jumps_of_the_way(const LapInput& input, const BundleMapOptions& options,
                           const BundleOptions& search, const BundleProgress& progress, LapBundle& lap,
                           BundleSummary& summary) {
  const double exactness = exactness_beside_a_jump(lap.bundle);
  if (exactness <= 1) return;
  const LapBundle before = lap;
  for (const PoseIndex suspect : suspects(before, options.search.outlier_chi2)) {
    LapBundle again = before;
    for (CornerTerm& term : again.bundle.corners) term.used = term.tag != suspect && !term.doubtful;
    for (OdometryTerm& term : again.bundle.odometry) term.factor.whitening *= exactness;
    if (!solve(again.bundle, search, progress).usable()) continue;
    again.bundle.odometry = before.bundle.odometry;
    place_lost_tags_anew(input, options, again);
    for (CornerTerm& term : again.bundle.corners) term.used = !term.doubtful;
    const BundleSummary other = solve(again.bundle, search, progress);
    if (!other.usable() || other.final_cost >= summary.final_cost || other.invisible > summary.invisible)
      continue;
    lap = std::move(again);
    summary = other;
    if (exactness_beside_a_jump(lap.bundle) <= 1) return;
  }
}

}  // namespace waymark::internal
