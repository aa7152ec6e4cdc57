#pragma once

#include "waymark/samples/trajectory.hpp"

namespace waymark::python {

/// The trajectory type of Python, with optional covariances.
struct PoseList {
  EstimatedTrajectory poses{};
};

[[nodiscard]] inline Trajectory plain(const PoseList& list) {
  Trajectory trajectory;
  trajectory.reserve(list.poses.size());
  for (const EstimatedPose& pose : list.poses) trajectory.push_back({pose.stamp, pose.map_T_base});
  return trajectory;
}

[[nodiscard]] inline PoseList listed(const Trajectory& trajectory) {
  PoseList list;
  list.poses.reserve(trajectory.size());
  for (const StampedPose& pose : trajectory) list.poses.push_back({pose.stamp, pose.map_T_base, {}});
  return list;
}

}  // namespace waymark::python
