#pragma once

#include <array>
#include <cstdint>

#include <Eigen/Core>

#include "waymark/geometry/se3.hpp"

namespace waymark {

/// Reason why four directions cannot be the corners of a square seen from the front.
enum class QuadDefect : std::uint8_t {
  None,
  RepeatedCorner,  ///< two corners coincide, or all are too close together to be ordered
  Collinear,       ///< three corners lie on a line
  Mirrored,   ///< TL, TR, BR, BL are counter-clockwise: the square is seen from behind or listed in reverse
  NotConvex,  ///< the corners are out of order, or one lies inside the triangle formed by the others
};

/// Description of a defect, e.g. "three corners are collinear".
[[nodiscard]] const char* to_string(QuadDefect defect);

/// The two poses of the square whose images agree with the observation to first order about the centre.
struct SquarePoses {
  QuadDefect defect = QuadDefect::None;  ///< the poses are set only if this is None
  /// In the first pose, the perspective (the near side appears longer) agrees with the image. The two are
  /// equal for a frontal square.
  std::array<SE3, 2> cam_T_tag{};
};

/// Corners of a square with this side in the tag frame [m], in the order TL, TR, BR, BL. The origin is at the
/// centre, with x right, y down and z into the tag.
[[nodiscard]] inline std::array<Eigen::Vector3d, 4> square_corners(double size_m) {
  const double h = size_m / 2;
  return {{{-h, -h, 0}, {h, -h, 0}, {h, h, 0}, {-h, h, 0}}};
}

/// Infinitesimal plane-based pose estimation in closed form, specialised for a square (Collins and Bartoli,
/// "Infinitesimal Plane-Based Pose Estimation", IJCV 109, 2014, sections 4 and 5). This version works with
/// directions instead of a normalised image, so tags seen by a fisheye at 90 degrees or more from its axis
/// need no special treatment. The result is exact without noise; with noise, it is an initial value for
/// refinement. See docs/concepts/pose.md, equations (4) to (11).
///
/// cam_bearings: directions to TL, TR, BR, BL in the camera frame. They must be finite and of unit length,
/// which the tests for degeneracy assume. size_m must be positive and finite.
[[nodiscard]] SquarePoses square_poses(const std::array<Eigen::Vector3d, 4>& cam_bearings, double size_m);

}  // namespace waymark
