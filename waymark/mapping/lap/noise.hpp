#pragma once

#include <optional>
#include <vector>

#include "waymark/factors/pose_factors.hpp"
#include "waymark/mapping/lap/lap_bundle.hpp"
#include "waymark/samples/robot_samples.hpp"
#include "waymark/samples/trajectory.hpp"

/// Estimation of the noise in a lap from residuals. Includes the noise of corners, of odometry steps and of
/// odometry turns.
namespace waymark {

namespace internal {

/// The redundancy of each corner term, 8 - trace(J P J^T). It is the part of the trace of I minus the hat
/// matrix that belongs to the term (Huber and Ronchetti, "Robust Statistics", section 7.2.1). It is smaller
/// for tags that are alone in view or close to the camera, and 8 for terms that are not in use.
[[nodiscard]] std::vector<double> redundancy_of(const LapBundle& lap);

/// The ratio of actual to stated corner noise, estimated from the median, which is robust against outliers. 1
/// if the redundancy is too small.
[[nodiscard]] double noise_ratio(const std::vector<double>& chi2, const std::vector<double>& redundancy);

/// The result of correlated_frames() for the observations in a lap.
[[nodiscard]] double correlated_frames_of(const LapBundle& lap);

/// Multiplies the standard deviation of all corners by `ratio`.
void scale_noise(Bundle& bundle, double ratio);

}  // namespace internal

/// Ratio of actual to assumed odometry noise: longitudinal, lateral and yaw (1 if as assumed).
using OdometryNoise = Eigen::Vector3d;

/// Estimates the odometry noise from its disagreement with the tags, weights odometry accordingly, and
/// adjusts everything again. This is expectation maximisation for the variances (Dempster, Laird and Rubin,
/// "Maximum Likelihood from Incomplete Data via the EM Algorithm", J. Royal Statistical Society B 39(1),
/// 1977). Parameters that depend on many small turns, such as the camera mounting, are biased if the assumed
/// noise is too large. Errors that persist beyond one image, as when a robot drifts sideways for a tenth of a
/// second, add up to more than single steps suggest. Errors that cancel, such as those due to encoder ticks,
/// add up to less. The noise over half a second is used if it is larger. The result is stored in the bundle.
OdometryNoise fit_odometry_noise(LapBundle& lap, int max_iterations, const BundleProgress& progress = {});

/// How much scaled odometry turns deviate from those of a trajectory.
struct TurnNoise {
  double rad_sqrt_m = 0;   ///< density of the heading's random walk per distance driven
  double scale_sigma = 0;  ///< resulting standard deviation of the scale
  int stretches = 0;       ///< number of stretches used
};

/// Estimates the turn noise from one-second stretches in motion whose headings at both ends are accurate to
/// half a degree. Empty if there are fewer than ten stretches. `covariance`: covariance of each pose of the
/// trajectory, as a left tangent in map.
[[nodiscard]] std::optional<TurnNoise> turn_noise(const Trajectory& trajectory,
                                                  const std::vector<Matrix6>& covariance,
                                                  const std::vector<Odometry>& odometry, double yaw_scale);

/// The scale with which odometry turns best fit the turns of a trajectory over the same stretches, if the
/// latter come from another source. It is the reciprocal of the slope of odometry turns as a function of
/// actual turns, because the errors are in odometry (see odometry_residual()). For its noise, call
/// turn_noise() with this scale.
[[nodiscard]] std::optional<double> turn_scale(const Trajectory& trajectory,
                                               const std::vector<Matrix6>& covariance,
                                               const std::vector<Odometry>& odometry);

/// The standard deviation of this scale, computed from the residuals of the stretches, if a constant rate
/// error is estimated together with it. If all turns are to one side and at the same rate, the two are
/// indistinguishable.
[[nodiscard]] std::optional<double> turn_scale_sigma(const Trajectory& trajectory,
                                                     const std::vector<Matrix6>& covariance,
                                                     const std::vector<Odometry>& odometry);

}  // namespace waymark
