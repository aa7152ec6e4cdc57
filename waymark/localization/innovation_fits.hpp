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
/// section 15.2). The least significant change is set to zero first, and the others move to their optimum
/// given it. `change` is the step from the given values to the minimum of a cost, and becomes the step to the
/// selected values. `covariance` is that of the minimum. A parameter is changed if its change is at least
/// `enough_sigma` of its own standard deviations, given the ones that stay. Returns true for parameters that
/// stay. O(n^3).
[[nodiscard]] std::vector<bool> keep_given(const Eigen::MatrixXd& covariance, double enough_sigma,
                                           Eigen::VectorXd& change);

/// Parameters of a robot that a drive past mapped landmarks may determine.
enum class Calibrated : std::uint8_t {
  MountingX,      ///< [m] of the sensor on the base, added to MountedSensor::base_T_sensor
  MountingY,      ///< [m]
  MountingYaw,    ///< [rad]
  OdometryScale,  ///< RiekfOptions::odometry_scale
  YawScale,       ///< RiekfOptions::yaw_scale: of the wheels
  GyroGain,       ///< RiekfOptions::gyro_gain
  CameraLatency,  ///< [s] RiekfOptions::camera_latency_s
  SightScale,     ///< RiekfOptions::sight_scale
  MountingZ,      ///< [m] of a camera with corners in the log, as are the next three
  MountingRoll,   ///< [rad] about the base's x
  MountingPitch,  ///< [rad] about the base's y
  FocalScale,     ///< true focal length over that of the camera model
};
inline constexpr std::size_t kCalibrated = 12;
/// "mounting_x_m", …: the key in calibration.yaml, if there is one.
[[nodiscard]] std::string_view to_string(Calibrated what);

/// Values in the order of Calibrated.
using CalibratedNumbers = std::array<double, kCalibrated>;

struct InnovationFit {
  CalibratedNumbers value{};              ///< fitted; the given value for parameters that were not fitted
  CalibratedNumbers sigma{};              ///< from cost, kept values and stamps; 0: not fitted
  std::array<bool, kCalibrated> known{};  ///< observable: the sigma is less than half of the prior
  std::array<bool, kCalibrated>
      kept{};              ///< the drive does not distinguish it from the given value, which is kept
  double cost_before = 0;  ///< mean NIS per degree of freedom, outliers capped
  double cost_after = 0;
  double held_out_before = 0;  ///< as cost_before, for the third of the drive that was not fitted
  double held_out_after = 0;
  bool changed = false;   ///< a value differs from the given one
  bool improved = false;  ///< changed, and both the fitted and the held-out part fit better
  int runs = 0;           ///< of the filter
};

struct InnovationFitOptions {
  std::array<bool, kCalibrated> seek{true, true, true, true, true, true, true, true, true, true, true, true};
  /// Standard deviation of the difference between each parameter of any robot and its given value.
  CalibratedNumbers prior{0.1, 0.1, 0.1, 0.05, 0.1, 0.05, 0.1, 0.03, 0.05, 0.05, 0.05, 0.03};
  int iterations = 3;
  /// A parameter whose change is less than this many standard deviations keeps its given value; 0: no given
  /// value is kept, because all were guessed.
  double keep_sigma = 3;
  /// Called before each run of the filter; false ends the search with an error. Empty: the search always runs
  /// to its end.
  std::function<bool()> keep_going{};
};

/// Estimates mounting, scales, gains, latency and focal length by minimising the innovations of the filter.
/// The cost is the likelihood of a run as a function of its parameters (Abbeel et al., "Discriminative
/// Training of Kalman Filters", RSS 2005, section III, applied to parameters of the model). Uses Gauss-Newton
/// steps with the sensitivities of the filter, and no ground truth. Every third segment of the drive is held
/// out to validate the result. Samples are in stamp order. With a gyro the yaw scale of the wheels is not
/// fitted; without one the scale of the gyro is not fitted. Fails if the samples contain fewer than 50
/// observations of the map. Costs about twenty runs of the filter over the samples.
[[nodiscard]] Result<InnovationFit> calibrate_by_innovations(std::span<const Sample> samples,
                                                             const Landmarks& landmarks,
                                                             const MountedSensor& sensor,
                                                             const RiekfOptions& options,
                                                             const InnovationFitOptions& fit = {});

/// The sensor with the parameters applied, and the options with the parameters applied.
[[nodiscard]] MountedSensor calibrated_sensor(const MountedSensor& sensor, const CalibratedNumbers& numbers);
[[nodiscard]] RiekfOptions calibrated_options(const RiekfOptions& options, const CalibratedNumbers& numbers);

struct NoiseFit {
  RiekfOptions options{};   ///< with the noise that fits best
  bool adapted = false;     ///< the noise differs from the given one
  double motion_ratio = 1;  ///< noise of distances over the given noise
  double turn_ratio = 1;    ///< noise of headings over the given noise
  double sensor_ratio = 1;  ///< noise of observations over the given noise
  double tag_sigma_m = 0;   ///< RiekfOptions::tag_sigma_m
};

/// Whether a run shows that its noise model is inconsistent, by the NIS per row of observations or by
/// lasting_nis of the means of one landmark.
[[nodiscard]] bool noise_is_inconsistent(double nis_per_row, std::optional<double> lasting_nis);

/// Estimates the noise of motion and observations that maximises the likelihood of the innovations of a drive
/// (Mehra, "On the identification of variances and adaptive Kalman filtering", IEEE TAC 15(2), 1970). The
/// likelihood is a composite of single innovations and of their means by landmark, which separate noise from
/// lasting errors. The search is over powers of two and uses the first 150 s. No ground truth is used. Costs
/// about fifty runs of the filter over that time; `keep_going` is called before each, and false ends the
/// search.
[[nodiscard]] NoiseFit adapt_noise(std::span<const Sample> samples, const Landmarks& landmarks,
                                   const MountedSensor& sensor, const RiekfOptions& options,
                                   const std::function<bool()>& keep_going = {});

}  // namespace waymark
