#pragma once

#include <array>
#include <cstdint>

#include <Eigen/Core>

#include "waymark/geometry/se3.hpp"

namespace waymark {

/// Reason why four directions are not the corners of a square seen from its front.
enum class QuadDefect : std::uint8_t {
  None,
  RepeatedCorner,  ///< two corners coincide, or all are too close together to have an order
  Collinear,       ///< three corners on one line
  Mirrored,        ///< TL, TR, BR, BL are counter-clockwise: seen from behind, or listed in reverse
  NotConvex,       ///< corners out of order, or one inside the triangle of the others
};

/// Text of a defect, e.g. "three corners are collinear".
[[nodiscard]] const char* to_string(QuadDefect defect);

/// The two poses of the square whose images agree with the observation to first order about the centre.
struct SquarePoses {
  QuadDefect defect = QuadDefect::None;  ///< poses are set only for None
  /// The first is the one whose perspective (near side longer) agrees with the image. Equal for a frontal
  /// square.
  std::array<SE3, 2> cam_T_tag{};
};

/// Corners of a square of this side in the tag frame [m], TL, TR, BR, BL: origin at the centre, x right, y
/// down, z into the tag.
[[nodiscard]] inline std::array<Eigen::Vector3d, 4> square_corners(double size_m) {
  const double h = size_m / 2;
  return {{{-h, -h, 0}, {h, -h, 0}, {h, h, 0}, {-h, h, 0}}};
}

/// Infinitesimal plane-based pose estimation in closed form, specialised to a square (Collins and Bartoli,
/// "Infinitesimal Plane-Based Pose Estimation", IJCV 109, 2014, sections 4 and 5). This version works on
/// directions instead of a normalised image, so tags at and beyond 90 degrees from the axis of a fisheye need
/// no special case. Exact without noise; with noise, an initial value for refinement. docs/concepts/pose.md,
/// equations (4) to (11).
///
/// cam_bearings: finite directions of unit length to TL, TR, BR, BL in the camera frame; the tests for
/// degeneracy assume unit length. size_m: positive and finite.
[[nodiscard]] SquarePoses square_poses(const std::array<Eigen::Vector3d, 4>& cam_bearings, double size_m);

}  // namespace waymark
