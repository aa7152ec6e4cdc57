#pragma once

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "waymark/samples/observed_motion.hpp"
#include "waymark/samples/robot_samples.hpp"

/// Which single fault of a sensor explains why the sources of motion contradict each other. Pure.
namespace waymark {

/// Motion according to three independent sources. Any of them may be empty.
struct MotionSources {
  std::vector<Odometry> odometry{};
  std::vector<ImuSample> imu{};
  std::vector<ObservedMotion> observed{};  ///< from tags, about 1 s each, in order of their beginnings
};

enum class SensorKind : std::uint8_t { Gyro, Odometry, Observations };

/// A fault that affects all data of one source in the same way.
enum class SensorFault : std::uint8_t {
  GyroUnit,               ///< its rates have another unit; value: measured over true rotation
  GyroAxis,               ///< yaw is another axis or has the opposite sign; value: as for GyroUnit
  GyroScale,              ///< value: true over measured rotation
  GyroTime,               ///< value: stamp minus true time [s]
  GyroUnrelated,          ///< none of the faults above explains what the gyro measures
  OdometryYawSign,        ///< turns have the opposite sign
  OdometryYawScale,       ///< value: true over measured turn
  OdometryDistanceUnit,   ///< value: measured over true distance
  OdometryReversed,       ///< distances have the opposite sign
  OdometryDistanceScale,  ///< value: true over measured distance
  OdometryTime,           ///< value: stamp minus true time [s]
  OdometryUnrelated,      ///< none of the faults above explains what the odometry measures
  ObservationTime,        ///< value: stamp minus true time [s], as camera_latency_s
  ObservedDistanceUnit,   ///< map and tag sizes have another unit; value: measured over true distance
  ObservedScale,          ///< map, focal length or tag sizes; value: true over measured distance
  MountingReversed,       ///< the camera looks backwards
  ObservedUnrelated,      ///< none of the faults above explains what the tags show
};

/// The source that has the fault.
[[nodiscard]] SensorKind source_of(SensorFault fault);
/// A stable name, such as "gyro_unit".
[[nodiscard]] std::string_view to_string(SensorFault fault);

/// One fault that would explain the contradictions.
struct SensorExplanation {
  SensorFault fault = SensorFault::GyroUnit;
  double value = 1;     ///< as described for its fault; 1 for faults without a value
  double sigma = 0;     ///< standard deviation of the value
  double log_odds = 0;  ///< natural logarithm of its odds against sensors without a fault
  /// For faults of the gyro: the upward axis of the base, in the axes of the gyro.
  Eigen::Vector3d gyro_up = Eigen::Vector3d::UnitZ();
};

/// The faults that explain the contradictions, the most likely first; empty if the sources agree.
struct SensorExplanations {
  std::vector<SensorExplanation> likely{};
  /// The most likely fault of another source than that of the first one, if it explains anything at all.
  std::optional<SensorExplanation> rival{};
  /// Whether the first one is at least 20 times as likely as the rival. If not, the data do not determine
  /// which of the two sources is wrong.
  bool decided = false;
  std::size_t intervals = 0;  ///< number of intervals in which the sources were compared
};

struct SensorExplanationOptions {
  double max_offset_s = 0.6;  ///< largest time offset that is searched for
};

/// Compares the motions over intervals of about 2 s. Each fault is a hypothesis with a prior probability and
/// at most one free number; its evidence is the likelihood of all sources at the best number, by Laplace's
/// approximation (MacKay, "Bayesian Interpolation", Neural Computation 4(3), 1992). The true motion of each
/// interval is unknown, and so is the noise of each source, which may therefore be larger than usual without
/// being a fault. Residuals are Student-t distributed, so that slip and wrong tags have little effect. With
/// two sources, only the prior determines which one is wrong. Returns no explanation if there are fewer than
/// 8 intervals. O(intervals log samples), about 0.3 s for 300 intervals, which is the maximum.
[[nodiscard]] SensorExplanations explain_sensors(const MotionSources& sources,
                                                 const SensorExplanationOptions& options = {});

}  // namespace waymark
