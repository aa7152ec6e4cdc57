#pragma once

#include "waymark/app/calibrate_camera/calibrate_camera.hpp"
#include "waymark/app/cli/console.hpp"

/// Shared by the verbs that calibrate a camera.
namespace waymark::cli {

/// Creates the target. Fails also if an output file of `fit` cannot be written, so that no work is lost
/// later.
[[nodiscard]] Result<CalibrationTarget> usable_target(const TargetOptions& target, const CameraFitJob& fit);

/// Prints a calibration as one JSON object or as tables, and writes the files that the job requests.
[[nodiscard]] ExitCode print_and_write(const Result<CalibrateCameraReport>& report, const CameraFitJob& fit,
                                       bool json, Console& console);

}  // namespace waymark::cli
