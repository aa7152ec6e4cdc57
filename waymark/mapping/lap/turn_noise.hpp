#pragma once

#include <optional>
#include <vector>

#include "waymark/factors/pose_factors.hpp"
#include "waymark/samples/robot_samples.hpp"
#include "waymark/samples/trajectory.hpp"

namespace waymark {

/// How far turns by odometry, times a scale, are from those of a trajectory.
struct TurnNoise {
  double rad_sqrt_m = 0;   ///< density of a random walk of the heading over the way
  double scale_sigma = 0;  ///< standard deviation that it gives the scale
  int stretches = 0;       ///< that it was taken from
};

/// Over stretches of a second in motion, each end of which is known to half a degree. Nothing from fewer than
/// ten. `covariance`: of each pose of the trajectory, left tangent in map.
[[nodiscard]] std::optional<TurnNoise> turn_noise(const Trajectory& trajectory,
                                                  const std::vector<Matrix6>& covariance,
                                                  const std::vector<Odometry>& odometry, double yaw_scale);

/// The scale of the turns by odometry that fits those of a trajectory best over the same stretches, for a
/// trajectory whose turns come from something else: the reciprocal of the slope of what odometry told over
/// how the robot turned, as odometry is what errs (see odometry_residual). The noise of `turn_noise` at that
/// scale says how well.
[[nodiscard]] std::optional<double> turn_scale(const Trajectory& trajectory,
                                               const std::vector<Matrix6>& covariance,
                                               const std::vector<Odometry>& odometry);

/// The standard deviation of that scale where a constant error of the rate is found beside it, by what is
/// left over in the stretches: on a course that bends to one side only, at one rate, the two are the same
/// thing.
[[nodiscard]] std::optional<double> turn_scale_sigma(const Trajectory& trajectory,
                                                     const std::vector<Matrix6>& covariance,
                                                     const std::vector<Odometry>& odometry);

}  // namespace waymark
