#include "waymark/simulation/world.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace waymark {
namespace {

/// A vector of the map in the axes of the box.
Eigen::Vector3d turned(const Eigen::Vector3d& v, double cosine, double sine) {
  return {cosine * v.x() + sine * v.y(), -sine * v.x() + cosine * v.y(), v.z()};
}

}  // namespace

SE3 upright_tag(const Eigen::Vector3d& map_t_tag, double facing_rad) {
  const Eigen::Vector3d to_reader(std::cos(facing_rad), std::sin(facing_rad), 0);
  Eigen::Matrix3d map_R_tag;
  map_R_tag.col(2) = -to_reader;                                // z into the tag
  map_R_tag.col(1) = -Eigen::Vector3d::UnitZ();                 // y down
  map_R_tag.col(0) = map_R_tag.col(1).cross(map_R_tag.col(2));  // x right, as its reader sees it
  return {SO3::from_matrix(map_R_tag), map_t_tag};
}

SE3 leaning_tag(const Eigen::Vector3d& map_t_tag, double facing_rad, double tilt_rad) {
  return upright_tag(map_t_tag, facing_rad) *
         SE3(SO3::exp(Eigen::Vector3d(-tilt_rad, 0, 0)), Eigen::Vector3d::Zero());
}

MappedTag back_of(const MappedTag& tag, double board_m) {
  MappedTag back = tag;
  back.map_T_tag = tag.map_T_tag * SE3(SO3::exp({0, std::numbers::pi, 0}), {0, 0, board_m});
  return back;
}

std::vector<TagCopy> readable_tags(const World& world) {
  std::vector<TagCopy> all;
  for (const auto& [id, tag] : world.tags.tags) all.push_back({id, tag});
  all.insert(all.end(), world.copies.begin(), world.copies.end());
  if (world.tag_board_m <= 0) return all;
  for (std::size_t i = 0, fronts = all.size(); i < fronts; ++i)
    all.push_back({all[i].tag, back_of(all[i].placed, world.tag_board_m)});
  return all;
}

Occluder as_box(const Wall& wall) {
  const Eigen::Vector2d along = wall.to_m - wall.from_m;
  const Eigen::Vector2d middle = (wall.from_m + wall.to_m) / 2;
  return {.centre_m = {middle.x(), middle.y(), wall.height_m / 2},
          .yaw_rad = std::atan2(along.y(), along.x()),
          .size_m = {along.norm(), wall.thickness_m, wall.height_m},
          .reflectance = wall.reflectance};
}

double ray_length(const Occluder& box, const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const double cosine = std::cos(box.yaw_rad);
  const double sine = std::sin(box.yaw_rad);
  const Eigen::Vector3d o = turned(origin - box.centre_m, cosine, sine);
  const Eigen::Vector3d d = turned(direction, cosine, sine);
  double enter = 0;
  double leave = kInfinity;
  for (int axis = 0; axis < 3; ++axis) {
    const double half = box.size_m[axis] / 2;
    if (d[axis] == 0) {
      if (std::abs(o[axis]) > half) return kInfinity;
      continue;
    }
    const double a = (-half - o[axis]) / d[axis];
    const double b = (half - o[axis]) / d[axis];
    enter = std::max(enter, std::min(a, b));
    leave = std::min(leave, std::max(a, b));
  }
  return enter <= leave ? enter : kInfinity;
}

bool line_of_sight(const World& world, const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  constexpr double kAlmostThere = 0.99;
  const Eigen::Vector3d direction = to - from;
  const auto blocks = [&](const Occluder& box) { return ray_length(box, from, direction) < kAlmostThere; };
  return std::ranges::none_of(world.occluders, blocks) &&
         std::ranges::none_of(world.walls, [&](const Wall& wall) { return blocks(as_box(wall)); });
}

}  // namespace waymark
