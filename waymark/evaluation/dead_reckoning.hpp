#pragma once

#include <vector>

#include "waymark/samples/robot_samples.hpp"
#include "waymark/samples/trajectory.hpp"

/// Baselines for estimators: trajectories computed from motion sensors alone, without tags.
namespace waymark {

/// Poses from the wheel odometry, in its own frame.
[[nodiscard]] Trajectory wheel_odometry(const std::vector<Odometry>& odometry);

/// Combines the distance from the wheels with the rotation from the gyro (its z axis, constant between
/// samples; its bias is not removed). Returns one pose for each odometry sample, starting at the first time
/// covered by both. Both inputs must be in time order; the result is empty if they do not overlap. O(odometry
/// + imu).
[[nodiscard]] Trajectory gyro_odometry(const std::vector<Odometry>& odometry,
                                       const std::vector<ImuSample>& imu);

/// The trajectory, moved rigidly so that it passes through `start` at the time of `start`, for dead reckoning
/// from a known pose. Earlier poses are removed; the result is empty if the trajectory does not cover that
/// time.
[[nodiscard]] EstimatedTrajectory placed_at(const Trajectory& trajectory, const StampedPose& start);

}  // namespace waymark
