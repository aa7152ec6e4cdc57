#pragma once

#include "waymark/app/localize/localize_log.hpp"
#include "waymark/mapping/lap/lap_calibration.hpp"

/// `waymark calibrate robot` by bundle adjustment of a lap.
namespace waymark {

/// Whether the recording holds what it takes, corners of tags and odometry, and the map of the job, if it
/// names one, is a map of ours.
[[nodiscard]] bool can_calibrate_by_lap(const LocalizeJob& job, const JobControl& control);

/// Reads the recording of the job (logs, robot, calibration, tag_size_m, and the map as far as it is known)
/// between two times after its first frame, and finds map and calibration together.
[[nodiscard]] Result<LapCalibration> calibrate_recorded_lap(const LocalizeJob& job, double from_s,
                                                            double to_s, const JobControl& control);

}  // namespace waymark
