#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "waymark/samples/trajectory.hpp"

namespace waymark::internal {

/// A pose on the floor with the way to it.
struct PathPose {
  Eigen::Vector2d map_p = Eigen::Vector2d::Zero();
  double yaw_rad = 0;
  double arc_length_m = 0;
  std::size_t pose = 0;    ///< index into the trajectory
  bool backwards = false;  ///< the way to it; of the first pose, the way from it
};

/// The poses of a trajectory that are at least `step_m` from the one before: standing still counts once.
[[nodiscard]] std::vector<PathPose> driven_path(const Trajectory& trajectory, double step_m);

/// Where the path comes back to its start, pointing the same way: the arc length of one lap. Nothing when it
/// does not.
[[nodiscard]] std::optional<double> lap_length_m(const std::vector<PathPose>& path);

/// The nearest point of a path.
struct PathFoot {
  double arc_length_m = 0;
  double distance_m = 0;
  double yaw_rad = 0;
};

/// Nearest point anywhere on the path where it points within a right angle of `yaw_rad`.
[[nodiscard]] std::optional<PathFoot> nearest_foot(const std::vector<PathPose>& path, const PathPose& at);
/// Nearest point with an arc length in [from_m, to_m] where the path was driven forwards or backwards as the
/// pose is: after a change of direction it leads over itself. Nothing when there is none. O(log poses +
/// window).
[[nodiscard]] std::optional<PathFoot> nearest_foot(const std::vector<PathPose>& path, const PathPose& at,
                                                   double from_m, double to_m);

}  // namespace waymark::internal
