#include "waymark/geometry/se3.hpp"

namespace waymark {

namespace internal {

Eigen::Matrix3d coupling(const Eigen::Vector3d& rho, const Eigen::Vector3d& phi, const Stumpff& c) {
  const double d = phi.dot(rho);
  const double s = phi.squaredNorm();
  const double quadratic = d * (c.c4 - 3 * c.c5);
  Eigen::Matrix3d q = SO3::hat(c.c2 * rho + d * (2 * c.c4 - c.c3) * phi);
  q += (c.c3 * rho - quadratic * phi) * phi.transpose() + c.c3 * phi * rho.transpose();
  q.diagonal().array() += quadratic * s - 2 * c.c3 * d;
  return q;
}

Eigen::Vector3d times_polynomial(const Eigen::Vector3d& phi, double a, double b, const Eigen::Vector3d& v) {
  const Eigen::Vector3d w = phi.cross(v);
  return v + a * w + b * phi.cross(w);
}

}  // namespace internal

SE3 SE3::from_matrix(const Matrix& a_T_b) {
  return {SO3::from_matrix(a_T_b.topLeftCorner<3, 3>()), a_T_b.topRightCorner<3, 1>()};
}

SE3 SE3::exp(const Tangent& xi) {
  const Eigen::Vector3d phi = xi.tail<3>();
  const Stumpff c = stumpff(phi.squaredNorm());
  return {SO3::exp(phi), internal::times_polynomial(phi, c.c2, c.c3, xi.head<3>())};
}

SE3::Tangent SE3::log() const {
  const Eigen::Vector3d phi = rotation_.log();
  const double e = inverse_jacobian_coefficient(phi.squaredNorm());
  Tangent xi;
  xi << internal::times_polynomial(phi, -0.5, e, translation_), phi;
  return xi;
}

SE3::Point SE3::act(const Point& b_p, Eigen::Matrix<double, 3, 6>* J_p_T, Eigen::Matrix3d* J_p_p) const {
  Point a_p = *this * b_p;
  if (J_p_T != nullptr) *J_p_T << Eigen::Matrix3d::Identity(), -SO3::hat(a_p);
  if (J_p_p != nullptr) *J_p_p = rotation_.matrix();
  return a_p;
}

SE3::Matrix SE3::matrix() const {
  Matrix m = Matrix::Identity();
  m.topLeftCorner<3, 3>() = rotation_.matrix();
  m.topRightCorner<3, 1>() = translation_;
  return m;
}

SE3::Jacobian SE3::adjoint() const {
  const Eigen::Matrix3d R = rotation_.matrix();
  return blocks(R, SO3::hat(translation_) * R);
}

SE3::Jacobian SE3::ad(const Tangent& xi) { return blocks(SO3::hat(xi.tail<3>()), SO3::hat(xi.head<3>())); }

SE3::Matrix SE3::hat(const Tangent& xi) {
  Matrix m = Matrix::Zero();
  m.topLeftCorner<3, 3>() = SO3::hat(xi.tail<3>());
  m.topRightCorner<3, 1>() = xi.head<3>();
  return m;
}

SE3::Tangent SE3::vee(const Matrix& m) {
  Tangent xi;
  xi << m.topRightCorner<3, 1>(), SO3::vee(m.topLeftCorner<3, 3>());
  return xi;
}

SE3::Jacobian SE3::left_jacobian(const Tangent& xi) {
  const Eigen::Vector3d phi = xi.tail<3>();
  return blocks(SO3::left_jacobian(phi), internal::coupling(xi.head<3>(), phi, stumpff(phi.squaredNorm())));
}

SE3::Jacobian SE3::left_jacobian_inverse(const Tangent& xi) {
  const Eigen::Vector3d phi = xi.tail<3>();
  const Eigen::Matrix3d inverse = SO3::left_jacobian_inverse(phi);
  return blocks(inverse,
                -inverse * internal::coupling(xi.head<3>(), phi, stumpff(phi.squaredNorm())) * inverse);
}

SE3::Jacobian SE3::right_jacobian(const Tangent& xi) { return left_jacobian(-xi); }

SE3::Jacobian SE3::right_jacobian_inverse(const Tangent& xi) { return left_jacobian_inverse(-xi); }

SE3::Jacobian SE3::blocks(const Eigen::Matrix3d& diagonal, const Eigen::Matrix3d& upper) {
  return (Jacobian() << diagonal, upper, Eigen::Matrix3d::Zero(), diagonal).finished();
}

Result<SE3> SE3::try_from_matrix(const Matrix& a_T_b, double tolerance) {
  if (!a_T_b.allFinite()) {
    return fail(ErrorCode::InvalidArgument, "a transform with an entry that is not a finite number", {},
                "Give sixteen finite numbers.");
  }
  if (!((a_T_b.row(3) - Eigen::RowVector4d(0, 0, 0, 1)).cwiseAbs().maxCoeff() <= tolerance)) {
    return fail(ErrorCode::InvalidArgument, "a transform whose last row is not 0 0 0 1", {},
                "Give the matrix row by row, with the translation in the last column.");
  }
  return SO3::try_from_matrix(a_T_b.topLeftCorner<3, 3>(), tolerance).map([&](const SO3& a_R_b) {
    return SE3(a_R_b, a_T_b.topRightCorner<3, 1>());
  });
}

}  // namespace waymark
