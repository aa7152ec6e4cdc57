#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "waymark/localization/integral_track.hpp"
#include "waymark/samples/observed_motion.hpp"

/// Likelihood of the motions that odometry, gyro and tags measure, under a hypothesis about their faults.
namespace waymark::internal {

/// A time interval in which the sources are compared [s since an epoch].
struct ComparedInterval {
  double from_s = 0;
  double to_s = 0;
  std::optional<ObservedMotion> observed{};
};

/// The sources, and the intervals for which all of them have data.
struct ComparedMotions {
  IntegralTrack odometry{};
  IntegralTrack gyro{};
  std::vector<ComparedInterval> intervals{};
};

/// Numbers of the sensors, each of which is 0 if the sensor is as assumed.
enum class SensorNumber : std::uint8_t {
  GyroBias,       ///< [rad/s]
  MountingY,      ///< [m] error of the camera mounting along base y
  GyroScale,      ///< true over measured rotation, minus 1; also for the other scales
  YawScale,       ///< of the odometry
  DistanceScale,  ///< of the odometry
  ObservedScale,  ///< of distances that tags show
  GyroTime,       ///< stamp minus true time [s]; also for the other times
  OdometryTime,
  ObservationTime,
};
inline constexpr int kSensorNumbers = 9;
using SensorNumbers = Eigen::Matrix<double, kSensorNumbers, 1>;
using SensorNumbersMatrix = Eigen::Matrix<double, kSensorNumbers, kSensorNumbers>;

/// How sensors measure motion: a prior on their numbers, and factors that turn measured into true values.
struct SensorModel {
  SensorNumbers sigma = SensorNumbers::Zero();         ///< standard deviations of the prior, which has mean 0
  Eigen::Vector3d gyro_up = Eigen::Vector3d::UnitZ();  ///< an axis of the gyro, positive or negative
  double gyro_factor = 1;
  double yaw_factor = 1;
  double distance_factor = 1;
  double observed_factor = 1;
  /// Sources that do not measure the motion at all. The data of such a source have their own spread.
  bool gyro_unrelated = false;
  bool odometry_unrelated = false;
  bool observed_unrelated = false;
};

/// The best numbers of a model.
struct SensorModelFit {
  SensorNumbers value = SensorNumbers::Zero();
  SensorNumbersMatrix covariance = SensorNumbersMatrix::Zero();
  double log_evidence = 0;
  /// Ratio of the fitted to the usual standard deviation of a source; the largest one.
  double noise_ratio = 1;
};

/// Maximises the likelihood of all sources over the numbers and over the noise of each source, starting at
/// `start`. Alternates Gauss-Newton steps for the numbers with an expectation-maximisation step for the noise
/// (Liu and Rubin, "The ECME algorithm", Biometrika 81(4), 1994). The true turns and distances of the
/// intervals are eliminated. Time offsets are kept within `max_offset_s`.
[[nodiscard]] SensorModelFit fit_sensor_model(const ComparedMotions& motions, const SensorModel& model,
                                              const SensorNumbers& start, double max_offset_s, int rounds);

}  // namespace waymark::internal
