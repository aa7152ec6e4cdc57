#pragma once

#include <array>
#include <functional>
#include <span>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "waymark/localization/riekf_localizer.hpp"

namespace waymark {

/// Selects the parameters to change by backward elimination (Draper and Smith, "Applied Regression Analysis",
/// section 15.2). The least significant change is set to zero first, and the other parameters move to their
/// resulting optimum. `change` is the step from the given values to the minimum of a cost, and becomes the
/// step to the selected values. `covariance` is that of the minimum. A parameter is changed if its change is
/// at least `enough_sigma` of its own standard deviations, given the parameters that remain unchanged.
/// Returns true for parameters that remain unchanged. O(n^3).
[[nodiscard]] std::vector<bool> keep_given(const Eigen::MatrixXd& covariance, double enough_sigma,
                                           Eigen::VectorXd& change);

/// Parameters of a robot that can be determined from a drive past mapped landmarks.
enum class Calibrated : std::uint8_t {
  MountingX,      ///< [m] of the sensor on the base; added to MountedSensor::base_T_sensor
  MountingY,      ///< [m]
  MountingYaw,    ///< [rad]
  OdometryScale,  ///< RiekfOptions::odometry_scale
  YawScale,       ///< RiekfOptions::yaw_scale, for the wheels
  GyroGain,       ///< RiekfOptions::gyro_gain
  CameraLatency,  ///< [s] RiekfOptions::camera_latency_s
  SightScale,     ///< RiekfOptions::sight_scale
  MountingZ,      ///< [m] for a camera with corners in the log; this also applies to the next three
  MountingRoll,   ///< [rad] about the x axis of the base
  MountingPitch,  ///< [rad] about the y axis of the base
  FocalScale,     ///< true focal length over that of the camera model
};
inline constexpr std::size_t kCalibrated = 12;
/// The key in calibration.yaml, such as "mounting_x_m", if there is one.
[[nodiscard]] std::string_view to_string(Calibrated what);

/// Values in the order of the Calibrated enumerators.
using CalibratedNumbers = std::array<double, kCalibrated>;

struct InnovationFit {
  CalibratedNumbers value{};  ///< fitted value, or the given value for parameters that were not fitted
  CalibratedNumbers sigma{};  ///< from the cost, kept values and stamps; 0 if not fitted
  std::array<bool, kCalibrated>
      known{};  ///< whether it is observable, that is, sigma is less than half that of the prior
  std::array<bool, kCalibrated>
      kept{};  ///< the drive does not distinguish the fitted value from the given one, which is kept
  double cost_before = 0;  ///< mean NIS per degree of freedom, with outliers capped
  double cost_after = 0;
  double held_out_before = 0;  ///< like cost_before, for the third of the drive that was not fitted
  double held_out_after = 0;
  bool changed = false;   ///< whether any value differs from the given one
  bool improved = false;  ///< changed, and the fit is better on both the fitted and the held-out part
  int runs = 0;           ///< number of runs of the filter
};

struct InnovationFitOptions {
  std::array<bool, kCalibrated> seek{true, true, true, true, true, true, true, true, true, true, true, true};
  /// For each parameter, the standard deviation of the difference between its true and its given value, for
  /// any robot.
  CalibratedNumbers prior{0.1, 0.1, 0.1, 0.05, 0.1, 0.05, 0.1, 0.03, 0.05, 0.05, 0.05, 0.03};
  int iterations = 3;
  /// A parameter whose change is less than this many standard deviations keeps its given value. If 0, no
  /// given value is kept, because all of them were guesses.
  double keep_sigma = 3;
  /// Called before each run of the filter; returning false ends the search with an error. If empty, the
  /// search always runs to completion.
  std::function<bool()> keep_going{};
};

/// Estimates the mounting, scales, gains, latency and focal length by minimising the innovations of the
/// filter. The cost is the likelihood of a run as a function of its parameters (Abbeel et al.,
/// "Discriminative Training of Kalman Filters", RSS 2005, section III, applied to the parameters of the
/// model). Uses Gauss-Newton steps with the sensitivities of the filter, and no ground truth. Every third
/// segment of the drive is held out to validate the result. The samples must be in stamp order. With a gyro,
/// the yaw scale of the wheels is not fitted; without one, the scale of the gyro is not fitted. Fails if the
/// samples contain fewer than 50 observations of the map. Takes about twenty runs of the filter over the
/// samples.
[[nodiscard]] Result<InnovationFit> calibrate_by_innovations(std::span<const Sample> samples,
                                                             const Landmarks& landmarks,
                                                             const MountedSensor& sensor,
                                                             const RiekfOptions& options,
                                                             const InnovationFitOptions& fit = {});

/// The sensor and the options with the parameters applied.
[[nodiscard]] MountedSensor calibrated_sensor(const MountedSensor& sensor, const CalibratedNumbers& numbers);
[[nodiscard]] RiekfOptions calibrated_options(const RiekfOptions& options, const CalibratedNumbers& numbers);

struct NoiseFit {
  RiekfOptions options{};   ///< options with the noise that fits best
  bool adapted = false;     ///< whether the noise differs from that given
  double motion_ratio = 1;  ///< noise of distances relative to the given noise
  double turn_ratio = 1;    ///< noise of headings relative to the given noise
  double sensor_ratio = 1;  ///< noise of observations relative to the given noise
  double tag_sigma_m = 0;   ///< RiekfOptions::tag_sigma_m
};

/// Whether a run shows that its noise model is inconsistent, judging by the NIS per row of observations or by
/// lasting_nis of the means for one landmark.
[[nodiscard]] bool noise_is_inconsistent(double nis_per_row, std::optional<double> lasting_nis);

/// Estimates the noise of motion and observations that maximises the likelihood of the innovations over a
/// drive (Mehra, "On the identification of variances and adaptive Kalman filtering", IEEE TAC 15(2), 1970).
/// The likelihood is composed of those of single innovations and of their means by landmark, which separate
/// noise from lasting errors. The search is over powers of two, covers the first 150 s, and uses no ground
/// truth. Takes about fifty runs of the filter over that time. `keep_going` is called before each run;
/// returning false ends the search.
[[nodiscard]] NoiseFit adapt_noise(std::span<const Sample> samples, const Landmarks& landmarks,
                                   const MountedSensor& sensor, const RiekfOptions& options,
                                   const std::function<bool()>& keep_going = {});

}  // namespace waymark
