#include "waymark/simulation/world_check.hpp"

#include <algorithm>
#include <limits>

#include "waymark/geometry/planar.hpp"
#include "waymark/simulation/path.hpp"

namespace waymark {
namespace {

constexpr double kStepMetres = 0.02;

std::size_t tags_in_view(const World& world, const std::vector<TagCopy>& tags, const CameraModel& camera,
                         const SE3& map_T_cam, double max_range_m) {
  const SE3 cam_T_map = map_T_cam.inverse();
  return static_cast<std::size_t>(std::ranges::count_if(tags, [&](const TagCopy& tag) {
    const Eigen::Vector3d& place = tag.placed.map_T_tag.translation();
    return (place - map_T_cam.translation()).norm() <= max_range_m &&
           visible_corners(camera, cam_T_map * tag.placed.map_T_tag, tag.placed.size_m) &&
           line_of_sight(world, map_T_cam.translation(), place);
  }));
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
                   .fewest_tags = world.tags.tags.size()};
  const std::vector<TagCopy> tags = readable_tags(world);
  std::size_t with_two = 0;
  std::size_t with_one = 0;
  for (const PathPoint& point : path) {
    const SE3 map_T_base = lift(point.map_T_path);
    const std::size_t seen =
        tags_in_view(world, tags, camera, map_T_base * robot.base_T_cam, options.max_range_m);
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
  check.two_tags_fraction = static_cast<double>(with_two) / static_cast<double>(path.size());
  check.one_tag_fraction = static_cast<double>(with_one) / static_cast<double>(path.size());
  return check;
}

}  // namespace waymark
