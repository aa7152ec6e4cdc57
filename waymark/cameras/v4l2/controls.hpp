#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "waymark/base/time.hpp"
#include "waymark/samples/live_camera.hpp"

/// The controls of a Video4Linux device (linux/v4l2-controls.h), by name.
namespace waymark::internal {

/// The numeric, menu and switch controls. The four that affect measurements are named exposure_ms, gain,
/// focus and white_balance_k. The others have the names used by v4l2-ctl ("power_line_frequency").
[[nodiscard]] std::vector<CameraControl> read_controls(int device);

/// Disables the automatic mode of a control and sets its value. Errors: InvalidArgument (no such control,
/// value out of range), Unwritable (rejected by the driver). `source` is the camera's name in errors.
[[nodiscard]] Status write_control(int device, const std::string& source, const std::string& name,
                                   double value);

/// Disables the automatic modes of exposure, gain, focus and white balance; their values do not change.
[[nodiscard]] Status lock_controls(int device, const std::string& source);

/// The exposure time; empty if the driver does not report it in a unit of time.
[[nodiscard]] std::optional<Duration> exposure_of(int device);

}  // namespace waymark::internal
