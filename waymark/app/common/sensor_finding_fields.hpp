#pragma once

#include <string_view>

#include "waymark/app/common/report_fields.hpp"
#include "waymark/localization/sensor_diagnosis.hpp"

namespace waymark {

inline constexpr std::string_view kSensorsHelp =
    "Faults of sensors that explain contradictions between odometry, gyro and tags, one entry per fault";

/// A fault of a sensor, in the reports of localize, map and info.
[[nodiscard]] ReportFields fields(const SensorFinding& finding);
/// Whether the finding is a scale of the odometry, which most robots have. Programs estimate it, and do not
/// report it as a problem.
[[nodiscard]] bool is_odometry_scale(const SensorFinding& finding);
/// One explanation without its rival.
[[nodiscard]] ReportFields fields(const SensorExplanation& explanation);

}  // namespace waymark
