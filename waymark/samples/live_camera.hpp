#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/samples/robot.hpp"

namespace waymark {

/// Image counts of a live camera since it was opened.
struct CameraCounts {
  std::uint64_t delivered = 0;
  std::uint64_t dropped = 0;  ///< replaced by a newer image before being read
  std::uint64_t lost = 0;     ///< gaps in the driver's sequence numbers
  std::uint64_t damaged = 0;  ///< skipped because incomplete or not decodable

  friend bool operator==(const CameraCounts&, const CameraCounts&) = default;
};

/// A setting of a camera.
struct CameraControl {
  std::string name{};  ///< "exposure_ms", "gain", "focus" or "white_balance_k", otherwise the driver's name
  double value = 0;    ///< in the unit given by the name
  double min = 0;
  double max = 0;
  double step = 1;
  double preset = 0;                 ///< the driver's default
  bool automatic = false;            ///< the camera adjusts it automatically
  bool writable = true;              ///< can be set now, or once the automatic mode is off
  std::vector<std::string> words{};  ///< names of the menu entries for the values from `min` on
};

/// A camera that delivers images over time. Stamps are on this computer's steady clock (CLOCK_MONOTONIC), at
/// the middle of the exposure if the camera reports its exposure time. The method next() returns the newest
/// image (CameraFrame) or a message to the operator (RobotText). Older images are dropped and counted.
class LiveCamera : public Source {
 public:
  [[nodiscard]] virtual CameraCounts counts() const = 0;
  /// Whether no more images will arrive because the end of a played file was reached.
  [[nodiscard]] virtual bool ended() const { return false; }
  /// "HD Webcam, 1280 x 720 px, MJPG, 30 Hz".
  [[nodiscard]] virtual std::string description() const = 0;
  /// Empty if the camera has no controls or is unplugged.
  [[nodiscard]] virtual std::vector<CameraControl> controls() { return {}; }
  /// Sets a value after switching off the control's automatic mode. Errors: InvalidArgument (unknown control
  /// or value out of range), Unwritable (rejected by the camera).
  virtual Status set_control(const std::string& name, double /*value*/) {
    return fail(ErrorCode::InvalidArgument, "this camera has no controls", {.key = name});
  }
};

}  // namespace waymark
