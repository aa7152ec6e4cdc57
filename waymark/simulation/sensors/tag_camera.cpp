#include "waymark/simulation/sensors/tag_camera.hpp"

#include <algorithm>
#include <cmath>

#include "waymark/families/family.hpp"
#include "waymark/samples/visibility.hpp"

namespace waymark {
namespace {

constexpr double kSamePlane_m = 0.005;

using Polygon = std::vector<Eigen::Vector3d>;

/// The part of a convex polygon where the affine function `inside` is positive.
template <class Inside>
Polygon clipped(const Polygon& polygon, const Inside& inside) {
  Polygon result;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Eigen::Vector3d& a = polygon[i];
    const Eigen::Vector3d& b = polygon[i + 1 < polygon.size() ? i + 1 : 0];
    const double at_a = inside(a);
    const double at_b = inside(b);
    if (at_a > 0) result.push_back(a);
    if ((at_a > 0) != (at_b > 0)) result.emplace_back(a + (b - a) * (at_a / (at_a - at_b)));
  }
  return result;
}

/// Whether part of the polygon overlaps the rectangle when viewed along z.
bool meets(Polygon polygon, double half_width, double half_height) {
  polygon = clipped(polygon, [&](const Eigen::Vector3d& p) { return half_width - p.x(); });
  polygon = clipped(polygon, [&](const Eigen::Vector3d& p) { return half_width + p.x(); });
  polygon = clipped(polygon, [&](const Eigen::Vector3d& p) { return half_height - p.y(); });
  polygon = clipped(polygon, [&](const Eigen::Vector3d& p) { return half_height + p.y(); });
  return polygon.size() > 2;
}

Polygon black_square(const SE3& frame_T_tag, double size_m) {
  Polygon square;
  for (const Eigen::Vector3d& corner : tag_corners(size_m)) square.push_back(frame_T_tag * corner);
  return square;
}

/// Whether the paper of one tag covers part of the black square of the other.
bool lies_on(const TagCopy& paper, const TagCopy& square) {
  const Screen screen = paper_of(paper.tag, paper.placed, 0);
  Polygon cut = black_square(screen.screen_T_map * square.placed.map_T_tag, square.placed.size_m);
  cut = clipped(cut, [](const Eigen::Vector3d& p) { return kSamePlane_m - p.z(); });
  cut = clipped(cut, [](const Eigen::Vector3d& p) { return kSamePlane_m + p.z(); });
  return meets(std::move(cut), screen.half_width_m, screen.half_height_m);
}

}  // namespace

Screen paper_of(const TagId& tag, const MappedTag& placed, double margin_cells) {
  const Family& tags = family(tag.family);
  const double half_m = placed.size_m / tags.width_at_border * (tags.total_width + 2 * margin_cells) / 2;
  return {.screen_T_map = placed.map_T_tag.inverse(),
          .half_width_m = half_m,
          .half_height_m = half_m,
          .tag = tag};
}

std::vector<Screen> screens_of(const World& world) {
  std::vector<Screen> screens;
  for (const TagCopy& copy : readable_tags(world))
    screens.push_back(paper_of(copy.tag, copy.placed, world.tag_margin_cells));
  for (const Panel& panel : world.panels)
    screens.push_back({.screen_T_map = panel.map_T_panel.inverse(),
                       .half_width_m = panel.width_m / 2,
                       .half_height_m = panel.height_m / 2});
  return screens;
}

bool hides(const Screen& screen, const Eigen::Vector3d& map_p_eye, const MappedTag& tag) {
  const Eigen::Vector3d eye = screen.screen_T_map * map_p_eye;
  if (eye.z() == 0) return false;  // the screen is seen edge-on
  const double side = eye.z() > 0 ? 1 : -1;
  const auto behind = [&](const Eigen::Vector3d& p) { return -side * p.z() - kSamePlane_m; };
  Polygon seen = clipped(black_square(screen.screen_T_map * tag.map_T_tag, tag.size_m), behind);
  for (Eigen::Vector3d& p : seen) p = eye + (p - eye) * (eye.z() / (eye.z() - p.z()));
  return meets(std::move(seen), screen.half_width_m, screen.half_height_m);
}

const Screen* hiding_screen(std::span<const Screen> screens, const Eigen::Vector3d& map_p_eye,
                            const MappedTag& tag) {
  const auto found =
      std::ranges::find_if(screens, [&](const Screen& screen) { return hides(screen, map_p_eye, tag); });
  return found == screens.end() ? nullptr : &*found;
}

bool walls_leave_open(const World& world, const Eigen::Vector3d& map_p_eye, const MappedTag& tag) {
  if (world.walls.empty() && world.occluders.empty()) return true;
  if (!line_of_sight(world, map_p_eye, tag.map_T_tag.translation())) return false;
  return std::ranges::all_of(tag_corners(tag.size_m), [&](const Eigen::Vector3d& corner) {
    return line_of_sight(world, map_p_eye, tag.map_T_tag * corner);
  });
}

bool overlap(const TagCopy& a, const TagCopy& b) {
  constexpr double kBackToBack = -0.9;  // maximum cosine of the angle between their normals
  const auto normal = [](const TagCopy& tag) -> Eigen::Vector3d {
    return tag.placed.map_T_tag.rotation() * Eigen::Vector3d::UnitZ();
  };
  if (normal(a).dot(normal(b)) < kBackToBack) return false;
  return lies_on(a, b) || lies_on(b, a);
}

namespace {

double shortest_side(const std::array<Eigen::Vector2d, 4>& corners) {
  double shortest = (corners[0] - corners[3]).norm();
  for (std::size_t i = 1; i < corners.size(); ++i)
    shortest = std::min(shortest, (corners[i] - corners[i - 1]).norm());
  return shortest;
}

/// Objects that can hide a tag.
struct Obstacles {
  const World& world;
  std::vector<Screen> screens{};
};

/// Adds the detection of one tag if it is in view.
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
    // One draw per statement, because the evaluation order of arguments differs between compilers.
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
