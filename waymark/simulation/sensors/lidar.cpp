#include "waymark/simulation/sensors/lidar.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "waymark/base/angles.hpp"

namespace waymark {
namespace {

constexpr double kNoReturn = std::numeric_limits<double>::infinity();

/// The board of an upright panel, as a box.
Occluder as_box(const Panel& panel) {
  const Eigen::Vector3d into = panel.map_T_panel.rotation() * Eigen::Vector3d::UnitZ();
  return {.centre_m = panel.map_T_panel.translation() + into * panel.thickness_m / 2,
          .yaw_rad = std::atan2(into.y(), into.x()),
          .size_m = {panel.thickness_m, panel.width_m, panel.height_m}};
}

}  // namespace

Lidar::Lidar(const World& world, const LidarOptions& options) : options_(options) {
  const auto add = [&](const Occluder& box) {
    if (std::abs(box.centre_m.z() - options_.z_m) > box.size_m.z() / 2) return;
    things_.push_back({.centre_m = box.centre_m.head<2>(),
                       .x_axis = {std::cos(box.yaw_rad), std::sin(box.yaw_rad)},
                       .half_m = box.size_m.head<2>() / 2});
  };
  for (const Wall& wall : world.walls) add(waymark::as_box(wall));
  for (const Occluder& box : world.occluders) add(box);
  for (const Panel& panel : world.panels) {
    const double lean = (panel.map_T_panel.rotation() * Eigen::Vector3d::UnitZ()).z();
    if (std::abs(lean) < 1e-6) add(as_box(panel));
  }
}

double Lidar::range_m(const Eigen::Vector2d& map_p, double angle_rad) const {
  const Eigen::Vector2d direction(std::cos(angle_rad), std::sin(angle_rad));
  double nearest = kNoReturn;
  for (const Footprint& thing : things_) {
    const Eigen::Vector2d away = map_p - thing.centre_m;
    const auto across = [&](const Eigen::Vector2d& v) {
      return thing.x_axis.x() * v.y() - thing.x_axis.y() * v.x();
    };
    const Eigen::Vector2d o(thing.x_axis.dot(away), across(away));
    const Eigen::Vector2d d(thing.x_axis.dot(direction), across(direction));
    double enter = 0;
    double leave = nearest;
    for (int axis = 0; axis < 2; ++axis) {
      if (d[axis] == 0) {
        if (std::abs(o[axis]) > thing.half_m[axis]) leave = -1;
        continue;
      }
      const double a = (-thing.half_m[axis] - o[axis]) / d[axis];
      const double b = (thing.half_m[axis] - o[axis]) / d[axis];
      enter = std::max(enter, std::min(a, b));
      leave = std::min(leave, std::max(a, b));
    }
    if (enter <= leave) nearest = enter;
  }
  return nearest;
}

LaserScan Lidar::scan(const SE2& map_T_base, const Eigen::Vector3d& twist, SensorTime stamp,
                      Random& random) const {
  const double turn_s = options_.rate_hz > 0 ? 1 / options_.rate_hz : 0;
  const double step_s = turn_s / options_.rays;
  LaserScan scan{.stamp = stamp - Duration(std::llround(turn_s * 1e9)),
                 .angle_min_rad = to_radians(options_.first_ray_deg),
                 .angle_increment_rad = 2 * std::numbers::pi / options_.rays,
                 .time_increment_s = step_s,
                 .range_min_m = options_.range_min_m,
                 .range_max_m = options_.range_max_m};
  const SE2 base_T_lidar(options_.x_m, options_.y_m, to_radians(options_.yaw_deg));
  scan.ranges_m.reserve(static_cast<std::size_t>(options_.rays));
  for (int i = 0; i < options_.rays; ++i) {
    const SE2 map_T_lidar = map_T_base * SE2::exp(twist * (i * step_s - turn_s)) * base_T_lidar;
    const double angle = map_T_lidar.yaw() + scan.angle_min_rad + i * scan.angle_increment_rad;
    const double measured = range_m(map_T_lidar.translation(), angle) + options_.noise_m * random.normal();
    const bool lost = random.uniform() < options_.dropout;
    const bool inside = measured >= options_.range_min_m && measured <= options_.range_max_m;
    scan.ranges_m.push_back(static_cast<float>(inside && !lost ? measured : kNoReturn));
  }
  return scan;
}

}  // namespace waymark
