#pragma once

#include <vector>

#include "waymark/samples/robot_samples.hpp"
#include "waymark/samples/trajectory.hpp"

/// Baselines for estimators: trajectories from motion sensors alone, without tags.
namespace waymark {

/// Poses of the wheel odometry, in its own frame.
[[nodiscard]] Trajectory wheel_odometry(const std::vector<Odometry>& odometry);

/// Distance by the wheels, rotation by the gyro (its z axis, constant between samples; its bias is not
/// removed). Returns one pose for each odometry sample, from the first time that both cover. Both inputs must
/// be in time order; the result is empty if they do not overlap. O(odometry + imu).
[[nodiscard]] Trajectory gyro_odometry(const std::vector<Odometry>& odometry,
                                       const std::vector<ImuSample>& imu);

/// The trajectory, moved rigidly so that it passes through `start` at its time, for dead reckoning from a
/// known start. Earlier poses are removed; the result is empty if the trajectory does not cover that time.
[[nodiscard]] EstimatedTrajectory placed_at(const Trajectory& trajectory, const StampedPose& start);

}  // namespace waymark
