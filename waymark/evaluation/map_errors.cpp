#include "waymark/evaluation/map_errors.hpp"

#include <algorithm>
#include <cmath>

#include "waymark/base/angles.hpp"
#include "waymark/geometry/lie.hpp"

namespace waymark {
namespace {

/// Sums of squares on the way to the figures.
struct Sums {
  std::size_t count = 0;
  double squared_m2 = 0;
  double squared_rad2 = 0;
  double max_m = 0;

  void add(const SE3& estimated, const SE3& truth) {
    const double distance = (estimated.translation() - truth.translation()).norm();
    ++count;
    squared_m2 += distance * distance;
    squared_rad2 += (estimated.rotation() * truth.rotation().inverse()).log().squaredNorm();
    max_m = std::max(max_m, distance);
  }
  [[nodiscard]] double rmse_m() const {
    return count > 0 ? std::sqrt(squared_m2 / static_cast<double>(count)) : 0;
  }
  [[nodiscard]] double rmse_deg() const {
    return count > 0 ? to_degrees(std::sqrt(squared_rad2 / static_cast<double>(count))) : 0;
  }
};

}  // namespace

TagMapErrors tag_map_errors(const TagMap& estimated, const TagMap& truth) {
  TagMapErrors errors;
  Sums sums;
  for (const auto& [id, tag] : estimated.tags) {
    if (const MappedTag* true_tag = truth.find(id)) {
      sums.add(tag.map_T_tag, true_tag->map_T_tag);
    } else {
      errors.unknown.push_back(id);
    }
  }
  for (const auto& [id, tag] : truth.tags) {
    if (estimated.find(id) == nullptr) errors.missing.push_back(id);
  }
  errors.tags = sums.count;
  errors.rmse_m = sums.rmse_m();
  errors.max_m = sums.max_m;
  errors.orientation_rmse_deg = sums.rmse_deg();
  return errors;
}

TrajectoryErrors trajectory_errors(const Trajectory& estimated, const Trajectory& truth) {
  Sums sums;
  std::size_t after = 1;
  for (const StampedPose& pose : estimated) {
    while (after < truth.size() && truth[after].stamp < pose.stamp) ++after;
    if (after >= truth.size()) break;
    const StampedPose& a = truth[after - 1];
    const StampedPose& b = truth[after];
    if (pose.stamp < a.stamp) continue;
    const double span_s = to_seconds(b.stamp - a.stamp);
    const double u = span_s > 0 ? to_seconds(pose.stamp - a.stamp) / span_s : 0;
    const SO3 map_R_base = interpolate(a.map_T_base.rotation(), b.map_T_base.rotation(), u);
    sums.add(pose.map_T_base,
             {map_R_base, (1 - u) * a.map_T_base.translation() + u * b.map_T_base.translation()});
  }
  return {.poses = sums.count,
          .rmse_m = sums.rmse_m(),
          .max_m = sums.max_m,
          .orientation_rmse_deg = sums.rmse_deg()};
}

bool in_frame_of_truth(const SE3& map_T_anchor, const SE3& true_map_T_anchor) {
  constexpr double kSame = 0.02;  // [m, rad]
  return (true_map_T_anchor.inverse() * map_T_anchor).log().isZero(kSame);
}

}  // namespace waymark
