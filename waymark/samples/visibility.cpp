#include "waymark/samples/visibility.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace waymark {

std::array<Eigen::Vector3d, 4> tag_corners(double size_m) {
  const double h = size_m / 2;
  return {Eigen::Vector3d(-h, -h, 0), Eigen::Vector3d(h, -h, 0), Eigen::Vector3d(h, h, 0),
          Eigen::Vector3d(-h, h, 0)};
}

std::optional<std::array<Eigen::Vector2d, 4>> visible_corners(const CameraModel& camera, const SE3& cam_T_tag,
                                                              double size_m, const VisibilityLimits& limits) {
  const Eigen::Vector3d cam_normal = cam_T_tag.rotation() * Eigen::Vector3d::UnitZ();  // away from the viewer
  const double cos_incidence = cam_normal.dot(cam_T_tag.translation().normalized());
  if (!(cos_incidence > std::cos(limits.max_incidence_rad))) return std::nullopt;
  std::array<Eigen::Vector2d, 4> corners_px;
  const auto corners = tag_corners(size_m);
  for (std::size_t i = 0; i < corners.size(); ++i) {
    const auto px = camera.project(cam_T_tag * corners[i]);
    if (!px) return std::nullopt;
    const bool inside = px->x() >= limits.margin_px && px->y() >= limits.margin_px &&
                        px->x() <= camera.width_px() - limits.margin_px &&
                        px->y() <= camera.height_px() - limits.margin_px;
    if (!inside) return std::nullopt;
    corners_px[i] = *px;
  }
  for (std::size_t i = 0; i < corners_px.size(); ++i) {
    if ((corners_px[(i + 1) % 4] - corners_px[i]).norm() < limits.min_side_px) return std::nullopt;
  }
  return corners_px;
}

std::vector<TagId> visible_tags(const TagMap& map, const CameraModel& camera, const SE3& map_T_cam,
                                const VisibilityLimits& limits) {
  const SE3 cam_T_map = map_T_cam.inverse();
  std::vector<TagId> seen;
  for (const auto& [id, tag] : map.tags) {
    if (visible_corners(camera, cam_T_map * tag.map_T_tag, tag.size_m, limits)) seen.push_back(id);
  }
  return seen;
}

double clearance_m(const Hull& hull, const SE3& map_T_base, const MappedTag& tag) {
  const SE3 base_T_tag = map_T_base.inverse() * tag.map_T_tag;
  const SE3 tag_T_base = base_T_tag.inverse();
  const Eigen::Vector3d base_low(-hull.rear_m, -hull.width_m / 2, 0);
  const Eigen::Vector3d base_high(hull.front_m, hull.width_m / 2, hull.height_m);
  const Eigen::Vector3d tag_high(tag.size_m / 2, tag.size_m / 2, 0);
  constexpr int kMaxSteps = 10000;
  constexpr double kRelativeTolerance = 1e-12;
  Eigen::Vector3d base_p = base_T_tag.translation();
  double distance = std::numeric_limits<double>::infinity();
  for (int step = 0; step < kMaxSteps; ++step) {
    const Eigen::Vector3d in_hull = base_p.cwiseMax(base_low).cwiseMin(base_high);
    const Eigen::Vector3d tag_p = tag_T_base * in_hull;
    base_p = base_T_tag * tag_p.cwiseMax(-tag_high).cwiseMin(tag_high);
    const double now = (base_p - in_hull).norm();
    if (distance - now < kRelativeTolerance * (1 + now)) return now;
    distance = now;
  }
  return distance;
}

double clearance_m(const Hull& hull, const SE3& map_T_base, const TagMap& map) {
  double nearest = std::numeric_limits<double>::infinity();
  for (const auto& [id, tag] : map.tags) nearest = std::min(nearest, clearance_m(hull, map_T_base, tag));
  return nearest;
}

}  // namespace waymark
