#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "waymark/camera/camera_model.hpp"

namespace waymark {

enum class CalibrationVerdict : std::uint8_t {
  Known,         ///< the value is observable and can be used
  Unobservable,  ///< the data do not determine the value; `advice` suggests a drive that would
};

/// A parameter measured on this robot.
struct CalibratedValue {
  double value = 0;
  double sigma = 0;  ///< standard deviation, in the same unit
  CalibrationVerdict verdict = CalibrationVerdict::Known;
  std::string advice{};  ///< drive or view that would make it observable; empty if there is none

  friend bool operator==(const CalibratedValue&, const CalibratedValue&) = default;
};

/// All calibrated values of a robot (docs/formats/calibration.md). A missing value was not estimated.
struct Calibration {
  std::optional<CameraModel> camera{};
  /// Values by name:
  ///
  /// - Camera: "fx_px", "fy_px", "cx_px", "cy_px", "k1" …, with uncertainty and pixel centres at +1/2.
  /// - Mounting: "mounting_x_m" … "mounting_yaw_rad", the pose of the camera body on the base. The camera
  ///   points straight ahead if it is zero.
  /// - Odometry: "odometry_scale": true distance = scale * distance from the wheels; "yaw_scale": true turn =
  ///   gain * turn from the wheels; "yaw_noise_rad_sqrt_m": noise in that turn, over the distance.
  /// - IMU: "gyro_gain": true turn = gain * turn from the gyro; "gyro_bias_rad_s": gyro rate at rest.
  /// - Motion: "side_slip_s": lateral speed per speed and yaw rate, negative if outwards; "turn_lead_s" and
  ///   "odometry_yaw_bias_rad_s" of the odometry.
  /// - Images: "camera_latency_s": an image is this much older than its stamp; "readout_s": time from the
  ///   first row to the last with a rolling shutter; "corner_sigma_px".
  /// - Scales: "sight_scale": true distance of a tag = scale * measured distance; "focal_scale": factor by
  ///   which the focal length of `camera` was multiplied (already applied).
  std::map<std::string, CalibratedValue> values{};
  /// Correlations of the parameters of `camera`, in the order of intrinsics_of(), with ones on the diagonal;
  /// empty if unknown. Their standard deviations are in `values`.
  Eigen::MatrixXd camera_correlations{};
  /// Origin of the values, as keys and text in file order.
  std::vector<std::pair<std::string, std::string>> provenance{};

  /// The value with this name; empty if it was not estimated or is not observable.
  [[nodiscard]] std::optional<double> observable_value(const std::string& name) const {
    const auto found = values.find(name);
    return found != values.end() && found->second.verdict == CalibrationVerdict::Known
               ? std::optional(found->second.value)
               : std::nullopt;
  }
};

}  // namespace waymark
