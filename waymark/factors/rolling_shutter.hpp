#pragma once

#include <array>
#include <optional>

#include "waymark/camera/camera_model.hpp"
#include "waymark/factors/pose_factors.hpp"

/// Cameras that expose one row after the other (rolling shutter).
namespace waymark {

using TagCorners = std::array<Eigen::Vector2d, 4>;

/// Exposure time of a row relative to the image stamp, which is the time of the middle row [s]. `readout_s`
/// is the time from the first row to the last; it is negative if rows are read from the bottom up.
[[nodiscard]] inline double row_time_s(double y_px, int height_px, double readout_s) {
  return (y_px / height_px - 0.5) * readout_s;
}

/// A tag moving relative to a camera: cam_T_tag(t) = exp(t twist + t^2 / 2 bend) cam_T_tag, where t = 0 at
/// the middle row.
struct MovingTag {
  SE3 cam_T_tag{};
  Vector6 twist = Vector6::Zero();  ///< rate of change of cam_T_tag as a left tangent [m/s, rad/s]
  double size_m = 0;
  Vector6 bend = Vector6::Zero();  ///< rate of change of `twist` [m/s^2, rad/s^2]
};

/// Displacement of each corner in the image (x, y of TL, TR, BR, BL [px]), and its derivative with respect to
/// the twist. The displacement is that from the middle row's time to the time of the row in which the corner
/// was measured. Empty if a corner is behind the camera or beyond the lens. After Hedborg, Forssen, Felsberg
/// and Ringaby, "Rolling Shutter Bundle Adjustment" (CVPR 2012), section 3, but with the first two
/// derivatives of the motion instead of interpolated poses.
[[nodiscard]] std::optional<Eigen::Matrix<double, 8, 1>> rolling_shift(
    const MovingTag& tag, const TagCorners& measured_px, const CameraModel& camera, double readout_s,
    Eigen::Matrix<double, 8, 6>* J_twist = nullptr);

}  // namespace waymark
