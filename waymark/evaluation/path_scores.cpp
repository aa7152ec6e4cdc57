#include "waymark/evaluation/path_scores.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "waymark/evaluation/driven_path.hpp"
#include "waymark/geometry/planar.hpp"

namespace waymark {
namespace {

/// A side of the path: where it begins, which way it points (a unit vector), how long it is.
struct Side {
  Eigen::Vector2d begin{};
  Eigen::Vector2d along{};
  double length_m = 0;
};

std::vector<Side> sides_of(const FloorPath& path) {
  std::vector<Side> sides;
  const std::size_t n = path.corners.size();
  for (std::size_t i = 0; i + (path.closed ? 0 : 1) < n; ++i) {
    const Eigen::Vector2d way = path.corners[(i + 1) % n] - path.corners[i];
    if (way.norm() > 0) sides.push_back({path.corners[i], way.normalized(), way.norm()});
  }
  return sides;
}

double distance_m(const Side& side, const Eigen::Vector2d& p) {
  const double foot = std::clamp((p - side.begin).dot(side.along), 0.0, side.length_m);
  return (p - side.begin - foot * side.along).norm();
}

double left_of_m(const Side& side, const Eigen::Vector2d& p) {
  const Eigen::Vector2d r = p - side.begin;
  return side.along.x() * r.y() - side.along.y() * r.x();
}

double nearest_m(const std::vector<Side>& sides, const Eigen::Vector2d& p) {
  double nearest = std::numeric_limits<double>::infinity();
  for (const Side& side : sides) nearest = std::min(nearest, distance_m(side, p));
  return nearest;
}

/// The side that points most as the robot does; of those that point alike, the nearest.
const Side& side_driven(const std::vector<Side>& sides, const SE2& map_T_base) {
  constexpr double kAlike = 1e-3;
  const Eigen::Vector2d ahead(std::cos(map_T_base.yaw()), std::sin(map_T_base.yaw()));
  const Eigen::Vector2d& p = map_T_base.translation();
  const Side* best = &sides.front();
  for (const Side& side : sides) {
    const double gain = side.along.dot(ahead) - best->along.dot(ahead);
    if (gain > kAlike || (gain > -kAlike && distance_m(side, p) < distance_m(*best, p))) best = &side;
  }
  return *best;
}

}  // namespace

std::optional<PathScores> score_path(const EstimatedTrajectory& estimated, const FloorPath& path) {
  const std::vector<Side> sides = sides_of(path);
  if (sides.empty() || estimated.empty()) return std::nullopt;
  std::vector<double> distances;
  std::vector<double> from_side;
  double sum = 0;
  for (const EstimatedPose& estimate : estimated) {
    const SE2 map_T_base = project_to_plane(estimate.map_T_base);
    distances.push_back(nearest_m(sides, map_T_base.translation()));
    from_side.push_back(left_of_m(side_driven(sides, map_T_base), map_T_base.translation()));
    sum += from_side.back();
  }
  const double mean = sum / static_cast<double>(estimated.size());
  return PathScores{statistics_of(std::move(distances)), statistics_of(std::move(from_side)), mean};
}

FloorPath floor_path(const Trajectory& trajectory, double step_m) {
  FloorPath path;
  for (const internal::PathPose& pose : internal::driven_path(trajectory, step_m))
    path.corners.push_back(pose.map_p);
  return path;
}

}  // namespace waymark
