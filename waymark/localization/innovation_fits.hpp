#pragma once

#include <array>
#include <functional>
#include <span>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "waymark/localization/riekf_localizer.hpp"

namespace waymark {

/// Numbers that a drive does not tell from what was given stay what they were given, one after the other, the
/// least certain change first; the others move to their best beside it (backward elimination: Draper and
/// Smith, "Applied Regression Analysis", section 15.2). `change` is the step from what was given to the
/// minimum of a cost, and becomes the step to where the numbers should be; `covariance` is that of the
/// minimum. Moves what changes by `enough_sigma` of its own standard deviation, beside those that stay. True
/// for what stays. O(n^3).
[[nodiscard]] std::vector<bool> keep_given(const Eigen::MatrixXd& covariance, double enough_sigma,
                                           Eigen::VectorXd& change);

/// What a drive past known landmarks tells of a robot, beside what it was told before.
enum class Calibrated : std::uint8_t {
  MountingX,      ///< [m] the sensor on the base, added to MountedSensor::base_T_sensor
  MountingY,      ///< [m]
  MountingYaw,    ///< [rad]
  OdometryScale,  ///< RiekfOptions::odometry_scale
  YawGain,        ///< RiekfOptions::yaw_gain: of the wheels
  GyroGain,       ///< RiekfOptions::gyro_gain
  CameraLatency,  ///< [s] RiekfOptions::camera_latency_s
  SightScale,     ///< RiekfOptions::sight_scale
  MountingZ,      ///< [m] of a camera whose corners are in the log; so are the others
  MountingRoll,   ///< [rad] about the base's x
  MountingPitch,  ///< [rad] about the base's y
  FocalScale,     ///< true focal length over that of the camera model
};
inline constexpr std::size_t kCalibrated = 12;
/// "mounting_x_m", … as in calibration.yaml, where it has them.
[[nodiscard]] std::string_view to_string(Calibrated what);

/// In the order of Calibrated.
using CalibratedNumbers = std::array<double, kCalibrated>;

struct InnovationFit {
  CalibratedNumbers value{};              ///< of what was sought; what it was before for the others
  CalibratedNumbers sigma{};              ///< of the cost, of what stays as given, of stamps; 0: not sought
  std::array<bool, kCalibrated> known{};  ///< the drive tells it: more than what is assumed of any robot
  std::array<bool, kCalibrated> kept{};   ///< the drive does not tell it from what was given, which it stays
  double cost_before = 0;                 ///< mean NIS over its degrees of freedom, outliers capped
  double cost_after = 0;
  double held_out_before = 0;  ///< the same of the third of the drive that was not fitted
  double held_out_after = 0;
  bool changed = false;   ///< a number differs from what was given
  bool improved = false;  ///< and those fit better what was fitted, and what was held out
  int runs = 0;           ///< of the filter
};

struct InnovationFitOptions {
  std::array<bool, kCalibrated> seek{true, true, true, true, true, true, true, true, true, true, true, true};
  /// How far from what is given each may be (standard deviation), for any robot.
  CalibratedNumbers prior{0.1, 0.1, 0.1, 0.05, 0.1, 0.05, 0.1, 0.03, 0.05, 0.05, 0.05, 0.03};
  int iterations = 3;
  /// What changes by less than so many of its standard deviations stays as it was given; 0: was only guessed.
  double keep_sigma = 3;
  /// Asked before each run of the filter; false ends the search with an error. Empty: never ends it.
  std::function<bool()> keep_going{};
};

/// Mounting, scales, gains, latency and focal length that make the innovations of the filter smallest: the
/// likelihood of a run as a function of what it was told (Abbeel et al., "Discriminative Training of Kalman
/// Filters", RSS 2005, section III, applied to parameters of the model), by Gauss-Newton steps on the
/// filter's own sensitivities. No truth is used. Every third stretch of the drive is held out and judges the
/// result. Samples in stamp order. With a gyro the gain of the wheels' turning is not sought, without one the
/// gyro's. Fails when fewer than 50 observations of the map are among them. Some twenty runs of the filter
/// over the samples.
[[nodiscard]] Result<InnovationFit> calibrate_by_innovations(std::span<const Sample> samples,
                                                             const Landmarks& landmarks,
                                                             const MountedSensor& sensor,
                                                             const RiekfOptions& options,
                                                             const InnovationFitOptions& fit = {});

/// The sensor and the options with numbers put in.
[[nodiscard]] MountedSensor calibrated_sensor(const MountedSensor& sensor, const CalibratedNumbers& numbers);
[[nodiscard]] RiekfOptions calibrated_options(const RiekfOptions& options, const CalibratedNumbers& numbers);

struct NoiseFit {
  RiekfOptions options{};   ///< with the noise that fits best
  bool adapted = false;     ///< it differs from what was given
  double motion_ratio = 1;  ///< noise of distances over what was given
  double turn_ratio = 1;    ///< noise of headings over what was given
  double sensor_ratio = 1;  ///< noise of observations over what was given
  double tag_sigma_m = 0;   ///< RiekfOptions::tag_sigma_m
};

/// Whether a run shows that its noise is not what was assumed: NIS of observations, or of means of one
/// landmark.
[[nodiscard]] bool noise_is_inconsistent(double nis_per_row, std::optional<double> lasting_nis);

/// The noise of motion and observations under which the innovations of a drive are most likely (Mehra, "On
/// the identification of variances and adaptive Kalman filtering", IEEE TAC 15(2), 1970; a composite
/// likelihood of single innovations and of their means by landmark, which tell noise from lasting errors), by
/// a search over powers of two. Looks at the first minutes. No truth is used. Some fifty runs of the filter
/// over them; `keep_going` is asked before each and ends the search.
[[nodiscard]] NoiseFit adapt_noise(std::span<const Sample> samples, const Landmarks& landmarks,
                                   const MountedSensor& sensor, const RiekfOptions& options,
                                   const std::function<bool()>& keep_going = {});

}  // namespace waymark
