#pragma once

#include <span>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "waymark/base/error.hpp"

namespace waymark {

/// The homography b_H_a that maps points of one plane to another, b ~ b_H_a (a, 1). Uses the normalised
/// direct linear transformation (Hartley and Zisserman, "Multiple View Geometry in Computer Vision", 2nd
/// edition, algorithm 4.2). With a the corners on a tag and b their normalised image, its columns are (r1,
/// r2, t) up to scale. Martins and Ramos, "AprilTag-based Trajectory Tracking for the LIMOS Robot", section
/// 2.2.1, start from it. Equations (1) to (3) of docs/concepts/pose.md.
///
/// Requires at least 4 pairs, no three of four points on one line. Exact for 4 pairs; for more, the solution
/// minimises the algebraic error in normalised coordinates, not the pixel error. Scaled to unit Frobenius
/// norm; the sign makes the third coordinate of the image of a's centroid positive. Fails on too few or
/// unequally many points, non-finite coordinates, and points that do not determine a homography. O(n).
[[nodiscard]] Result<Eigen::Matrix3d> homography_dlt(std::span<const Eigen::Vector2d> a_points,
                                                     std::span<const Eigen::Vector2d> b_points);

/// The image of a point: b_H_a (a, 1), divided by the third coordinate (which must not be 0).
[[nodiscard]] inline Eigen::Vector2d apply_homography(const Eigen::Matrix3d& b_H_a,
                                                      const Eigen::Vector2d& a_point) {
  return (b_H_a * a_point.homogeneous()).hnormalized();
}

}  // namespace waymark
