#pragma once

#include "waymark/geometry/so3.hpp"

namespace waymark {

namespace internal {

/// Q(rho, phi), the coupling of translation and rotation in the left Jacobians of SE(3) and SE_2(3) (Barfoot,
/// "State Estimation for Robotics", equation (7.86); docs/concepts/geometry.md, equation (16)). It is the
/// derivative of SO3's left Jacobian I + c2 phi^ + c3 phi^ phi^ along rho; written so, four products of
/// matrices fall away.
[[nodiscard]] inline Eigen::Matrix3d coupling(const Eigen::Vector3d& rho, const Eigen::Vector3d& phi,
                                              const Stumpff& c) {
  const double d = phi.dot(rho);
  const double s = phi.squaredNorm();
  const double quadratic = d * (c.c4 - 3 * c.c5);
  Eigen::Matrix3d q = SO3::hat(c.c2 * rho + d * (2 * c.c4 - c.c3) * phi);
  q += (c.c3 * rho - quadratic * phi) * phi.transpose() + c.c3 * phi * rho.transpose();
  q.diagonal().array() += quadratic * s - 2 * c.c3 * d;
  return q;
}

/// (I + a phi^ + b phi^ phi^) v: a Jacobian of SO3 times a vector, without the matrix.
[[nodiscard]] inline Eigen::Vector3d times_polynomial(const Eigen::Vector3d& phi, double a, double b,
                                                      const Eigen::Vector3d& v) {
  const Eigen::Vector3d w = phi.cross(v);
  return v + a * w + b * phi.cross(w);
}

}  // namespace internal

/// A rigid motion of space, a_T_b = (a_R_b, a_t_b): the pose of b in a. Tangent: (translation, rotation) [m,
/// rad], both in the parent frame a; X = exp(xi) X_hat.
class SE3 {
 public:
  static constexpr int kDof = 6;
  static constexpr int kRotationDof = 3;  ///< the last so many of a tangent are rotation
  static constexpr int kMatrixSize = 4;
  static constexpr int kPointSize = 3;
  using Tangent = Eigen::Matrix<double, 6, 1>;
  using Jacobian = Eigen::Matrix<double, 6, 6>;
  using Matrix = Eigen::Matrix4d;
  using Point = Eigen::Vector3d;

  SE3() = default;
  SE3(const SO3& a_R_b, const Eigen::Vector3d& a_t_b) : rotation_(a_R_b), translation_(a_t_b) {}
  /// From a 4x4 homogeneous matrix that can be trusted; its rotation part goes through SO3::from_matrix
  /// (nearest rotation).
  [[nodiscard]] static SE3 from_matrix(const Matrix& a_T_b) {
    return {SO3::from_matrix(a_T_b.topLeftCorner<3, 3>()), a_T_b.topRightCorner<3, 1>()};
  }

  /// As from_matrix for numbers from outside: fails on what SO3::try_from_matrix does, on a translation that
  /// is not finite, and if the last row is not 0 0 0 1 (a transposed matrix, mostly).
  [[nodiscard]] static Result<SE3> try_from_matrix(const Matrix& a_T_b, double tolerance = 1e-3);

  [[nodiscard]] const SO3& rotation() const { return rotation_; }
  [[nodiscard]] const Eigen::Vector3d& translation() const { return translation_; }

  [[nodiscard]] static SE3 identity() { return {}; }
  [[nodiscard]] static SE3 exp(const Tangent& xi) {
    const Eigen::Vector3d phi = xi.tail<3>();
    const Stumpff c = stumpff(phi.squaredNorm());
    return {SO3::exp(phi), internal::times_polynomial(phi, c.c2, c.c3, xi.head<3>())};
  }
  /// Rotation part as SO3::log, |rotation| <= pi.
  [[nodiscard]] Tangent log() const {
    const Eigen::Vector3d phi = rotation_.log();
    const double e = inverse_jacobian_coefficient(phi.squaredNorm());
    Tangent xi;
    xi << internal::times_polynomial(phi, -0.5, e, translation_), phi;
    return xi;
  }

