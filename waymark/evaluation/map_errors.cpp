#include "waymark/evaluation/map_errors.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "waymark/base/angles.hpp"
#include "waymark/evaluation/pose_pairs.hpp"
#include "waymark/geometry/lie.hpp"
#include "waymark/samples/visibility.hpp"

namespace waymark {
namespace {

/// Intermediate sums of squares.
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

namespace {

constexpr Duration kMaxGap = std::chrono::milliseconds(500);

using Residuals = std::array<Eigen::Vector2d, 4>;

std::optional<Residuals> residuals_px(const TagDetection& seen, const MappedTag& tag,
                                      const CameraModel& camera, const SE3& cam_T_map) {
  const SE3 cam_T_tag = cam_T_map * tag.map_T_tag;
  const auto corners = tag_corners(tag.size_m);
  Residuals residuals;
  for (std::size_t k = 0; k < 4; ++k) {
    const auto predicted = camera.project(cam_T_tag * corners[k]);
    if (!predicted) return std::nullopt;
    residuals[k] = seen.corners_px[k] - *predicted;
  }
  return residuals;
}

/// Accumulates the residuals of one observation.
void add(const Residuals& residuals, double distance_m, TagReprojection& sums) {
  sums.nearest_m = sums.observations == 0 ? distance_m : std::min(sums.nearest_m, distance_m);
  sums.farthest_m = std::max(sums.farthest_m, distance_m);
  ++sums.observations;
  for (const Eigen::Vector2d& residual : residuals) {
    sums.rms_px += residual.squaredNorm();
    sums.mean_px += residual;
    sums.largest_px = std::max(sums.largest_px, residual.norm());
  }
}

void finish(TagReprojection& sums) {
  const double corners = 4 * static_cast<double>(sums.observations);
  sums.rms_px = std::sqrt(sums.rms_px / (2 * corners));
  sums.mean_px /= corners;
}

}  // namespace

std::map<TagId, TagReprojection> tag_reprojection(const std::vector<TagFrame>& frames, const TagMap& map,
                                                  const Trajectory& trajectory, const CameraModel& camera,
                                                  const SE3& base_T_cam) {
  std::map<TagId, TagReprojection> found;
  for (const TagFrame& frame : frames) {
    const auto map_T_base = pose_at(trajectory, frame.stamp, kMaxGap);
    if (!map_T_base) continue;
    const SE3 cam_T_map = (*map_T_base * base_T_cam).inverse();
    for (const TagDetection& seen : frame.detections) {
      const MappedTag* tag = map.find(seen.tag);
      if (tag == nullptr || !usable_corners(seen)) continue;
      const auto residuals = residuals_px(seen, *tag, camera, cam_T_map);
      if (residuals) add(*residuals, (cam_T_map * tag->map_T_tag.translation()).norm(), found[seen.tag]);
    }
  }
  for (auto& [tag, sums] : found) finish(sums);
  return found;
}

}  // namespace waymark
