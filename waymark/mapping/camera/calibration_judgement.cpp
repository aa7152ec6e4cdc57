#include <algorithm>
#include <cmath>

#include "waymark/base/angles.hpp"
#include "waymark/mapping/camera/calibration_search.hpp"
#include "waymark/mapping/solver/image_region.hpp"

namespace waymark::internal {

namespace {

/// Calls with where each corner used is seen and where it projects.
template <class Each>
void for_each_corner(const TargetView& view, const CameraModel& camera, const Each& each) {
  const SE3 cam_T_target = view.target_T_cam.inverse();
  for (const ViewMark& mark : view.marks)
    for (std::size_t i = 0; mark.used && i < mark.seen.seen_px.size(); ++i)
      if (const auto px = camera.project(cam_T_target * mark.seen.target_points_m[i]))
        each(mark.seen.seen_px[i], *px);
}

}  // namespace

std::vector<double> squared_distances_px2(const TargetView& view, const CameraModel& camera) {
  std::vector<double> squares;
  for_each_corner(view, camera, [&](const Eigen::Vector2d& seen, const Eigen::Vector2d& px) {
    squares.push_back((px - seen).squaredNorm());
  });
  return squares;
}

double root_mean(const std::vector<double>& squares) {
  double sum = 0;
  for (const double value : squares) sum += value;
  return squares.empty() ? 0 : std::sqrt(sum / static_cast<double>(squares.size()));
}

CalibratedView summary_of(const TargetView& view, const CameraModel& camera) {
  CalibratedView summary;
  summary.marks = static_cast<std::size_t>(std::ranges::count_if(view.marks, &ViewMark::used));
  summary.rejected = view.marks.size() - summary.marks;
  if (summary.marks == 0) return summary;
  summary.rms_px = root_mean(squared_distances_px2(view, camera));
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  double points = 0;
  for (const ViewMark& mark : view.marks) {
    if (!mark.used) continue;
    for (const Eigen::Vector3d& point : mark.seen.target_points_m) {
      middle += point;
      ++points;
    }
  }
  for (const ViewMark& mark : view.marks) summary.used.push_back(mark.used);
  summary.target_T_cam = view.target_T_cam;
  const SE3 cam_T_target = view.target_T_cam.inverse();
  const Eigen::Vector3d normal = cam_T_target.rotation() * Eigen::Vector3d::UnitZ();
  summary.distance_m = (cam_T_target * Eigen::Vector3d(middle / points)).norm();
  summary.tilt_deg = to_degrees(std::acos(std::clamp(normal.z(), -1.0, 1.0)));
  return summary;
}

std::array<ImageRegion, 9> regions_of(const std::vector<TargetView>& views, const CameraModel& camera) {
  std::array<std::vector<double>, 9> squares;
  std::array<std::vector<double>, 9> chi2;  // of a coordinate
  for (const TargetView& view : views) {
    for_each_corner(view, camera, [&](const Eigen::Vector2d& seen, const Eigen::Vector2d& px) {
      squares.at(internal::ninth_of(seen, camera)).push_back((px - seen).squaredNorm());
    });
    for (const ViewMark& mark : view.marks) {
      const auto of_mark = mark.used ? mark_chi2(mark, view, camera) : std::nullopt;
      for (std::size_t i = 0; of_mark && i < mark.seen.seen_px.size(); ++i)
        chi2.at(internal::ninth_of(mark.seen.seen_px[i], camera))
            .push_back(*of_mark / static_cast<double>(mark.numbers()));
    }
  }
  std::array<ImageRegion, 9> regions;
  for (std::size_t i = 0; i < regions.size(); ++i)
    regions[i] = {squares[i].size(), root_mean(squares[i]), root_mean(chi2[i])};
  return regions;
}

}  // namespace waymark::internal
