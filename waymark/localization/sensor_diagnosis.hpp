#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "waymark/localization/sensor_explanation.hpp"

namespace waymark {

/// Corrections to the samples of a robot.
struct SensorCorrection {
  Eigen::Matrix3d base_R_gyro = Eigen::Matrix3d::Identity();
  double gyro_unit = 1;   ///< unit of its rates [rad/s]
  double gyro_scale = 1;  ///< true over measured rotation, in radians
  /// Stamps minus true times [s].
  double gyro_late_s = 0;
  double odometry_late_s = 0;
  double observations_late_s = 0;
  double distance_unit = 1;   ///< unit of the odometry's distances [m]
  double yaw_scale = 1;       ///< true over measured turn of the odometry
  double odometry_scale = 1;  ///< true over measured distance of the odometry, in metres
  /// Whether the gyro may be used. If not, rotations should be taken from the odometry.
  bool gyro_usable = true;

  /// The sample with its true stamp, in base axes and in rad/s.
  [[nodiscard]] ImuSample corrected(const ImuSample& sample) const;
  /// The sample with its true stamp, in metres. Its scales are not applied, because a filter has its own
  /// numbers for them.
  [[nodiscard]] Odometry corrected(const Odometry& sample) const;
  /// Whether corrected() changes samples.
  [[nodiscard]] bool changes_imu() const;
  [[nodiscard]] bool changes_odometry() const { return odometry_late_s != 0 || distance_unit != 1; }
};

/// Odometry whose distances and turns are multiplied by these factors.
[[nodiscard]] std::vector<Odometry> with_scales(const std::vector<Odometry>& odometry, double distance_scale,
                                                double yaw_scale);

/// What a finding led to.
enum class SensorMeasure : std::uint8_t {
  None,         ///< it is only reported
  Corrected,    ///< the correction contains it
  GyroNotUsed,  ///< rotations should be taken from the odometry
};

struct SensorFinding {
  SensorExplanations found{};
  SensorMeasure measure = SensorMeasure::None;
};

/// Findings, one after the other: each is searched for in samples that are corrected by those before.
struct SensorDiagnosis {
  std::vector<SensorFinding> findings{};
  SensorCorrection correction{};
};

/// Explains contradictions between the sources, and derives the corrections that are safe. Those are units,
/// axes, signs and scales of the gyro, and units and scales of the odometry. A time offset is corrected if
/// its standard deviation is at most 0.02 s or an eighth of the offset. The explanation must be decided,
/// unless its rival results in the same poses. If the gyro is the suspect, but its fault is not decided or
/// cannot be corrected, it is not usable. Finds at most three faults. Time offsets are searched for up to 5
/// times SensorExplanationOptions::max_offset_s.
[[nodiscard]] SensorDiagnosis diagnose_sensors(MotionSources sources,
                                               const SensorExplanationOptions& options = {});

/// A sentence with the source, the number, the rival, and the measure.
[[nodiscard]] std::string describe(const SensorFinding& finding);

}  // namespace waymark
