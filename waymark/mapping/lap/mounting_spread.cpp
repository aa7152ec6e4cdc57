#include "waymark/mapping/lap/mounting_spread.hpp"

#include <algorithm>
#include <map>

#include "waymark/camera/intrinsics.hpp"
#include "waymark/geometry/uncertainty.hpp"
#include "waymark/mapping/solver/correlated_errors.hpp"

namespace waymark::internal {
namespace {

/// The poses of the base in so many parts, one after the other, of equally many poses; each tag in the part
/// that has most observations of it.
std::vector<int> stretches_of(const LapBundle& lap, int count) {
  std::vector<int> stretch(lap.bundle.poses.size(), -1);
  const std::vector<PoseIndex> bases = lap.base_poses();
  for (std::size_t i = 0; i < bases.size(); ++i)
    stretch[bases[i]] = static_cast<int>(i * static_cast<std::size_t>(count) / bases.size());
  std::map<PoseIndex, std::map<int, int>> seen;
  for (const CornerTerm& term : lap.bundle.corners) {
    if (term.used && stretch[term.rig] >= 0) ++seen[term.tag][stretch[term.rig]];
  }
  for (const auto& [tag, counts] : seen)
    stretch[tag] =
        std::ranges::max_element(counts, {}, [](const auto& entry) { return entry.second; })->first;
  return stretch;
}

Vector6 deviations(const Matrix6& P) { return P.diagonal().cwiseMax(0.0).cwiseSqrt(); }

}  // namespace

void spread_by_stretches(const LapBundle& lap, MountingEstimate& estimate) {
  constexpr int kStretches = 32;
  const auto spread =
      stretch_covariance(lap.bundle, {.pose = lap.cam, .stretch = stretches_of(lap, kStretches)});
  if (!spread) return;
  estimate.scales_sigma = OdometryScales::of(deviations(spread->scales));
  estimate.sigma = deviations(coordinate_covariance(Uncertain<SE3>{estimate.base_T_cam, spread->pose}));
  // A tag that was printed larger than it should be is so in every stretch that sees it.
  if (spread->intrinsics.size() > 0)
    estimate.focal_scale_sigma =
        std::max(estimate.focal_scale_sigma, focal_scale_sigma(lap.bundle, spread->intrinsics));
}

}  // namespace waymark::internal
