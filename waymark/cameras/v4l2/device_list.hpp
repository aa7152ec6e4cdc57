#pragma once

#include <string>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/cameras/v4l2/address.hpp"
#include "waymark/samples/live_camera.hpp"

namespace waymark {

/// A size in which a device delivers a format, and the rates there.
struct CameraMode {
  std::string format{};            ///< four characters: "YUYV"
  bool readable = true;            ///< of those that this program reads
  int width = 0;                   ///< [px]
  int height = 0;                  ///< [px]
  std::vector<double> rates_hz{};  ///< highest first; empty where the driver does not say
  bool largest = false;            ///< of any size between the least and this one, as bridges and vivid have
  int least_width = 0;             ///< [px]; of `largest`
  int least_height = 0;            ///< [px]
};

/// A device that delivers pictures, or one that cannot be asked.
struct CameraDevice {
  std::string path{};   ///< "/dev/video0"
  std::string by_id{};  ///< "/dev/v4l/by-id/usb-…-video-index0", stays when the cable changes; may be empty
  std::string card{};   ///< "HD Webcam"
  std::string driver{};
  std::string bus{};
  std::vector<CameraMode> modes{};
  std::vector<CameraControl> controls{};
  std::string holder{};            ///< the program that uses it, where one is known
  std::optional<Error> problem{};  ///< why it cannot be used; the other fields may be empty then
};

/// The devices /dev/video* of this computer that deliver pictures, by number. Those that only take pictures,
/// or deliver other data, are left out. Empty where there is none.
[[nodiscard]] std::vector<CameraDevice> list_cameras();

/// One device. Errors: as opening it; Unsupported where it delivers no pictures.
[[nodiscard]] Result<CameraDevice> describe_camera(const std::string& path);

/// The link below /dev/v4l/by-id of a node; empty where there is none.
[[nodiscard]] std::string by_id_of(const std::string& path);

}  // namespace waymark

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
