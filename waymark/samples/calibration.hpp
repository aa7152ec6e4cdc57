#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "waymark/camera/camera_model.hpp"

namespace waymark {

enum class CalibrationVerdict : std::uint8_t {
  Known,         ///< the value is worth using
  Unobservable,  ///< what was seen does not tell it: `advice` says what would
};

/// A number that was measured on this robot.
struct CalibratedValue {
  double value = 0;
  double sigma = 0;  ///< standard deviation, same unit
  CalibrationVerdict verdict = CalibrationVerdict::Known;
  std::string advice{};  ///< what to drive or to show; empty when nothing helps

  friend bool operator==(const CalibratedValue&, const CalibratedValue&) = default;
};

/// Everything that calibration knows of a robot (docs/formats/calibration.md). Whatever is not here was not
/// tried.
struct Calibration {
  std::optional<CameraModel> camera{};
  /// By name: "fx_px", "fy_px", "cx_px", "cy_px", "k1" … of the camera (their uncertainty; centres of pixels
  /// at +1/2); "mounting_x_m" … "mounting_yaw_rad" of the camera's body on the base (straight ahead when
  /// zero); "odometry_scale" (true distance = scale * that of the wheels), "yaw_gain" (true turn = gain *
  /// that of the wheels), "yaw_noise_rad_sqrt_m" (of that, over the way), "gyro_gain" (the same of the gyro),
  /// "gyro_bias_rad_s" (what it says at rest), "side_slip_s" (sideways speed per speed and yaw rate, outwards
  /// when negative), "camera_latency_s" (a picture is so much older than its stamp), "sight_scale" (true
  /// distance of a tag = scale * as it looks), "focal_scale" (by which the focal length of `camera` was
  /// multiplied; it is in it already), "corner_sigma_px"; "turn_lead_s", "odometry_yaw_bias_rad_s" of
  /// odometry; "readout_s" of a rolling shutter, from the first row to the last.
  std::map<std::string, CalibratedValue> values{};
  /// Where it comes from, in words, in the order of the file.
  std::vector<std::pair<std::string, std::string>> provenance{};

  /// The value of a name that is known; nothing where it was not tried or could not be told.
  [[nodiscard]] std::optional<double> known(const std::string& name) const {
    const auto found = values.find(name);
    return found != values.end() && found->second.verdict == CalibrationVerdict::Known
               ? std::optional(found->second.value)
               : std::nullopt;
  }
};

}  // namespace waymark
