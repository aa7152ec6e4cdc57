#pragma once

#include "waymark/samples/robot_samples.hpp"

namespace waymark {

/// Whether nothing that is taught a route drives so far, or turns so much, in that time.
[[nodiscard]] bool faster_than_any_robot(double distance_m, double turn_rad, double dt_s);

/// Whether odometry went on from `before` to `now` by more than any robot can drive in that time, or returned
/// to the origin of its frame from afar: it was set back, as by a restart of the robot, or is of another
/// drive. False where `now` is not later.
[[nodiscard]] bool odometry_jumped(const Odometry& before, const Odometry& now);

}  // namespace waymark
