#include "waymark/localization/sample_diagnosis.hpp"

#include <algorithm>
#include <variant>

#include "waymark/localization/observed_motions.hpp"

namespace waymark {

MotionSources motion_sources(std::span<const Sample> samples, const Landmarks& landmarks,
                             const MountedSensor& sensor, const RiekfOptions& options) {
  MotionSources sources{.observed = observed_motions(samples, landmarks, sensor, options)};
  for (const Sample& sample : samples) {
    if (const auto* odometry = std::get_if<Odometry>(&sample)) sources.odometry.push_back(*odometry);
    const auto* imu = std::get_if<ImuSample>(&sample);
    if (imu == nullptr || options.rotation == "odometry") continue;
    sources.imu.push_back(*imu);
    Eigen::Vector3d& rates = sources.imu.back().angular_velocity_rad_s;
    rates = options.gyro_gain * (rates - options.gyro_bias_rad_s * Eigen::Vector3d::UnitZ());
  }
  sources.odometry = with_scales(sources.odometry, options.odometry_scale, options.yaw_scale);
  return sources;
}

SensorDiagnosis without_scales_and_times(SensorDiagnosis diagnosis) {
  SensorCorrection& correction = diagnosis.correction;
  correction = {.base_R_gyro = correction.base_R_gyro,
                .gyro_unit = correction.gyro_unit,
                .distance_unit = correction.distance_unit,
                .gyro_usable = correction.gyro_usable};
  for (SensorFinding& finding : diagnosis.findings) {
    const SensorFault fault = finding.found.likely.front().fault;
    const bool kept = fault == SensorFault::GyroUnit || fault == SensorFault::GyroAxis ||
                      fault == SensorFault::OdometryDistanceUnit;
    if (!kept && finding.measure == SensorMeasure::Corrected) finding.measure = SensorMeasure::None;
  }
  return diagnosis;
}

void apply(const SensorCorrection& correction, std::vector<Sample>& samples, RiekfOptions& options) {
  options.odometry_scale *= correction.odometry_scale;
  options.yaw_scale *= correction.yaw_scale;
  options.camera_latency_s += correction.observations_late_s;
  if (!correction.gyro_usable && options.rotation == "auto") options.rotation = "odometry";
  if (!correction.changes_imu() && !correction.changes_odometry()) return;
  for (Sample& sample : samples) {
    if (auto* imu = std::get_if<ImuSample>(&sample)) *imu = correction.corrected(*imu);
    if (auto* odometry = std::get_if<Odometry>(&sample)) *odometry = correction.corrected(*odometry);
  }
  std::ranges::stable_sort(samples, {}, stamp_of);
}

}  // namespace waymark
