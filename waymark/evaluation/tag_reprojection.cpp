#include "waymark/evaluation/tag_reprojection.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "waymark/evaluation/pose_pairs.hpp"
#include "waymark/samples/visibility.hpp"

namespace waymark {
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

/// Sums until all observations are in.
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
      if (tag == nullptr) continue;
      const auto residuals = residuals_px(seen, *tag, camera, cam_T_map);
      if (residuals) add(*residuals, (cam_T_map * tag->map_T_tag.translation()).norm(), found[seen.tag]);
    }
  }
  for (auto& [tag, sums] : found) finish(sums);
  return found;
}

}  // namespace waymark
