#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "waymark/evaluation/error_statistics.hpp"
#include "waymark/samples/trajectory.hpp"

/// How far a trajectory is from a path that is known without times: a tape on the floor, a route.
namespace waymark {

/// Corners of a path on the floor, joined by straight lines [m].
struct FloorPath {
  std::vector<Eigen::Vector2d> corners{};
  bool closed = false;  ///< from the last back to the first
};

struct PathScores {
  ErrorStatistics distance_m{};  ///< from the nearest point of the path
  /// Signed distances (left of it is positive) from the line of the side that points most as the robot does,
  /// however far it is: what one reads off by hand when each side is judged for itself.
  ErrorStatistics side_m{};
  double side_mean_m = 0;  ///< of the signed distances: an offset to one hand shows here
};

/// Nothing when the path has fewer than two corners or there is no estimate. O(estimates * corners).
[[nodiscard]] std::optional<PathScores> score_path(const EstimatedTrajectory& estimated,
                                                   const FloorPath& path);

/// The way of a trajectory, a corner each `step_m` or more.
[[nodiscard]] FloorPath floor_path(const Trajectory& trajectory, double step_m);

}  // namespace waymark
