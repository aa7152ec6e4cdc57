#pragma once

#include <string_view>

#include "waymark/app/common/report_fields.hpp"
#include "waymark/localization/sensor_diagnosis.hpp"

namespace waymark {

inline constexpr std::string_view kSensorsHelp =
    "Faults of sensors that explain contradictions between odometry, gyro and tags, one entry per fault";

/// A fault of a sensor, in the reports of localize, map and info.
[[nodiscard]] ReportFields fields(const SensorFinding& finding);
/// One explanation without its rival.
[[nodiscard]] ReportFields fields(const SensorExplanation& explanation);

}  // namespace waymark
