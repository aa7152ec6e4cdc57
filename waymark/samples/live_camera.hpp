#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "waymark/base/error.hpp"
#include "waymark/samples/robot.hpp"

namespace waymark {

/// What became of the pictures of a live camera since it was opened.
struct CameraCounts {
  std::uint64_t delivered = 0;
  std::uint64_t dropped = 0;  ///< replaced by a newer picture before they were taken
  std::uint64_t lost = 0;     ///< missing in the numbers of the driver
  std::uint64_t damaged = 0;  ///< left out: incomplete, or not decodable

  friend bool operator==(const CameraCounts&, const CameraCounts&) = default;
};

/// A setting of a camera.
struct CameraControl {
  std::string name{};  ///< "exposure_ms", "gain", "focus", "white_balance_k", else as the driver names it
  double value = 0;    ///< in the unit of the name
  double min = 0;
  double max = 0;
  double step = 1;
  double preset = 0;                 ///< the driver's default
  bool automatic = false;            ///< the camera changes it by itself
  bool writable = true;              ///< a value can be set now, or after the automatic mode is off
  std::vector<std::string> words{};  ///< of a menu: the word of each value from min on
};

/// A camera that delivers pictures as time passes. Its stamps are of the steady clock of this computer
/// (CLOCK_MONOTONIC), in the middle of the exposure where the exposure is known. next() gives the newest
/// picture (CameraFrame) or words for people (RobotText); older pictures are dropped and counted.
class LiveCamera : public Source {
 public:
  [[nodiscard]] virtual CameraCounts counts() const = 0;
  /// There will be no more pictures: a file that was played is at its end.
  [[nodiscard]] virtual bool ended() const { return false; }
  /// "HD Webcam, 1280 x 720 px, MJPG, 30 Hz".
  [[nodiscard]] virtual std::string description() const = 0;
  /// Empty where the camera has none, or while it is unplugged.
  [[nodiscard]] virtual std::vector<CameraControl> controls() { return {}; }
  /// Sets a value, with the automatic mode of this control switched off before. InvalidArgument: no such
  /// control, a value outside its range; Unwritable: the camera refuses.
  virtual Status set_control(const std::string& name, double /*value*/) {
    return fail(ErrorCode::InvalidArgument, "this camera has no controls", {.key = name});
  }
};

}  // namespace waymark
