#pragma once

#include <optional>
#include <vector>

#include "waymark/factors/pose_factors.hpp"
#include "waymark/mapping/lap/lap_bundle.hpp"
#include "waymark/samples/robot_samples.hpp"
#include "waymark/samples/trajectory.hpp"

/// The noise of a lap by what is left over once everything is fitted: of the corners, of the wheels' steps,
/// of their turns.
namespace waymark {

namespace internal {

/// Of each corner term: how many of its 8 numbers the fit has not used up, 8 - trace(J P J^T), the part of
/// the unit on the diagonal of the hat matrix (Huber and Ronchetti, "Robust Statistics", section 7.2.1). A
/// tag seen alone or from near takes more of it than the others. 8 for terms that are not in use.
[[nodiscard]] std::vector<double> freedom_left(const LapBundle& lap);

/// Corner noise over what is claimed: from the median, which outliers hardly move. 1 where too little is left
/// to tell it by.
[[nodiscard]] double noise_ratio(const std::vector<double>& chi2, const std::vector<double>& freedom);

/// correlated_frames() of the observations of a lap.
[[nodiscard]] double frames_that_count_as_one(const LapBundle& lap);

/// All corners are so many times less certain than they say.
void scale_noise(Bundle& bundle, double ratio);

}  // namespace internal

/// How much noisier the odometry of a lap is than it was taken for: along, across, turning (1: as taken for).
using OdometryNoise = Eigen::Vector3d;

/// Finds the noise of the wheels from what they and the tags disagree in, and weighs them by it, adjusting
/// everything again: expectation maximisation of the variances (Dempster, Laird and Rubin, "Maximum
/// Likelihood from Incomplete Data via the EM Algorithm", J. Royal Statistical Society B 39(1), 1977).
/// Numbers that rest on many small turns, such as where the camera sits, are biased when the noise is taken
/// for larger than it is. Errors that outlast a picture (a robot that drifts sideways for a tenth of a
/// second) add up to more than the single steps show, and one that undoes itself (ticks of a counter) to
/// less: what half a second shows counts where it is more. The bundle stays where it ends.
OdometryNoise fit_odometry_noise(LapBundle& lap, int max_iterations, const BundleProgress& progress = {});

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
