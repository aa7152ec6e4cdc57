#include "waymark/evaluation/driven_path.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "waymark/geometry/planar.hpp"

namespace waymark::internal {
namespace {

double angle_between(double from, double to) { return std::remainder(to - from, 2 * std::numbers::pi); }

/// Nearest point on the segment from pose i to the next.
PathFoot foot_on(const std::vector<PathPose>& path, std::size_t i, const Eigen::Vector2d& map_p) {
  const PathPose& a = path[i];
  const PathPose& b = path[i + 1];
  const Eigen::Vector2d along = b.map_p - a.map_p;
  const double u = std::clamp((map_p - a.map_p).dot(along) / along.squaredNorm(), 0.0, 1.0);
  return {.arc_length_m = a.arc_length_m + u * (b.arc_length_m - a.arc_length_m),
          .distance_m = (map_p - a.map_p - u * along).norm(),
          .yaw_rad = a.yaw_rad + u * angle_between(a.yaw_rad, b.yaw_rad)};
}

void keep_nearer(std::optional<PathFoot>& nearest, const PathFoot& foot) {
  if (!nearest || foot.distance_m < nearest->distance_m) nearest = foot;
}

}  // namespace

std::vector<PathPose> driven_path(const Trajectory& trajectory, double step_m) {
  std::vector<PathPose> path;
  for (std::size_t i = 0; i < trajectory.size(); ++i) {
    const SE2 map_T_base = project_to_plane(trajectory[i].map_T_base);
    double arc = 0;
    bool backwards = false;
    if (!path.empty()) {
      const Eigen::Vector2d way = map_T_base.translation() - path.back().map_p;
      if (way.norm() < step_m) continue;
      arc = path.back().arc_length_m + way.norm();
      backwards = way.dot(map_T_base.rotation() * Eigen::Vector2d::UnitX()) < 0;
      if (path.size() == 1) path.front().backwards = backwards;
    }
    path.push_back({map_T_base.translation(), map_T_base.yaw(), arc, i, backwards});
  }
  return path;
}

std::optional<double> lap_length_m(const std::vector<PathPose>& path) {
  constexpr double kSameHeading = 0.8;  // [rad]
  double farthest = 0;
  for (const PathPose& at : path) farthest = std::max(farthest, (at.map_p - path[0].map_p).norm());
  const double back_m = std::min(1.0, farthest / 4);  // [m] distance from the start that counts as a return …
  const double away_m = std::min(2.0, farthest / 2);  // [m] … once this distance has been exceeded
  bool was_away = false;
  std::optional<PathFoot> closing;
  for (std::size_t i = 0; i + 1 < path.size(); ++i) {
    const double distance = (path[i].map_p - path[0].map_p).norm();
    was_away = was_away || distance > away_m;
    if (!was_away) continue;
    if (closing && distance > back_m) break;  // beyond the first return
    if (distance > back_m || std::abs(angle_between(path[0].yaw_rad, path[i].yaw_rad)) > kSameHeading)
      continue;
    keep_nearer(closing, foot_on(path, i, path[0].map_p));
  }
  return closing ? std::optional(closing->arc_length_m) : std::nullopt;
}

std::optional<PathFoot> nearest_foot(const std::vector<PathPose>& path, const PathPose& at) {
  std::optional<PathFoot> nearest;
  for (std::size_t i = 0; i + 1 < path.size(); ++i) {
    const PathFoot foot = foot_on(path, i, at.map_p);
    if (std::abs(angle_between(foot.yaw_rad, at.yaw_rad)) < std::numbers::pi / 2) keep_nearer(nearest, foot);
  }
  return nearest;
}

std::optional<PathFoot> nearest_foot(const std::vector<PathPose>& path, const PathPose& at, double from_m,
                                     double to_m) {
  const auto first = std::ranges::lower_bound(path, from_m, {}, &PathPose::arc_length_m);
  std::optional<PathFoot> nearest;
  for (auto i = static_cast<std::size_t>(first - path.begin()); i + 1 < path.size(); ++i) {
    if (path[i].arc_length_m > to_m) break;
    if (path[i + 1].backwards == at.backwards) keep_nearer(nearest, foot_on(path, i, at.map_p));
  }
  return nearest;
}

}  // namespace waymark::internal
