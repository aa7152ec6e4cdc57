#include "waymark/geometry/se23.hpp"

namespace waymark {

SE23 SE23::exp(const Tangent& xi) {
  const Eigen::Vector3d phi = xi.tail<3>();
  const Stumpff c = stumpff(phi.squaredNorm());
  return {SO3::exp(phi), internal::times_polynomial(phi, c.c2, c.c3, xi.head<3>()),
          internal::times_polynomial(phi, c.c2, c.c3, xi.segment<3>(3))};
}

SE23::Tangent SE23::log() const {
  const Eigen::Vector3d phi = rotation_.log();
  const double e = inverse_jacobian_coefficient(phi.squaredNorm());
  Tangent xi;
  xi << internal::times_polynomial(phi, -0.5, e, position_),
      internal::times_polynomial(phi, -0.5, e, velocity_), phi;
  return xi;
}

SE23 SE23::inverse() const {
  const SO3 b_R_a = rotation_.inverse();
  return {b_R_a, -(b_R_a * position_), -(b_R_a * velocity_)};
}

SE23::Matrix SE23::matrix() const {
  Matrix m = Matrix::Identity();
  m.topLeftCorner<3, 3>() = rotation_.matrix();
  m.block<3, 1>(0, 3) = position_;
  m.block<3, 1>(0, 4) = velocity_;
  return m;
}

SE23::Jacobian SE23::adjoint() const {
  const Eigen::Matrix3d R = rotation_.matrix();
  return blocks(R, SO3::hat(position_) * R, SO3::hat(velocity_) * R);
}

SE23::Jacobian SE23::ad(const Tangent& xi) {
  return blocks(SO3::hat(xi.tail<3>()), SO3::hat(xi.head<3>()), SO3::hat(xi.segment<3>(3)));
}

SE23::Matrix SE23::hat(const Tangent& xi) {
  Matrix m = Matrix::Zero();
  m.topLeftCorner<3, 3>() = SO3::hat(xi.tail<3>());
  m.block<3, 1>(0, 3) = xi.head<3>();
  m.block<3, 1>(0, 4) = xi.segment<3>(3);
  return m;
}

SE23::Tangent SE23::vee(const Matrix& m) {
  Tangent xi;
  xi << m.block<3, 1>(0, 3), m.block<3, 1>(0, 4), SO3::vee(m.topLeftCorner<3, 3>());
  return xi;
}

SE23::Jacobian SE23::left_jacobian(const Tangent& xi) {
  const Eigen::Vector3d phi = xi.tail<3>();
  const Stumpff c = stumpff(phi.squaredNorm());
  return blocks(SO3::left_jacobian(phi), internal::coupling(xi.head<3>(), phi, c),
                internal::coupling(xi.segment<3>(3), phi, c));
}

SE23::Jacobian SE23::left_jacobian_inverse(const Tangent& xi) {
  const Eigen::Vector3d phi = xi.tail<3>();
  const Stumpff c = stumpff(phi.squaredNorm());
  const Eigen::Matrix3d inverse = SO3::left_jacobian_inverse(phi);
  return blocks(inverse, -inverse * internal::coupling(xi.head<3>(), phi, c) * inverse,
                -inverse * internal::coupling(xi.segment<3>(3), phi, c) * inverse);
}

SE23::Jacobian SE23::right_jacobian(const Tangent& xi) { return left_jacobian(-xi); }

SE23::Jacobian SE23::right_jacobian_inverse(const Tangent& xi) { return left_jacobian_inverse(-xi); }

SE23::Jacobian SE23::blocks(const Eigen::Matrix3d& diagonal, const Eigen::Matrix3d& position,
                            const Eigen::Matrix3d& velocity) {
  const Eigen::Matrix3d zero = Eigen::Matrix3d::Zero();
  return (Jacobian() << diagonal, zero, position, zero, diagonal, velocity, zero, zero, diagonal).finished();
}

}  // namespace waymark
