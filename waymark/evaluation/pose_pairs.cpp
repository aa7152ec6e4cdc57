#include "waymark/evaluation/pose_pairs.hpp"

#include <algorithm>

#include "waymark/geometry/lie.hpp"

namespace waymark {

std::optional<SE3> pose_at(const Trajectory& trajectory, SensorTime stamp, Duration max_gap) {
  const auto after = std::ranges::lower_bound(trajectory, stamp, {}, &StampedPose::stamp);
  if (after == trajectory.end()) return std::nullopt;
  if (after->stamp == stamp) return after->map_T_base;
  if (after == trajectory.begin()) return std::nullopt;
  const StampedPose& a = *(after - 1);
  const StampedPose& b = *after;
  if (b.stamp - a.stamp > max_gap) return std::nullopt;
  const double u = to_seconds(stamp - a.stamp) / to_seconds(b.stamp - a.stamp);
  return SE3(interpolate(a.map_T_base.rotation(), b.map_T_base.rotation(), u),
             (1 - u) * a.map_T_base.translation() + u * b.map_T_base.translation());
}

std::vector<PosePair> pair_by_time(const EstimatedTrajectory& estimated, const Trajectory& reference,
                                   Duration max_gap) {
  std::vector<PosePair> pairs;
  for (const EstimatedPose& estimate : estimated) {
    if (const auto there = pose_at(reference, estimate.stamp, max_gap)) pairs.push_back({estimate, *there});
  }
  return pairs;
}

}  // namespace waymark
