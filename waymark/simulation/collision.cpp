#include "waymark/simulation/collision.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace waymark {
namespace {

/// A rectangle in the plane: corners counter-clockwise.
struct Rectangle {
  SE2 map_T_rectangle{};
  Eigen::Vector2d half_m = Eigen::Vector2d::Zero();

  [[nodiscard]] std::array<Eigen::Vector2d, 4> corners() const {
    std::array<Eigen::Vector2d, 4> points;
    constexpr std::array<std::array<double, 2>, 4> kSigns{{{1, 1}, {-1, 1}, {-1, -1}, {1, -1}}};
    for (std::size_t i = 0; i < 4; ++i)
      points[i] = map_T_rectangle * Eigen::Vector2d(kSigns[i][0] * half_m.x(), kSigns[i][1] * half_m.y());
    return points;
  }
  [[nodiscard]] double distance_m(const Eigen::Vector2d& map_p) const {
    const Eigen::Vector2d p = map_T_rectangle.inverse() * map_p;
    return (p.cwiseAbs() - half_m).cwiseMax(0).norm();
  }
};

/// Whether an edge of `a` separates the two (separating axis theorem).
bool separated(const Rectangle& a, const Rectangle& b) {
  Eigen::Vector2d low = Eigen::Vector2d::Constant(std::numeric_limits<double>::infinity());
  Eigen::Vector2d high = -low;
  for (const Eigen::Vector2d& corner : b.corners()) {
    const Eigen::Vector2d p = a.map_T_rectangle.inverse() * corner;
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  return (low.array() > a.half_m.array()).any() || (high.array() < -a.half_m.array()).any();
}

double distance_m(const Rectangle& a, const Rectangle& b) {
  if (!separated(a, b) && !separated(b, a)) return 0;
  double least = std::numeric_limits<double>::infinity();
  for (const Eigen::Vector2d& corner : a.corners()) least = std::min(least, b.distance_m(corner));
  for (const Eigen::Vector2d& corner : b.corners()) least = std::min(least, a.distance_m(corner));
  return least;
}

}  // namespace

double obstacle_distance_m(const World& world, const Hull& hull, const SE2& map_T_base) {
  const SE2 base_T_middle((hull.front_m - hull.rear_m) / 2, 0, 0);
  const Rectangle body{map_T_base * base_T_middle, {(hull.front_m + hull.rear_m) / 2, hull.width_m / 2}};
  double least = std::numeric_limits<double>::infinity();
  const auto meet = [&](const Occluder& box) {
    const double bottom_m = box.centre_m.z() - box.size_m.z() / 2;
    if (bottom_m >= hull.height_m) return;
    const SE2 map_T_box(box.centre_m.x(), box.centre_m.y(), box.yaw_rad);
    least = std::min(least, distance_m(body, {map_T_box, {box.size_m.x() / 2, box.size_m.y() / 2}}));
  };
  for (const Wall& wall : world.walls) meet(as_box(wall));
  for (const Occluder& box : world.occluders) meet(box);
  return least;
}

}  // namespace waymark
