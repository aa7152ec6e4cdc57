#pragma once

#include <span>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "waymark/base/error.hpp"

namespace waymark {

/// The homography b_H_a that maps points from one plane to another, b ~ b_H_a (a, 1). Uses the normalised
/// direct linear transformation (Hartley and Zisserman, "Multiple View Geometry in Computer Vision", 2nd
/// edition, algorithm 4.2). If a are the corners on a tag and b their normalised image, its columns are (r1,
/// r2, t) up to scale. Martins and Ramos, "AprilTag-based Trajectory Tracking for the LIMOS Robot", section
/// 2.2.1, start from this homography. See equations (1) to (3) in docs/concepts/pose.md.
///
/// Requires at least 4 pairs. If there are exactly 4, no three points may lie on a line. The result is exact
/// for 4 pairs; for more, it minimises the algebraic error in normalised coordinates, not the pixel error. It
/// is scaled to unit Frobenius norm, with the sign chosen so that the centroid of a is mapped to a point with
/// a positive third coordinate. Fails if there are too few points, their numbers differ, a coordinate is not
/// finite, or the points do not determine a homography. O(n).
[[nodiscard]] Result<Eigen::Matrix3d> homography_dlt(std::span<const Eigen::Vector2d> a_points,
                                                     std::span<const Eigen::Vector2d> b_points);

/// The image of a point: b_H_a (a, 1) divided by its third coordinate, which must not be 0.
[[nodiscard]] inline Eigen::Vector2d apply_homography(const Eigen::Matrix3d& b_H_a,
                                                      const Eigen::Vector2d& a_point) {
  return (b_H_a * a_point.homogeneous()).hnormalized();
}

}  // namespace waymark
