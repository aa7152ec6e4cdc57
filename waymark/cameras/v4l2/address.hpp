#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "waymark/base/error.hpp"
#include "waymark/base/time.hpp"
#include "waymark/cameras/v4l2/images.hpp"

namespace waymark {

/// Device and mode of a camera. The defaults are the device's current size, the highest rate up to 60 Hz, and
/// a format that needs no decoding if it reaches the same rate.
struct V4l2Options {
  std::string device = "/dev/video0";  ///< may also be a link in /dev/v4l/by-id
  std::string name = "cam";            ///< name of the camera in samples
  int width = 0;                       ///< [px]; 0 if not given
  int height = 0;                      ///< [px]
  double rate_hz = 0;                  ///< 0 if not given
  std::optional<PixelFormat> format{};
  std::map<std::string, double> controls{};  ///< set when the device is opened and after reconnection
  bool lock = false;                         ///< disables automatic exposure, gain, focus and white balance
  Duration reconnect_within = std::chrono::seconds(30);  ///< fails if the camera is unplugged for longer
};

/// Address scheme of these cameras.
inline constexpr std::string_view kV4l2Scheme = "v4l2:";

/// Parses "v4l2:/dev/video0,size=1280x720,rate=30,format=MJPG,exposure_ms=5,lock". Fails (InvalidArgument)
/// and names the option if one is invalid.
[[nodiscard]] Result<V4l2Options> parse_v4l2_address(const std::string& address);

}  // namespace waymark
