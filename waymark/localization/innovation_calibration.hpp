#pragma once

#include <array>
#include <functional>
#include <span>
#include <string_view>

#include "waymark/localization/riekf_localizer.hpp"

namespace waymark {

/// What a drive past known landmarks tells of a robot, beside what it was told before.
enum class Calibrated : std::uint8_t {
  MountingX,      ///< [m] the eye on the base, added to MountedSensor::base_T_sensor
  MountingY,      ///< [m]
  MountingYaw,    ///< [rad]
  OdometryScale,  ///< RiekfOptions::odometry_scale
  YawGain,        ///< RiekfOptions::yaw_gain: of the wheels
  GyroGain,       ///< RiekfOptions::gyro_gain
  CameraLatency,  ///< [s] RiekfOptions::camera_latency_s
  SightScale,     ///< RiekfOptions::sight_scale
};
inline constexpr std::size_t kCalibrated = 8;
/// "mounting_x_m", … as in calibration.yaml, where it has them.
[[nodiscard]] std::string_view to_string(Calibrated what);

/// In the order of Calibrated.
using CalibratedNumbers = std::array<double, kCalibrated>;

struct InnovationFit {
  CalibratedNumbers value{};              ///< of what was sought; what it was before for the others
  CalibratedNumbers sigma{};              ///< from the curvature of the cost; 0 for what was not sought
  std::array<bool, kCalibrated> known{};  ///< the drive tells it: more than what is believed of any robot
  std::array<bool, kCalibrated> kept{};   ///< the drive does not tell it from what was given, which it stays
  double cost_before = 0;  ///< mean NIS over its degrees of freedom, what is not believed capped
  double cost_after = 0;
  bool improved = false;  ///< something better was found than what was given
  int runs = 0;           ///< of the filter
};

struct InnovationFitOptions {
  std::array<bool, kCalibrated> seek{true, true, true, true, true, true, true, true};
  /// How far from what is given each may be (standard deviation), for any robot.
  CalibratedNumbers prior{0.1, 0.05, 0.1, 0.05, 0.1, 0.05, 0.05, 0.03};
  int iterations = 3;
  /// What changes by less than so many of its standard deviations stays as it was given; 0: was only guessed.
  double keep_sigma = 3;
  /// Asked before each run of the filter; false ends the search with an error. Empty: never ends it.
  std::function<bool()> keep_going{};
};

/// Mounting, scales, gains and latency that make the innovations of the filter smallest: the likelihood of a
/// run as a function of what it was told (Abbeel et al., "Discriminative Training of Kalman Filters", RSS
/// 2005, section III, applied to parameters of the model), by Newton steps on differences. No truth is used.
/// Samples in stamp order. With a gyro the gain of the wheels' turning is not sought, without one the gyro's.
/// Fails when fewer than 50 sightings of the map are among them. Some hundred runs of the filter over the
/// samples.
[[nodiscard]] Result<InnovationFit> calibrate_by_innovations(std::span<const Sample> samples,
                                                             const Landmarks& landmarks,
                                                             const MountedSensor& eye,
                                                             const RiekfOptions& options,
                                                             const InnovationFitOptions& fit = {});

/// The eye and the options with numbers put in.
[[nodiscard]] MountedSensor calibrated_sensor(const MountedSensor& eye, const CalibratedNumbers& numbers);
[[nodiscard]] RiekfOptions calibrated_options(const RiekfOptions& options, const CalibratedNumbers& numbers);

}  // namespace waymark
