#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "waymark/base/time.hpp"
#include "waymark/samples/live_camera.hpp"

/// The controls of a Video4Linux device (linux/v4l2-controls.h), by name.
namespace waymark::internal {

/// The controls with a number, a menu or a switch. The four that affect measurements are named exposure_ms,
/// gain, focus and white_balance_k. Others have their names from v4l2-ctl ("power_line_frequency").
[[nodiscard]] std::vector<CameraControl> read_controls(int device);

/// Disables the automatic mode of a control and sets its value. Errors: InvalidArgument (no such control,
/// outside its range), Unwritable (the driver rejects it). `source`: the camera's name in errors.
[[nodiscard]] Status write_control(int device, const std::string& source, const std::string& name,
                                   double value);

/// Disables the automatic modes of exposure, gain, focus and white balance; the values do not change.
[[nodiscard]] Status lock_controls(int device, const std::string& source);

/// The exposure time; empty if the driver does not report it in a unit of time.
[[nodiscard]] std::optional<Duration> exposure_of(int device);

}  // namespace waymark::internal
