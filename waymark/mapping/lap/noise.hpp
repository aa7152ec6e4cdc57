#pragma once

#include <optional>
#include <vector>

#include "waymark/factors/pose_factors.hpp"
#include "waymark/mapping/lap/lap_bundle.hpp"
#include "waymark/samples/robot_samples.hpp"
#include "waymark/samples/trajectory.hpp"

/// Noise of a lap estimated from residuals: of the corners, of odometry steps, and of odometry turns.
namespace waymark {

namespace internal {

/// Redundancy of each corner term: 8 - trace(J P J^T), its share of I minus the hat matrix (Huber and
/// Ronchetti, "Robust Statistics", section 7.2.1). It is smaller for tags that are alone in view or close,
/// and 8 for terms that are not in use.
[[nodiscard]] std::vector<double> redundancy_of(const LapBundle& lap);

/// Ratio of actual to stated corner noise, from the median, which is robust against outliers. 1 if the
/// redundancy is too small.
[[nodiscard]] double noise_ratio(const std::vector<double>& chi2, const std::vector<double>& redundancy);

/// correlated_frames() of the observations of a lap.
[[nodiscard]] double correlated_frames_of(const LapBundle& lap);

/// Multiplies the standard deviation of all corners by `ratio`.
void scale_noise(Bundle& bundle, double ratio);

}  // namespace internal

/// Ratio of actual to assumed odometry noise: longitudinal, lateral, yaw (1: as assumed).
using OdometryNoise = Eigen::Vector3d;

/// Estimates the odometry noise from the disagreement with the tags, weights odometry by it and adjusts
/// everything again. This is expectation maximisation of the variances (Dempster, Laird and Rubin, "Maximum
/// Likelihood from Incomplete Data via the EM Algorithm", J. Royal Statistical Society B 39(1), 1977).
/// Parameters that depend on many small turns, such as the camera mounting, are biased if the assumed noise
/// is too large. Errors that persist beyond one image, as of a robot that drifts sideways for a tenth of a
/// second, add up to more than single steps suggest. Errors that cancel, such as those of counter ticks, add
/// up to less. The noise over half a second is used if it is larger. The bundle keeps the result.
OdometryNoise fit_odometry_noise(LapBundle& lap, int max_iterations, const BundleProgress& progress = {});

/// Deviation of scaled odometry turns from those of a trajectory.
struct TurnNoise {
  double rad_sqrt_m = 0;   ///< density of a random walk of the heading per distance driven
  double scale_sigma = 0;  ///< resulting standard deviation of the scale
  int stretches = 0;       ///< number of stretches used
};

/// Uses stretches of one second in motion whose headings are known to half a degree at both ends. Empty with
/// fewer than ten stretches. `covariance`: by pose of the trajectory, left tangent in map.
[[nodiscard]] std::optional<TurnNoise> turn_noise(const Trajectory& trajectory,
                                                  const std::vector<Matrix6>& covariance,
                                                  const std::vector<Odometry>& odometry, double yaw_scale);

/// The scale of odometry turns that best fits those of a trajectory over the same stretches, for a trajectory
/// whose turns come from another source. It is the reciprocal of the slope of odometry turns over actual
/// turns, because the errors are in odometry (see odometry_residual). turn_noise() at that scale gives its
/// noise.
[[nodiscard]] std::optional<double> turn_scale(const Trajectory& trajectory,
                                               const std::vector<Matrix6>& covariance,
                                               const std::vector<Odometry>& odometry);

/// Standard deviation of that scale from the residuals of the stretches, if a constant rate error is
/// estimated together with it. With turns to one side only, at one rate, the two are indistinguishable.
[[nodiscard]] std::optional<double> turn_scale_sigma(const Trajectory& trajectory,
                                                     const std::vector<Matrix6>& covariance,
                                                     const std::vector<Odometry>& odometry);

}  // namespace waymark
