#pragma once

#include <string>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/cameras/v4l2/address.hpp"
#include "waymark/samples/live_camera.hpp"

namespace waymark {

/// A format and size that a device supports, with the available rates.
struct CameraMode {
  std::string format{};            ///< four characters: "YUYV"
  bool readable = true;            ///< supported by this program
  int width = 0;                   ///< [px]
  int height = 0;                  ///< [px]
  std::vector<double> rates_hz{};  ///< highest first; empty if the driver does not report them
  bool largest = false;  ///< any size from the minimum to this one is supported, as by bridges and vivid
  int min_width = 0;     ///< [px]; if `largest`
  int min_height = 0;    ///< [px]; if `largest`
};

/// A device that delivers images, or one that could not be queried.
struct CameraDevice {
  std::string path{};   ///< "/dev/video0"
  std::string by_id{};  ///< "/dev/v4l/by-id/usb-…-video-index0", independent of the port; may be empty
  std::string card{};   ///< "HD Webcam"
  std::string driver{};
  std::string bus{};
  std::vector<CameraMode> modes{};
  std::vector<CameraControl> controls{};
  std::string holder{};            ///< the program that is using it; empty if unknown
  std::optional<Error> problem{};  ///< why it cannot be used; the other fields may be empty then
};

/// This computer's /dev/video* devices that deliver images, ordered by number. Output devices and devices
/// that deliver other data are skipped.
[[nodiscard]] std::vector<CameraDevice> list_cameras();

/// Describes one device. Errors: those that occur when opening it, and Unsupported if it delivers no images.
[[nodiscard]] Result<CameraDevice> describe_camera(const std::string& path);

/// The link to a node in /dev/v4l/by-id; empty if no link exists.
[[nodiscard]] std::string by_id_of(const std::string& path);

}  // namespace waymark

struct v4l2_capability;

namespace waymark::internal {

/// The names of a device. Fails (Unsupported) if it delivers no images or only multi-planar ones.
[[nodiscard]] Result<CameraDevice> read_capabilities(int device, const std::string& path);
/// Formats, sizes and rates in the driver's order.
[[nodiscard]] std::vector<CameraMode> read_modes(int device);

/// The code as text ("YUYV"); unprintable characters become "?".
[[nodiscard]] std::string fourcc_name(std::uint32_t fourcc);
[[nodiscard]] std::uint32_t fourcc_of(PixelFormat format);

/// The mode to request from a device.
struct WantedMode {
  PixelFormat format = PixelFormat::Grey;
  int width = 0;
  int height = 0;
  double rate_hz = 0;  ///< 0 for the driver's default

  friend bool operator==(const WantedMode&, const WantedMode&) = default;
};

/// Chooses the best mode for the options. The size is the requested one or, if none is requested, the one
/// nearest to `now`. Then the rate nearest to the requested one is chosen (by default the highest up to 60
/// Hz), then the cheapest conversion. Errors: Unsupported, listing the available modes.
[[nodiscard]] Result<WantedMode> choose_mode(const std::vector<CameraMode>& modes, const V4l2Options& options,
                                             const WantedMode& now);

}  // namespace waymark::internal
