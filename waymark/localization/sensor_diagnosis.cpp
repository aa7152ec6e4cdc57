#include "waymark/localization/sensor_diagnosis.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include <fmt/format.h>
#include <Eigen/Geometry>

#include "waymark/base/angles.hpp"

namespace waymark {
namespace {

Duration duration_of(double seconds) {
  return std::chrono::duration_cast<Duration>(std::chrono::duration<double>(seconds));
}

bool is_time(SensorFault fault) {
  return fault == SensorFault::GyroTime || fault == SensorFault::OdometryTime ||
         fault == SensorFault::ObservationTime;
}

/// Whether the poses in the map are the same if the rival is the true explanation. They depend only on the
/// scale of the odometry relative to the map, and without a gyro only on the time between odometry and
/// images.
bool is_equivalent(const SensorExplanation& best, const SensorExplanation& rival) {
  const auto both = [&](SensorFault a, SensorFault b) {
    return (best.fault == a && rival.fault == b) || (best.fault == b && rival.fault == a);
  };
  return (best.fault == SensorFault::OdometryDistanceScale && rival.fault == SensorFault::ObservedScale) ||
         both(SensorFault::OdometryTime, SensorFault::ObservationTime);
}

/// Whether a correction for this explanation can be trusted.
bool is_safe(const SensorExplanations& found) {
  constexpr double kMaxTimeSigma_s = 0.02;
  constexpr double kMinTimeSigmas = 8;  // or it removes most of the offset
  const SensorExplanation& best = found.likely.front();
  if (!found.decided && !(found.rival && is_equivalent(best, *found.rival))) return false;
  switch (best.fault) {
    case SensorFault::GyroUnit:
    case SensorFault::GyroAxis:
    case SensorFault::GyroScale:
    case SensorFault::OdometryYawScale:
    case SensorFault::OdometryDistanceUnit:
    case SensorFault::OdometryDistanceScale:
      return true;
    case SensorFault::GyroTime:
    case SensorFault::OdometryTime:
    case SensorFault::ObservationTime:
      return best.sigma <= std::max(kMaxTimeSigma_s, std::abs(best.value) / kMinTimeSigmas);
    default:
      return false;
  }
}

/// Adds the correction for one more explanation.
void add(const SensorExplanation& explanation, SensorCorrection& correction) {
  switch (explanation.fault) {
    case SensorFault::GyroUnit:
    case SensorFault::GyroAxis: {
      // The nominal unit, because the remaining scale is that of any gyro.
      const double unit = explanation.value > 10    ? to_degrees(1.0)
                          : explanation.value < 0.1 ? to_radians(1.0)
                                                    : 1;
      correction.gyro_unit /= unit;
      correction.base_R_gyro =
          Eigen::Quaterniond::FromTwoVectors(explanation.gyro_up, Eigen::Vector3d::UnitZ())
              .toRotationMatrix() *
          correction.base_R_gyro;
      break;
    }
    case SensorFault::GyroScale:
      correction.gyro_scale *= explanation.value;
      break;
    case SensorFault::GyroTime:
      correction.gyro_late_s += explanation.value;
      break;
    case SensorFault::OdometryTime:
      correction.odometry_late_s += explanation.value;
      break;
    case SensorFault::ObservationTime:
      correction.observations_late_s += explanation.value;
      break;
    case SensorFault::OdometryYawScale:
      correction.yaw_scale *= explanation.value;
      break;
    case SensorFault::OdometryDistanceScale:
      correction.odometry_scale *= explanation.value;
      break;
    case SensorFault::OdometryDistanceUnit:
      correction.distance_unit /= explanation.value;
      break;
    default:
      break;
  }
}

MotionSources corrected_by(const SensorCorrection& correction, const MotionSources& sources) {
  MotionSources result{.imu = sources.imu, .observed = sources.observed};
  if (!correction.gyro_usable) result.imu.clear();
  for (ImuSample& sample : result.imu) sample = correction.corrected(sample);
  result.odometry = with_scales(sources.odometry, correction.odometry_scale, correction.yaw_scale);
  for (Odometry& sample : result.odometry) sample = correction.corrected(sample);
  const Duration late = duration_of(correction.observations_late_s);
  for (ObservedMotion& motion : result.observed) {
    motion.from -= late;
    motion.to -= late;
  }
  return result;
}

/// Whether the data leave it open that the gyro is the source with the fault.
bool suspects_gyro(const SensorExplanations& found) {
  if (source_of(found.likely.front().fault) == SensorKind::Gyro) return true;
  return !found.decided && found.rival && source_of(found.rival->fault) == SensorKind::Gyro;
}

SensorMeasure measure_for(const SensorExplanations& found, bool has_odometry, SensorCorrection& correction) {
  if (is_safe(found)) {
    add(found.likely.front(), correction);
    return SensorMeasure::Corrected;
  }
  const bool small = found.likely.front().fault == SensorFault::GyroTime;
  if (!suspects_gyro(found) || small || !has_odometry) return SensorMeasure::None;
  correction.gyro_usable = false;
  return SensorMeasure::GyroNotUsed;
}

}  // namespace

ImuSample SensorCorrection::corrected(const ImuSample& sample) const {
  ImuSample result = sample;
  result.stamp -= duration_of(gyro_late_s);
  result.angular_velocity_rad_s = gyro_unit * gyro_scale * (base_R_gyro * sample.angular_velocity_rad_s);
  result.linear_acceleration_m_s2 = base_R_gyro * sample.linear_acceleration_m_s2;
  return result;
}

Odometry SensorCorrection::corrected(const Odometry& sample) const {
  Odometry result = sample;
  result.stamp -= duration_of(odometry_late_s);
  if (distance_unit == 1) return result;
  const SE2& pose = sample.odom_T_base;
  result.odom_T_base = SE2(pose.rotation(), distance_unit * pose.translation());
  result.speed_m_s = distance_unit * sample.speed_m_s;
  return result;
}

bool SensorCorrection::changes_imu() const {
  return gyro_late_s != 0 || gyro_unit != 1 || gyro_scale != 1 || base_R_gyro != Eigen::Matrix3d::Identity();
}

std::vector<Odometry> with_scales(const std::vector<Odometry>& odometry, double distance_scale,
                                  double yaw_scale) {
  if (distance_scale == 1 && yaw_scale == 1) return odometry;
  std::vector<Odometry> result = odometry;
  const Odometry* before = nullptr;
  SE2 scaled;
  for (std::size_t i = 0; i < odometry.size(); ++i) {
    if (!odometry[i].odom_T_base.matrix().allFinite()) continue;
    if (before == nullptr) scaled = odometry[i].odom_T_base;
    if (before != nullptr) {
      SE2::Tangent twist = (before->odom_T_base.inverse() * odometry[i].odom_T_base).log();
      twist.head<2>() *= distance_scale;
      twist.z() *= yaw_scale;
      scaled = scaled * SE2::exp(twist);
    }
    result[i].odom_T_base = scaled;
    before = &odometry[i];
  }
  return result;
}

namespace {

/// Whether the best explanation is a time offset at the bound of the search, so that the true one is larger.
bool is_at_bound(const SensorExplanations& found, double max_offset_s) {
  constexpr double kBoundShare = 0.9;
  const SensorExplanation& best = found.likely.front();
  return is_time(best.fault) && std::abs(best.value) > kBoundShare * max_offset_s;
}

bool is_unrelated(SensorFault fault) {
  return fault == SensorFault::GyroUnrelated || fault == SensorFault::OdometryUnrelated ||
         fault == SensorFault::ObservedUnrelated;
}

/// Searches for large time offsets only if small ones explain nothing, because they require data before and
/// after each interval.
SensorExplanations explain(const MotionSources& sources, const SensorExplanationOptions& options) {
  SensorExplanations found = explain_sensors(sources, options);
  const bool at_bound = !found.likely.empty() && is_at_bound(found, options.max_offset_s);
  if (!found.likely.empty() && !at_bound && !is_unrelated(found.likely.front().fault)) return found;
  const SensorExplanationOptions wider{.max_offset_s = 5 * options.max_offset_s};
  SensorExplanations offset = explain_sensors(sources, wider);
  const bool explains = !offset.likely.empty() && is_time(offset.likely.front().fault) &&
                        !is_at_bound(offset, wider.max_offset_s);
  if (explains) return offset;
  if (at_bound) found.decided = false;
  return found;
}

}  // namespace

SensorDiagnosis diagnose_sensors(MotionSources sources, const SensorExplanationOptions& options) {
  constexpr int kMaxFindings = 3;
  SensorDiagnosis diagnosis;
  const bool has_odometry = !sources.odometry.empty();
  MotionSources current = std::move(sources);
  const MotionSources given = current;
  for (int i = 0; i < kMaxFindings; ++i) {
    SensorExplanations found = explain(current, options);
    if (found.likely.empty()) break;
    const SensorMeasure measure = measure_for(found, has_odometry, diagnosis.correction);
    diagnosis.findings.push_back({std::move(found), measure});
    if (measure == SensorMeasure::None) break;
    current = corrected_by(diagnosis.correction, given);
  }
  return diagnosis;
}

// Text.
namespace {

/// The axis of a gyro, such as "-y".
std::string axis_name(const Eigen::Vector3d& up) {
  Eigen::Index axis = 0;
  up.cwiseAbs().maxCoeff(&axis);
  return fmt::format("{}{}", up[axis] < 0 ? "-" : "+", "xyz"[axis]);
}

std::string unit_text(double value) {
  return value > 1 ? "degrees per second instead of radians per second" : "57.3 times too small";
}

/// What is wrong, with the number.
std::string fault_text(const SensorExplanation& e) {
  const std::string number = fmt::format("{:.3g} +- {:.2g}", e.value, e.sigma);
  switch (e.fault) {
    case SensorFault::GyroUnit:
      return fmt::format("the yaw rate of the gyro is {} times the rotation: {}", number, unit_text(e.value));
    case SensorFault::GyroAxis: {
      const bool unit = e.value > 10 || e.value < 0.1;
      return fmt::format(
          "the yaw rate is about {} of the gyro, not +z{}", axis_name(e.gyro_up),
          unit ? fmt::format(", and it is {} times the rotation: {}", number, unit_text(e.value)) : "");
    }
    case SensorFault::GyroScale:
      return fmt::format("the gyro has a scale of {} (true over measured rotation)", number);
    case SensorFault::GyroTime:
      return fmt::format("stamps of the gyro are late by {:.3f} +- {:.3f} s", e.value, e.sigma);
    case SensorFault::GyroUnrelated:
      return "the gyro does not measure the rotation of the base: no unit, axis, scale or time offset "
             "explains its rates";
    case SensorFault::OdometryYawSign:
      return "the odometry turns in the opposite direction";
    case SensorFault::OdometryYawScale:
      return fmt::format("the odometry has a yaw scale of {} (true over measured turn)", number);
    case SensorFault::OdometryDistanceUnit:
      return fmt::format("distances of the odometry are {:.0f} times too large: another unit than metres",
                         e.value);
    case SensorFault::OdometryReversed:
      return "the odometry moves in the opposite direction";
    case SensorFault::OdometryDistanceScale:
      return fmt::format("the odometry has a distance scale of {} (true over measured distance)", number);
    case SensorFault::OdometryTime:
      return fmt::format("stamps of the odometry are late by {:.3f} +- {:.3f} s", e.value, e.sigma);
    case SensorFault::OdometryUnrelated:
      return "the odometry does not measure the motion: no unit, sign, scale or time offset explains it";
    case SensorFault::ObservationTime:
      return fmt::format("stamps of the images are late by {:.3f} +- {:.3f} s", e.value, e.sigma);
    case SensorFault::ObservedDistanceUnit:
      return fmt::format(
          "distances observed with tags are {:.3g} times the true ones: map or tag sizes have "
          "another unit than metres",
          e.value);
    case SensorFault::ObservedScale:
      return fmt::format(
          "distances observed with tags have a scale of {} (true over observed): map, focal length or tag "
          "sizes",
          number);
    case SensorFault::MountingReversed:
      return "the camera mounting is turned by 180 deg";
    case SensorFault::ObservedUnrelated:
      return "the motion observed with tags does not fit that of the other sensors: is it the map of this "
             "place?";
  }
  return {};
}

std::string measure_text(SensorMeasure measure, SensorFault fault) {
  switch (measure) {
    case SensorMeasure::Corrected:
      return is_time(fault) ? "; corrected by this offset" : "; corrected";
    case SensorMeasure::GyroNotUsed:
      return "; the gyro is not used, and turns are those of the odometry";
    case SensorMeasure::None:
      break;
  }
  return {};
}

}  // namespace

std::string describe(const SensorFinding& finding) {
  if (finding.found.likely.empty()) return {};
  const SensorExplanation& best = finding.found.likely.front();
  std::string text = fault_text(best);
  if (finding.found.rival && !finding.found.decided)
    text += fmt::format(". Nearly as likely: {}", fault_text(*finding.found.rival));
  return text + measure_text(finding.measure, best.fault);
}

}  // namespace waymark
