#include <algorithm>
#include <cmath>

#include "waymark/base/angles.hpp"
#include "waymark/mapping/calibration/calibration_search.hpp"
#include "waymark/mapping/optimization/image_region.hpp"
#include "waymark/samples/visibility.hpp"

namespace waymark::internal {

/// Squared distances of a view's used corners from where they project.
std::vector<double> squared_distances_px2(const TargetView& view, const CameraModel& camera) {
  std::vector<double> squares;
  for (const TargetTag& tag : view.tags) {
    if (!tag.used) continue;
    const SE3 cam_T_tag = view.target_T_cam.inverse() * tag.target_T_tag;
    const auto corners = tag_corners(tag.seen.size_m);
    for (std::size_t i = 0; i < corners.size(); ++i)
      if (const auto px = camera.project(cam_T_tag * corners[i]))
        squares.push_back((*px - tag.seen.corners_px[i]).squaredNorm());
  }
  return squares;
}

double root_mean(const std::vector<double>& squares) {
  double sum = 0;
  for (const double value : squares) sum += value;
  return squares.empty() ? 0 : std::sqrt(sum / static_cast<double>(squares.size()));
}

CalibratedView summary_of(const TargetView& view, const CameraModel& camera) {
  CalibratedView summary;
  summary.tags = static_cast<std::size_t>(std::ranges::count_if(view.tags, &TargetTag::used));
  summary.rejected = view.tags.size() - summary.tags;
  if (summary.tags == 0) return summary;
  summary.rms_px = root_mean(squared_distances_px2(view, camera));
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  for (const TargetTag& tag : view.tags) {
    if (!tag.used) continue;
    const SE3 cam_T_tag = view.target_T_cam.inverse() * tag.target_T_tag;
    middle += cam_T_tag.translation() / static_cast<double>(summary.tags);
    normal += cam_T_tag.rotation() * Eigen::Vector3d::UnitZ();
  }
  summary.distance_m = middle.norm();
  summary.tilt_deg = to_degrees(std::acos(std::clamp(normal.normalized().z(), -1.0, 1.0)));
  return summary;
}

std::array<ImageRegion, 9> regions_of(const std::vector<TargetView>& views, const CameraModel& camera) {
  std::array<std::vector<double>, 9> squares;
  for (const TargetView& view : views) {
    for (const TargetTag& tag : view.tags) {
      if (!tag.used) continue;
      const SE3 cam_T_tag = view.target_T_cam.inverse() * tag.target_T_tag;
      const auto corners = tag_corners(tag.seen.size_m);
      for (std::size_t i = 0; i < corners.size(); ++i) {
        const Eigen::Vector2d& seen = tag.seen.corners_px[i];
        const auto px = camera.project(cam_T_tag * corners[i]);
        if (px) squares[internal::ninth_of(seen, camera)].push_back((*px - seen).squaredNorm());
      }
    }
  }
  std::array<ImageRegion, 9> regions;
  for (std::size_t i = 0; i < regions.size(); ++i) regions[i] = {squares[i].size(), root_mean(squares[i])};
  return regions;
}

}  // namespace waymark::internal
