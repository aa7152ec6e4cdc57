#include "waymark/simulation/tag_camera.hpp"

#include <algorithm>
#include <cmath>

#include "waymark/simulation/tag_occlusion.hpp"

namespace waymark {
namespace {

double shortest_side(const std::array<Eigen::Vector2d, 4>& corners) {
  double shortest = (corners[0] - corners[3]).norm();
  for (std::size_t i = 1; i < corners.size(); ++i)
    shortest = std::min(shortest, (corners[i] - corners[i - 1]).norm());
  return shortest;
}

/// What tags may be hidden by.
struct Obstacles {
  const World& world;
  std::vector<Screen> screens{};
};

/// Adds what the camera sees of one tag.
void see(const Obstacles& obstacles, const CameraModel& camera, const SE3& cam_T_map, const TagId& id,
         const MappedTag& tag, const TagCameraOptions& options, Random& random, TagFrame& frame) {
  const Eigen::Vector3d cam_p_tag = cam_T_map * tag.map_T_tag.translation();
  if (cam_p_tag.z() <= 0 || cam_p_tag.norm() > options.max_range_m) return;
  const auto corners = visible_corners(camera, cam_T_map * tag.map_T_tag, tag.size_m);
  if (!corners) return;
  const Eigen::Vector3d eye = cam_T_map.inverse().translation();
  if (!walls_leave_open(obstacles.world, eye, tag) || hiding_screen(obstacles.screens, eye, tag) != nullptr)
    return;
  if (random.uniform() < options.miss_probability) return;
  const double sigma =
      std::hypot(options.corner_sigma_px, options.small_tag_sigma_px / shortest_side(*corners));
  TagDetection detection{.tag = id, .hamming = 0, .decision_margin = 80, .corners_px = *corners};
  for (auto& corner : detection.corners_px) {
    // One draw a statement: compilers differ in which argument of a call comes first.
    const double v = random.normal();
    const double u = random.normal();
    corner += sigma * Eigen::Vector2d(u, v);
  }
  detection.corner_covariance_px2 = CornerCovariance::Identity() * std::max(sigma * sigma, 1e-12);
  frame.detections.push_back(detection);
}

}  // namespace

TagFrame see_tags(const World& world, const CameraModel& camera, const SE3& map_T_cam, SensorTime stamp,
                  const TagCameraOptions& options, Random& random) {
  TagFrame frame{.stamp = stamp};
  const SE3 cam_T_map = map_T_cam.inverse();
  const Obstacles obstacles{world, world.corners_through_paper ? std::vector<Screen>() : screens_of(world)};
  for (const TagCopy& tag : readable_tags(world))
    see(obstacles, camera, cam_T_map, tag.tag, tag.placed, options, random, frame);
  return frame;
}

}  // namespace waymark
