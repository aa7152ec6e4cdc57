#pragma once

#include "waymark/localization/sensor_diagnosis.hpp"
#include "waymark/pipeline/teacher.hpp"

namespace waymark {

struct TaughtLap;

/// Finds faults of the sensors of a taught lap from its odometry, gyro and tags, without a map
/// (diagnose_sensors()). Takes about 0.1 s if there is none.
[[nodiscard]] SensorDiagnosis diagnose_lap(const TaughtLap& taught, const TeachSetup& setup);

/// The same if the sizes of the tags are unknown. Distances observed with tags are then not used.
[[nodiscard]] SensorDiagnosis diagnose_turns(const TaughtLap& taught, TeachSetup setup);

/// Applies a correction to the odometry and the IMU data of a lap. An offset of the images becomes one of the
/// other stamps. Scales of the odometry are not applied, because a map contains them as unknowns.
void apply(const SensorCorrection& correction, TaughtLap& taught);

/// Whether apply() changes a lap.
[[nodiscard]] bool changes_lap(const SensorCorrection& correction);

}  // namespace waymark
