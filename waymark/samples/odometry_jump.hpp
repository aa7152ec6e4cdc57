#pragma once

#include "waymark/samples/robot_samples.hpp"

namespace waymark {

/// Whether the motion is faster than any robot that repeats routes can move.
[[nodiscard]] bool faster_than_any_robot(double distance_m, double turn_rad, double dt_s);

/// Whether the odometry was reset between `before` and `now`, as by a restart of the robot, or is from
/// another drive. In both cases it moved farther than any robot can drive in that time, or returned to the
/// origin of its frame from afar. False if `now` is not later.
[[nodiscard]] bool odometry_jumped(const Odometry& before, const Odometry& now);

}  // namespace waymark
