#pragma once

#include "waymark/geometry/se2.hpp"
#include "waymark/geometry/se3.hpp"

namespace waymark {

/// The rotation about z by the same angle. A homomorphism: lift(X Y) = lift(X) lift(Y).
[[nodiscard]] inline SO3 lift(const SO2& a_R_b) { return SO3::exp({0, 0, a_R_b.angle()}); }

/// The same motion, performed in the plane z = 0 of 3D space. A homomorphism: lift(X Y) = lift(X) lift(Y).
[[nodiscard]] inline SE3 lift(const SE2& a_T_b) {
  return {lift(a_T_b.rotation()), {a_T_b.x(), a_T_b.y(), 0}};
}

/// The x, y and heading of b in the plane z = 0 of a. The height is dropped. The yaw is the direction of the
/// x axis of b (forward, for a robot base) as seen from above, as in SO3::rpy. This is the inverse of lift.
/// It commutes with planar motions on the left, project_to_plane(lift(A) X) = A project_to_plane(X), but is
/// not a homomorphism in general. If the x axis is vertical, the heading is undefined, and yaw is determined
/// by rounding (0 if the components are exactly zero).
[[nodiscard]] inline SE2 project_to_plane(const SE3& a_T_b) {
  const Eigen::Vector3d a_x_b = a_T_b.rotation() * Eigen::Vector3d::UnitX();
  return {a_T_b.translation().x(), a_T_b.translation().y(), std::atan2(a_x_b.y() + 0.0, a_x_b.x())};
}

}  // namespace waymark
