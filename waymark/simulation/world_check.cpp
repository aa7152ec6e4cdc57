#include "waymark/simulation/world_check.hpp"

#include <algorithm>
#include <limits>
#include <map>

#include "waymark/geometry/planar.hpp"
#include "waymark/simulation/path.hpp"
#include "waymark/simulation/tag_occlusion.hpp"

namespace waymark {
namespace {

constexpr double kStepMetres = 0.02;

/// What is looked at from every point.
struct View {
  const World& world;
  const CameraModel& camera;
  double max_range_m = 0;
  std::vector<TagCopy> tags{};
  std::vector<Screen> screens{};
};

/// By how many points of the line one tag hides another.
using HidingPoints = std::map<std::pair<TagId, TagId>, std::size_t>;

std::size_t tags_in_view(const View& view, const SE3& map_T_cam, HidingPoints& hiding) {
  const SE3 cam_T_map = map_T_cam.inverse();
  const Eigen::Vector3d& eye = map_T_cam.translation();
  std::size_t seen = 0;
  for (const TagCopy& tag : view.tags) {
    if ((tag.placed.map_T_tag.translation() - eye).norm() > view.max_range_m) continue;
    if (!visible_corners(view.camera, cam_T_map * tag.placed.map_T_tag, tag.placed.size_m)) continue;
    if (!walls_leave_open(view.world, eye, tag.placed)) continue;
    const Screen* screen = hiding_screen(view.screens, eye, tag.placed);
    if (screen == nullptr || view.world.corners_through_paper) ++seen;
    if (screen != nullptr && screen->tag) ++hiding[{tag.tag, *screen->tag}];
  }
  return seen;
}

std::vector<std::pair<TagId, TagId>> overlapping_tags(World world) {
  world.tag_board_m = 0;  // the back of a tag is no other tag
  const std::vector<TagCopy> tags = readable_tags(world);
  std::vector<std::pair<TagId, TagId>> pairs;
  for (std::size_t i = 0; i < tags.size(); ++i) {
    for (std::size_t k = i + 1; k < tags.size(); ++k) {
      if (overlap(tags[i], tags[k])) pairs.emplace_back(tags[i].tag, tags[k].tag);
    }
  }
  return pairs;
}

}  // namespace

Result<WorldCheck> check_world(const World& world, const RobotModel& robot, const CameraModel& camera,
                               const TagCameraOptions& options) {
  const auto path = sample_path(world.path_m, world.path_closed, kStepMetres);
  if (path.size() < 3)
    return fail(ErrorCode::InvalidArgument, "the world has no line to drive", {.source = world.name},
                "Give path_m three distinct points or more.");
  WorldCheck check{.lap_m = path.back().arc_length_m + (world.path_closed ? path[1].arc_length_m : 0),
                   .min_clearance_m = std::numeric_limits<double>::infinity(),
                   .fewest_tags = world.tags.tags.size(),
                   .overlapping = overlapping_tags(world)};
  const View view{world, camera, options.max_range_m, readable_tags(world), screens_of(world)};
  HidingPoints hiding;
  std::size_t with_two = 0;
  std::size_t with_one = 0;
  for (const PathPoint& point : path) {
    const SE3 map_T_base = lift(point.map_T_path);
    const std::size_t seen = tags_in_view(view, map_T_base * robot.base_T_cam, hiding);
    with_two += seen >= 2 ? 1 : 0;
    with_one += seen >= 1 ? 1 : 0;
    check.fewest_tags = std::min(check.fewest_tags, seen);
    check.sharpest_left_1_m = std::max(check.sharpest_left_1_m, point.curvature_1_m);
    check.sharpest_right_1_m = std::max(check.sharpest_right_1_m, -point.curvature_1_m);
    for (const auto& [tag, mapped] : world.tags.tags) {
      const double clearance = clearance_m(robot.hull, map_T_base, mapped);
      if (clearance >= check.min_clearance_m) continue;
      check.min_clearance_m = clearance;
      check.nearest_tag = tag;
      check.nearest_place_m = point.map_T_path.translation();
    }
  }
  for (const auto& [tags, points] : hiding)
    check.hidden.push_back({tags.first, tags.second, kStepMetres * static_cast<double>(points)});
  check.two_tags_fraction = static_cast<double>(with_two) / static_cast<double>(path.size());
  check.one_tag_fraction = static_cast<double>(with_one) / static_cast<double>(path.size());
  return check;
}

}  // namespace waymark
