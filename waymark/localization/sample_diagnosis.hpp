#pragma once

#include <span>
#include <vector>

#include "waymark/localization/landmarks.hpp"
#include "waymark/localization/observation.hpp"
#include "waymark/localization/sensor_diagnosis.hpp"
#include "waymark/samples/robot_samples.hpp"

namespace waymark {

/// The motion according to the samples of a drive past mapped landmarks: observed_motions(), and odometry and
/// gyro with the scales, the gain and the bias in the options. Without the gyro if RiekfOptions::rotation is
/// "odometry". The samples must be in stamp order.
[[nodiscard]] MotionSources motion_sources(std::span<const Sample> samples, const Landmarks& landmarks,
                                           const MountedSensor& sensor, const RiekfOptions& options);

/// The diagnosis with units and axes as its only corrections, for a caller that sets scales and times. The
/// other findings are only reported.
[[nodiscard]] SensorDiagnosis without_scales_and_times(SensorDiagnosis diagnosis);

/// Applies a correction to samples, which it keeps in stamp order, and to the options of a filter.
void apply(const SensorCorrection& correction, std::vector<Sample>& samples, RiekfOptions& options);

}  // namespace waymark
