#pragma once

#include <vector>

#include "waymark/samples/robot_samples.hpp"
#include "waymark/samples/trajectory.hpp"

/// What an estimator must beat: motion without any tag.
namespace waymark {

/// The poses of the wheels' odometry, in its own frame.
[[nodiscard]] Trajectory wheel_odometry(const std::vector<Odometry>& odometry);

/// As far forward as the wheels say, turned as the gyro says (its z axis, constant between samples; an offset
/// of the gyro is not removed). A pose for each odometry sample, from the first that both cover. Both in
/// order of time; empty when they do not overlap. O(odometry + imu).
[[nodiscard]] Trajectory gyro_odometry(const std::vector<Odometry>& odometry,
                                       const std::vector<ImuSample>& imu);

/// The trajectory moved as a whole so that it passes through `start` at its time: where dead reckoning would
/// be if it had been told the start. Without what lies before; empty when it knows nothing of that time.
[[nodiscard]] EstimatedTrajectory placed_at(const Trajectory& trajectory, const StampedPose& start);

}  // namespace waymark
