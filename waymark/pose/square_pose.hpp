#pragma once

#include <array>
#include <cstdint>

#include <Eigen/Core>

#include "waymark/geometry/se3.hpp"

namespace waymark {

/// Why four directions are not the corners of a square seen from its front.
enum class QuadDefect : std::uint8_t {
  None,
  RepeatedCorner,  ///< two corners in one place, or all so near that their order means nothing
  Collinear,       ///< three corners on one line
  Mirrored,        ///< TL, TR, BR, BL run against the clock: seen from behind, or listed the other way round
  NotConvex,  ///< no square looks like that from the front: corners out of order, or one inside the triangle
              ///< of the others
};

/// The words for it, e.g. "three of the corners lie on one line".
[[nodiscard]] const char* to_string(QuadDefect defect);

/// The two poses of the square that fit its image to first order about its centre.
struct SquarePoses {
  QuadDefect defect = QuadDefect::None;  ///< anything but None: there are no poses
  /// The one whose perspective (near side longer) agrees with the image comes first. Equal for a frontal
  /// square.
  std::array<SE3, 2> cam_T_tag{};
};

/// Corners of a square of this side in the tag frame [m], TL, TR, BR, BL: centre, x right, y down, z into the
/// tag.
[[nodiscard]] inline std::array<Eigen::Vector3d, 4> square_corners(double size_m) {
  const double h = size_m / 2;
  return {{{-h, -h, 0}, {h, -h, 0}, {h, h, 0}, {-h, h, 0}}};
}

/// Infinitesimal plane-based pose estimation in closed form, specialised to a square (Collins and Bartoli,
/// "Infinitesimal Plane-Based Pose Estimation", IJCV 109, 2014, sections 4 and 5). Here it works on
/// directions instead of a normalised image, so that tags at and beyond 90 degrees from the axis of a fisheye
/// are like any other. Exact without noise; with noise a starting point for refinement.
/// docs/concepts/pose.md, equations (4) to (11).
///
/// cam_bearings: directions to TL, TR, BR, BL in the camera frame, finite, not zero; unit length keeps the
/// tests for degeneracy meaningful. size_m: positive and finite.
[[nodiscard]] SquarePoses square_poses(const std::array<Eigen::Vector3d, 4>& cam_bearings, double size_m);

}  // namespace waymark
