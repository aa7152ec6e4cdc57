#pragma once

#include "waymark/cli/console.hpp"
#include "waymark/cli/localize_run.hpp"
#include "waymark/mapping/lap_calibration.hpp"

/// `waymark calibrate robot` without a map.
namespace waymark::cli {

/// Reads the recording of the job (logs, robot, calibration, tag_size_m) between two times after its first
/// frame, and finds map and calibration together.
[[nodiscard]] Result<LapCalibration> calibrate_recorded_lap(const LocalizeJob& job, double from_s,
                                                            double to_s, Console& console);

}  // namespace waymark::cli
