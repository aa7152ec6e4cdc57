#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "waymark/base/time.hpp"
#include "waymark/samples/live_camera.hpp"

/// The controls of a Video4Linux device (linux/v4l2-controls.h), by name.
namespace waymark::internal {

/// Those that hold a number, a menu or a switch. The four that matter for measuring are exposure_ms, gain,
/// focus and white_balance_k; others are called as v4l2-ctl does ("power_line_frequency").
[[nodiscard]] std::vector<CameraControl> read_controls(int device);

/// Switches the automatic mode of this control off and sets it. InvalidArgument (no such control, outside its
/// range), Unwritable (the driver refuses). `source`: what errors call the camera.
[[nodiscard]] Status write_control(int device, const std::string& source, const std::string& name,
                                   double value);

/// Switches the automatic modes of exposure, gain, focus and white balance off; the values stay.
[[nodiscard]] Status lock_controls(int device, const std::string& source);

/// How long a picture is exposed; nothing where the driver does not say it in a unit of time.
[[nodiscard]] std::optional<Duration> exposure_of(int device);

}  // namespace waymark::internal
