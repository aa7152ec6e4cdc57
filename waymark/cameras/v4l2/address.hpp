#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "waymark/base/error.hpp"
#include "waymark/base/time.hpp"
#include "waymark/cameras/v4l2/pictures.hpp"

namespace waymark {

/// Which camera of this computer, and how it is to deliver. What is not given is chosen: the size that the
/// device has now, a format that needs no decoding where it reaches the same rate, the highest rate up to 60
/// Hz.
struct V4l2Options {
  std::string device = "/dev/video0";  ///< also a link below /dev/v4l/by-id
  std::string name = "cam";            ///< of the camera in samples
  int width = 0;                       ///< [px]; 0: not given
  int height = 0;                      ///< [px]
  double rate_hz = 0;                  ///< 0: not given
  std::optional<PixelFormat> format{};
  std::map<std::string, double> controls{};  ///< set when it is opened, and again when it is plugged in again
  bool lock = false;  ///< exposure, gain, focus and white balance keep their values: no automatic mode
  Duration reconnect_within = std::chrono::seconds(30);  ///< unplugged for longer is an error
};

/// The scheme of addresses of these cameras.
inline constexpr std::string_view kV4l2Scheme = "v4l2:";

/// "v4l2:/dev/video0,size=1280x720,rate=30,format=MJPG,exposure_ms=5,lock". InvalidArgument names the word.
[[nodiscard]] Result<V4l2Options> parse_v4l2_address(const std::string& address);

}  // namespace waymark
