#include "waymark/geometry/se3.hpp"

#include <cassert>
#include <cmath>

#include <fmt/format.h>
#include <Eigen/LU>

#include "waymark/geometry/dense.hpp"
#include "waymark/geometry/stumpff.hpp"

namespace waymark {
namespace {

/// Davenport's matrix for R: its dominant eigenvector is the quaternion (x, y, z, w) of the rotation nearest
/// to R.
Eigen::Matrix4d davenport_matrix(const Eigen::Matrix3d& R) {
  Eigen::Matrix4d k;
  k.topLeftCorner<3, 3>() = R + R.transpose() - R.trace() * Eigen::Matrix3d::Identity();
  k.topRightCorner<3, 1>() << R(2, 1) - R(1, 2), R(0, 2) - R(2, 0), R(1, 0) - R(0, 1);
  k.bottomLeftCorner<1, 3>() = k.topRightCorner<3, 1>().transpose();
  k(3, 3) = R.trace();
  return k;
}

double orthonormality_error(const Eigen::Matrix3d& R) {
  return (R.transpose() * R - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
}

}  // namespace

SO3 SO3::from_quaternion(const Eigen::Quaterniond& a_q_b) {
  assert(a_q_b.coeffs().allFinite() && a_q_b.coeffs().stableNorm() > 0);
  return canonical(Eigen::Quaterniond(a_q_b.coeffs().stableNormalized()));
}

SO3 SO3::exp(const Tangent& xi) {
  assert(xi.allFinite());
  const double quarter = xi.squaredNorm() / 4;  // (theta/2)^2
  double half_sinc = 1.0, cosine = 1.0;         // sin(theta/2) / (theta/2), cos(theta/2)
  if (quarter < 1e-8) {                         // the next terms are below 1e-27
    half_sinc = 1.0 - quarter / 6 * (1.0 - quarter / 20);
    cosine = 1.0 - quarter / 2 * (1.0 - quarter / 12);
  } else {
    const double half = std::sqrt(quarter);
    half_sinc = std::sin(half) / half;
    cosine = std::cos(half);
  }
  const Eigen::Vector3d v = half_sinc / 2 * xi;
  return renormalized({cosine, v.x(), v.y(), v.z()});
}

SO3::Tangent SO3::log() const {
  const double n = q_.vec().norm();
  // atan2 preserves the full precision of the angle at both ends: near 0 through n, and near pi through w.
  const double scale = n > 0 ? 2 * std::atan2(n, q_.w()) / n : 2.0;
  return scale * q_.vec();
}

double SO3::angle() const { return 2 * std::atan2(q_.vec().norm(), q_.w()); }

SO3::Point SO3::act(const Point& b_p, Eigen::Matrix3d* J_p_R, Eigen::Matrix3d* J_p_p) const {
  Point a_p = *this * b_p;
  if (J_p_R != nullptr) *J_p_R = -hat(a_p);
  if (J_p_p != nullptr) *J_p_p = matrix();
  return a_p;
}

SO3::Matrix SO3::matrix() const { return q_.toRotationMatrix(); }

SO3::Matrix SO3::hat(const Tangent& xi) {
  return (Matrix() << 0, -xi.z(), xi.y(), xi.z(), 0, -xi.x(), -xi.y(), xi.x(), 0).finished();
}

SO3::Tangent SO3::vee(const Matrix& m) {
  return {(m(2, 1) - m(1, 2)) / 2, (m(0, 2) - m(2, 0)) / 2, (m(1, 0) - m(0, 1)) / 2};
}

SO3::Jacobian SO3::left_jacobian(const Tangent& xi) {
  const double s = xi.squaredNorm();
  const Stumpff c = stumpff(s);
  return polynomial(xi, s, c.c2, c.c3);
}

SO3::Jacobian SO3::left_jacobian_inverse(const Tangent& xi) {
  const double s = xi.squaredNorm();
  return polynomial(xi, s, -0.5, inverse_jacobian_coefficient(s));
}

SO3::Jacobian SO3::right_jacobian(const Tangent& xi) { return left_jacobian(-xi); }

SO3::Jacobian SO3::right_jacobian_inverse(const Tangent& xi) { return left_jacobian_inverse(-xi); }

SO3::Matrix SO3::polynomial(const Tangent& xi, double s, double a, double b) {
  Matrix m = a * hat(xi) + b * xi * xi.transpose();
  m.diagonal().array() += 1.0 - b * s;
  return m;
}

SO3 SO3::from_matrix(const Eigen::Matrix3d& a_R_b) {
  assert(a_R_b.allFinite());
  // If the matrix is already a rotation up to rounding, there is no need to search for the nearest one.
  if (orthonormality_error(a_R_b) < 1e-15 && a_R_b.determinant() > 0) {
    return from_quaternion(Eigen::Quaterniond(a_R_b));
  }
  const SymmetricEigen<4> axes = symmetric_eigen<4>(davenport_matrix(a_R_b));
  return from_quaternion(Eigen::Quaterniond(Eigen::Vector4d(axes.vectors.col(3))));
}

Result<SO3> SO3::try_from_quaternion(const Eigen::Quaterniond& a_q_b, double tolerance) {
  if (!a_q_b.coeffs().allFinite()) {
    return fail(ErrorCode::InvalidArgument, "non-finite quaternion", {}, "Give four finite numbers.");
  }
  const double length = a_q_b.coeffs().stableNorm();
  if (!(std::abs(length - 1.0) <= tolerance)) {
    return fail(ErrorCode::InvalidArgument,
                fmt::format("quaternion of length {:.6g} is not a rotation", length), {},
                "Give a quaternion of length 1, and check the order of its components (w first or last).");
  }
  return from_quaternion(a_q_b);
}

Result<SO3> SO3::try_from_matrix(const Eigen::Matrix3d& a_R_b, double tolerance) {
  if (!a_R_b.allFinite()) {
    return fail(ErrorCode::InvalidArgument, "rotation matrix with a non-finite entry", {},
                "Give nine finite numbers.");
  }
  const double error = orthonormality_error(a_R_b);
  if (!(error <= tolerance)) {
    return fail(ErrorCode::InvalidArgument,
                fmt::format("not a rotation matrix: R^T R differs from the identity by {:.3g}", error), {},
                "Give three orthogonal columns of length 1.");
  }
  if (a_R_b.determinant() < 0) {
    return fail(ErrorCode::InvalidArgument, "reflection instead of a rotation (determinant -1)", {},
                "Check the directions of the axes: frames must be right-handed.");
  }
  return from_matrix(a_R_b);
}

SO3 SO3::from_rpy(double roll, double pitch, double yaw) {
  const SO3 x = exp({roll, 0, 0});
  const SO3 y = exp({0, pitch, 0});
  const SO3 z = exp({0, 0, yaw});
  return z * (y * x);
}

Eigen::Vector3d SO3::rpy() const {
  const Matrix R = matrix();
  const double yaw = std::atan2(R(1, 0), R(0, 0));
  const double pitch = std::atan2(-R(2, 0), std::hypot(R(0, 0), R(1, 0)));
  // Roll is computed from the middle row of R_z(-yaw) R, so that roll and yaw are consistent even near pitch
  // = ±pi/2.
  const double s = std::sin(yaw), c = std::cos(yaw);
  const double roll = std::atan2(s * R(0, 2) - c * R(1, 2), c * R(1, 1) - s * R(0, 1));
  return {roll, pitch, yaw};
}

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
    return fail(ErrorCode::InvalidArgument, "transform with a non-finite entry", {},
                "Give sixteen finite numbers.");
  }
  if (!((a_T_b.row(3) - Eigen::RowVector4d(0, 0, 0, 1)).cwiseAbs().maxCoeff() <= tolerance)) {
    return fail(ErrorCode::InvalidArgument, "the last row of the transform is not 0 0 0 1", {},
                "Give the matrix row by row, with the translation in the last column.");
  }
  return SO3::try_from_matrix(a_T_b.topLeftCorner<3, 3>(), tolerance).map([&](const SO3& a_R_b) {
    return SE3(a_R_b, a_T_b.topRightCorner<3, 1>());
  });
}

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
