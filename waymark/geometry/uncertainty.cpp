#include "waymark/geometry/uncertainty.hpp"

namespace waymark::internal {

SE2::Jacobian coordinate_jacobian(const SE2& X, double sign) {
  SE2::Jacobian J = SE2::Jacobian::Identity();
  J.topRightCorner<2, 1>() << -sign * X.y(), sign * X.x();
  return J;
}
SE3::Jacobian coordinate_jacobian(const SE3& X, double sign) {
  SE3::Jacobian J = SE3::Jacobian::Identity();
  J.topRightCorner<3, 3>() = -sign * SO3::hat(X.translation());
  return J;
}
SE23::Jacobian coordinate_jacobian(const SE23& X, double sign) {
  SE23::Jacobian J = SE23::Jacobian::Identity();
  J.block<3, 3>(0, 6) = -sign * SO3::hat(X.position());
  J.block<3, 3>(3, 6) = -sign * SO3::hat(X.velocity());
  return J;
}

}  // namespace waymark::internal
