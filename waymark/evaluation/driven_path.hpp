#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "waymark/samples/trajectory.hpp"

namespace waymark::internal {

/// A pose on the floor and its distance along the path.
struct PathPose {
  Eigen::Vector2d map_p = Eigen::Vector2d::Zero();
  double yaw_rad = 0;
  double arc_length_m = 0;
  std::size_t pose = 0;    ///< index into the trajectory
  bool backwards = false;  ///< driving direction towards the pose or, for the first pose, away from it
};

/// The poses of a trajectory that are at least `step_m` away from the previous one, so a standstill adds only
/// one pose.
[[nodiscard]] std::vector<PathPose> driven_path(const Trajectory& trajectory, double step_m);

/// Length of one lap: the arc length at which the path returns to its start with the same heading. `nullopt`
/// if it does not return.
[[nodiscard]] std::optional<double> lap_length_m(const std::vector<PathPose>& path);

/// The point on a path that is nearest to a pose.
struct PathFoot {
  double arc_length_m = 0;
  double distance_m = 0;
  double yaw_rad = 0;
};

/// Nearest point on the path at which the direction of the path is within 90 degrees of the heading of the
/// pose.
[[nodiscard]] std::optional<PathFoot> nearest_foot(const std::vector<PathPose>& path, const PathPose& at);
/// Nearest point with an arc length in [from_m, to_m] at which the path was driven in the same direction
/// (forwards or backwards) as the pose. This matters because a path overlaps itself after a change of
/// direction. `nullopt` if there is no such point. O(log poses + window).
[[nodiscard]] std::optional<PathFoot> nearest_foot(const std::vector<PathPose>& path, const PathPose& at,
                                                   double from_m, double to_m);

}  // namespace waymark::internal
