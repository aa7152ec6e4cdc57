#include "waymark/replay/lidar_zone.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace waymark {
namespace {

/// Way along a circle that leaves the base straight ahead, and distance beside it to the left.
struct Along {
  double way_m = 0;
  double beside_m = 0;
};

Along along_curve(const Eigen::Vector2d& base_p, double curvature_1_m) {
  if (std::abs(curvature_1_m) < 1e-3) return {base_p.x(), base_p.y()};
  const double radius = 1 / curvature_1_m;
  const Eigen::Vector2d from_centre = base_p - Eigen::Vector2d(0, radius);
  const double sign = radius > 0 ? 1 : -1;
  const double angle = std::atan2(from_centre.x() * sign, -from_centre.y() * sign);
  return {angle * std::abs(radius), sign * (std::abs(radius) - from_centre.norm())};
}

}  // namespace

double free_way_m(const LaserScan& scan, const SE2& base_T_lidar, const Hull& hull, double curvature_1_m,
                  bool backwards, double margin_m, double reach_m) {
  double free_m = std::numeric_limits<double>::infinity();
  const double front = backwards ? hull.rear_m : hull.front_m;
  for (std::size_t i = 0; i < scan.ranges_m.size(); ++i) {
    const double range = static_cast<double>(scan.ranges_m[i]);
    if (!(range >= scan.range_min_m && range <= scan.range_max_m)) continue;
    const double angle = scan.angle_min_rad + static_cast<double>(i) * scan.angle_increment_rad;
    Eigen::Vector2d p = base_T_lidar * Eigen::Vector2d(range * std::cos(angle), range * std::sin(angle));
    const bool inside = p.x() > -hull.rear_m && p.x() < hull.front_m && std::abs(p.y()) < hull.width_m / 2;
    if (inside) continue;
    if (backwards) p.x() = -p.x();  // the same curve seen in a mirror
    const Along at = along_curve(p, curvature_1_m);
    if (std::abs(at.beside_m) > hull.width_m / 2 + margin_m) continue;
    const double way = at.way_m - front;
    if (at.way_m > 0 && way < reach_m) free_m = std::min(free_m, std::max(way, 0.0));
  }
  return free_m;
}

}  // namespace waymark
