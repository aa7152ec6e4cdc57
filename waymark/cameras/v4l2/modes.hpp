#pragma once

#include <string>
#include <vector>

#include "waymark/cameras/v4l2/address.hpp"
#include "waymark/cameras/v4l2/device_list.hpp"

struct v4l2_capability;

namespace waymark::internal {

/// The names of a device. Unsupported: it delivers no pictures, or only in several planes.
[[nodiscard]] Result<CameraDevice> read_capabilities(int device, const std::string& path);
/// Formats, sizes and rates in the order of the driver.
[[nodiscard]] std::vector<CameraMode> read_modes(int device);

/// "YUYV"; characters that are not printable as "?".
[[nodiscard]] std::string fourcc_name(std::uint32_t fourcc);
[[nodiscard]] std::uint32_t fourcc_of(PixelFormat format);

/// What a device is asked for.
struct WantedMode {
  PixelFormat format = PixelFormat::Grey;
  int width = 0;
  int height = 0;
  double rate_hz = 0;  ///< 0: the driver's own

  friend bool operator==(const WantedMode&, const WantedMode&) = default;
};

/// The best of the modes for the options: of the size that was given, else of the one nearest to `now` that
/// there is; of the formats the one that reaches the wanted rate (else the highest, up to 60 Hz) with the
/// least work. Unsupported: says what there is.
[[nodiscard]] Result<WantedMode> choose_mode(const std::vector<CameraMode>& modes, const V4l2Options& options,
                                             const WantedMode& now);

}  // namespace waymark::internal