  [[nodiscard]] SE3 inverse() const {
    const SO3 b_R_a = rotation_.inverse();
    return {b_R_a, -(b_R_a * translation_)};
  }
  [[nodiscard]] SE3 operator*(const SE3& b_T_c) const {
    return {rotation_ * b_T_c.rotation_, rotation_ * b_T_c.translation_ + translation_};
  }
  [[nodiscard]] Point operator*(const Point& b_p) const { return rotation_ * b_p + translation_; }
  /// a_p = a_T_b b_p with its Jacobians: J_p_T (3x6) = [I, -a_p^] for a left perturbation, J_p_p (3x3) for
  /// the point.
  [[nodiscard]] Point act(const Point& b_p, Eigen::Matrix<double, 3, 6>* J_p_T,
                          Eigen::Matrix3d* J_p_p = nullptr) const {
    Point a_p = *this * b_p;
    if (J_p_T != nullptr) *J_p_T << Eigen::Matrix3d::Identity(), -SO3::hat(a_p);
    if (J_p_p != nullptr) *J_p_p = rotation_.matrix();
    return a_p;
  }

  [[nodiscard]] Matrix matrix() const {
    Matrix m = Matrix::Identity();
    m.topLeftCorner<3, 3>() = rotation_.matrix();
    m.topRightCorner<3, 1>() = translation_;
    return m;
  }
  /// X exp(xi) X^-1 = exp(X.adjoint() xi): [R, t^ R; 0, R].
  [[nodiscard]] Jacobian adjoint() const {
    const Eigen::Matrix3d R = rotation_.matrix();
    return blocks(R, SO3::hat(translation_) * R);
  }
  /// ad(xi) eta = vee(hat(xi) hat(eta) - hat(eta) hat(xi)).
  [[nodiscard]] static Jacobian ad(const Tangent& xi) {
    return blocks(SO3::hat(xi.tail<3>()), SO3::hat(xi.head<3>()));
  }
  [[nodiscard]] static Matrix hat(const Tangent& xi) {
    Matrix m = Matrix::Zero();
    m.topLeftCorner<3, 3>() = SO3::hat(xi.tail<3>());
    m.topRightCorner<3, 1>() = xi.head<3>();
    return m;
  }
  [[nodiscard]] static Tangent vee(const Matrix& m) {
    Tangent xi;
    xi << m.topRightCorner<3, 1>(), SO3::vee(m.topLeftCorner<3, 3>());
    return xi;
  }

  /// exp(xi + d) = exp(left_jacobian(xi) d) exp(xi) to first order in d: [J, Q; 0, J].
  [[nodiscard]] static Jacobian left_jacobian(const Tangent& xi) {
    const Eigen::Vector3d phi = xi.tail<3>();
    return blocks(SO3::left_jacobian(phi), internal::coupling(xi.head<3>(), phi, stumpff(phi.squaredNorm())));
  }
  /// [J^-1, -J^-1 Q J^-1; 0, J^-1]. Defined for a rotation part < 2 pi.
  [[nodiscard]] static Jacobian left_jacobian_inverse(const Tangent& xi) {
    const Eigen::Vector3d phi = xi.tail<3>();
    const Eigen::Matrix3d inverse = SO3::left_jacobian_inverse(phi);
    return blocks(inverse,
                  -inverse * internal::coupling(xi.head<3>(), phi, stumpff(phi.squaredNorm())) * inverse);
  }
  [[nodiscard]] static Jacobian right_jacobian(const Tangent& xi) { return left_jacobian(-xi); }
  [[nodiscard]] static Jacobian right_jacobian_inverse(const Tangent& xi) {
    return left_jacobian_inverse(-xi);
  }

  /// Same bits.
  friend bool operator==(const SE3&, const SE3&) = default;

 private:
  [[nodiscard]] static Jacobian blocks(const Eigen::Matrix3d& diagonal, const Eigen::Matrix3d& upper) {
    return (Jacobian() << diagonal, upper, Eigen::Matrix3d::Zero(), diagonal).finished();
  }

  SO3 rotation_;
  Eigen::Vector3d translation_ = Eigen::Vector3d::Zero();
};

}  // namespace waymark
