#pragma once

#include <cassert>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "waymark/base/error.hpp"
#include "waymark/geometry/stumpff.hpp"

namespace waymark {

/// A rotation in space, a_R_b, stored as a unit quaternion with w >= 0. A quaternion product costs less than
/// a matrix product, log is exact up to and including an angle of pi, and unit length is the only constraint
/// to maintain. Every product is renormalised, so even in long chains the length stays within a few units in
/// the last place of 1. The tangent is the rotation vector [rad] in the parent frame a.
class SO3 {
 public:
  static constexpr int kDof = 3;
  static constexpr int kRotationDof = 3;  ///< number of rotation components, which come last in a tangent
  static constexpr int kMatrixSize = 3;
  static constexpr int kPointSize = 3;
  using Tangent = Eigen::Vector3d;
  using Jacobian = Eigen::Matrix3d;
  using Matrix = Eigen::Matrix3d;
  using Point = Eigen::Vector3d;

  SO3() = default;

  [[nodiscard]] static SO3 identity() { return {}; }
  /// From any finite non-zero quaternion of either sign, which is normalised. For trusted input; otherwise
  /// use try_from_quaternion.
  [[nodiscard]] static SO3 from_quaternion(const Eigen::Quaterniond& a_q_b);
  /// The rotation nearest to a_R_b in the Frobenius norm (Davenport's q-method, as in Bar-Itzhack, "New
  /// method for extracting the quaternion from a rotation matrix", JGCD 23(6), 2000). For trusted input;
  /// otherwise use try_from_matrix.
  [[nodiscard]] static SO3 from_matrix(const Eigen::Matrix3d& a_R_b);
  /// Like from_quaternion for untrusted input: fails if a component is not finite or the length differs from
  /// 1 by more than `tolerance`.
  [[nodiscard]] static Result<SO3> try_from_quaternion(const Eigen::Quaterniond& a_q_b,
                                                       double tolerance = 1e-3);
  /// Like from_matrix for untrusted input: fails if an entry is not finite, if the matrix is a reflection, or
  /// if the largest entry of R^T R - I exceeds `tolerance`.
  [[nodiscard]] static Result<SO3> try_from_matrix(const Eigen::Matrix3d& a_R_b, double tolerance = 1e-3);
  /// R_z(yaw) R_y(pitch) R_x(roll) [rad] (REP 103: fixed axes, roll about x first). For input and output;
  /// compute with log.
  [[nodiscard]] static SO3 from_rpy(double roll, double pitch, double yaw);
  /// (roll, pitch, yaw) [rad], with roll and yaw in [-pi, pi] and pitch in [-pi/2, pi/2]. from_rpy always
  /// recovers the rotation. At pitch = ±pi/2, only roll ∓ yaw is defined, and yaw is 0 or determined by
  /// rounding.
  [[nodiscard]] Eigen::Vector3d rpy() const;

  /// The rotation by |xi| about xi, for any finite xi (|xi| < 1e150).
  [[nodiscard]] static SO3 exp(const Tangent& xi);
  /// The rotation vector, with |log| <= pi. At exactly pi, two vectors describe the same rotation; the one
  /// whose first non-zero component is positive is returned.
  [[nodiscard]] Tangent log() const;
  /// The rotation angle in [0, pi] [rad].
  [[nodiscard]] double angle() const;

  [[nodiscard]] SO3 inverse() const { return canonical(q_.conjugate()); }
  [[nodiscard]] SO3 operator*(const SO3& b_R_c) const { return renormalized(q_ * b_R_c.q_); }
  [[nodiscard]] Point operator*(const Point& b_p) const { return q_ * b_p; }
  /// a_p = a_R_b b_p with its Jacobians: J_p_R (3x3) for a left perturbation of the rotation and J_p_p (3x3)
  /// for the point.
  [[nodiscard]] Point act(const Point& b_p, Eigen::Matrix3d* J_p_R, Eigen::Matrix3d* J_p_p = nullptr) const;

  [[nodiscard]] Matrix matrix() const;
  /// Has unit length and w >= 0.
  [[nodiscard]] const Eigen::Quaterniond& quaternion() const { return q_; }

  /// X exp(xi) X^-1 = exp(X.adjoint() xi).
  [[nodiscard]] Jacobian adjoint() const { return matrix(); }
  /// ad(xi) eta = xi x eta.
  [[nodiscard]] static Jacobian ad(const Tangent& xi) { return hat(xi); }
  /// hat(xi) p = xi x p.
  [[nodiscard]] static Matrix hat(const Tangent& xi);
  /// The inverse of hat. Uses only the skew-symmetric part of the matrix.
  [[nodiscard]] static Tangent vee(const Matrix& m);

  /// exp(xi + d) = exp(left_jacobian(xi) d) exp(xi) to first order in d: I + c2 ad + c3 ad^2.
  [[nodiscard]] static Jacobian left_jacobian(const Tangent& xi);
  /// Defined for |xi| < 2 pi.
  [[nodiscard]] static Jacobian left_jacobian_inverse(const Tangent& xi);
  [[nodiscard]] static Jacobian right_jacobian(const Tangent& xi);
  [[nodiscard]] static Jacobian right_jacobian_inverse(const Tangent& xi);

  /// Compares bit by bit.
  friend bool operator==(const SO3& x, const SO3& y) { return x.q_.coeffs() == y.q_.coeffs(); }

 private:
  explicit SO3(const Eigen::Quaterniond& unit) : q_(unit) {}
  /// I + a xi^ + b xi^ xi^, with xi^ xi^ = xi xi^T - s I.
  [[nodiscard]] static Matrix polynomial(const Tangent& xi, double s, double a, double b);
  /// Of the two unit quaternions for a rotation, selects the one with w > 0 or, if w = 0, the one whose first
  /// non-zero component is positive.
  [[nodiscard]] static SO3 canonical(const Eigen::Quaterniond& q) {
    return SO3(is_canonical(q) ? q : Eigen::Quaterniond(-q.coeffs()));
  }
  [[nodiscard]] static bool is_canonical(const Eigen::Quaterniond& q) {
    if (q.w() != 0) return q.w() > 0;
    if (q.x() != 0) return q.x() > 0;
    if (q.y() != 0) return q.y() > 0;
    return q.z() > 0;
  }
  /// One Newton step towards unit length. The product of two unit factors has an error of about 1e-16, which
  /// the step squares. There is no drift and no square root.
  [[nodiscard]] static SO3 renormalized(const Eigen::Quaterniond& q) {
    return canonical(Eigen::Quaterniond(q.coeffs() * ((3.0 - q.squaredNorm()) / 2)));
  }

  Eigen::Quaterniond q_ = Eigen::Quaterniond::Identity();
};

namespace internal {

/// Q(rho, phi), the coupling between translation and rotation in the left Jacobians of SE(3) and SE_2(3)
/// (Barfoot, "State Estimation for Robotics", equation (7.86); docs/concepts/geometry.md, equation (16)). It
/// is the derivative of SO3's left Jacobian I + c2 phi^ + c3 phi^ phi^ along rho; this form saves four matrix
/// products.
[[nodiscard]] Eigen::Matrix3d coupling(const Eigen::Vector3d& rho, const Eigen::Vector3d& phi,
                                       const Stumpff& c);

/// (I + a phi^ + b phi^ phi^) v: a Jacobian of SO3 times a vector, without forming the matrix.
[[nodiscard]] Eigen::Vector3d times_polynomial(const Eigen::Vector3d& phi, double a, double b,
                                               const Eigen::Vector3d& v);

}  // namespace internal

/// A rigid motion in space, a_T_b = (a_R_b, a_t_b): the pose of b in a. Tangent: (translation, rotation) [m,
/// rad], both in the parent frame a; X = exp(xi) X_hat.
class SE3 {
 public:
  static constexpr int kDof = 6;
  static constexpr int kRotationDof = 3;  ///< number of rotation components, which come last in a tangent
  static constexpr int kMatrixSize = 4;
  static constexpr int kPointSize = 3;
  using Tangent = Eigen::Matrix<double, 6, 1>;
  using Jacobian = Eigen::Matrix<double, 6, 6>;
  using Matrix = Eigen::Matrix4d;
  using Point = Eigen::Vector3d;

  SE3() = default;
  SE3(const SO3& a_R_b, const Eigen::Vector3d& a_t_b) : rotation_(a_R_b), translation_(a_t_b) {}
  /// From a trusted 4x4 homogeneous matrix; its rotation part is converted by SO3::from_matrix (nearest
  /// rotation).
  [[nodiscard]] static SE3 from_matrix(const Matrix& a_T_b);

  /// Like from_matrix for untrusted input. Fails if SO3::try_from_matrix fails, if the translation is not
  /// finite, or if the last row is not 0 0 0 1 (usually a transposed matrix).
  [[nodiscard]] static Result<SE3> try_from_matrix(const Matrix& a_T_b, double tolerance = 1e-3);

  [[nodiscard]] const SO3& rotation() const { return rotation_; }
  [[nodiscard]] const Eigen::Vector3d& translation() const { return translation_; }

  [[nodiscard]] static SE3 identity() { return {}; }
  [[nodiscard]] static SE3 exp(const Tangent& xi);
  /// The rotation part is as for SO3::log, with |rotation| <= pi.
  [[nodiscard]] Tangent log() const;

  [[nodiscard]] SE3 inverse() const {
    const SO3 b_R_a = rotation_.inverse();
    return {b_R_a, -(b_R_a * translation_)};
  }
  [[nodiscard]] SE3 operator*(const SE3& b_T_c) const {
    return {rotation_ * b_T_c.rotation_, rotation_ * b_T_c.translation_ + translation_};
  }
  [[nodiscard]] Point operator*(const Point& b_p) const { return rotation_ * b_p + translation_; }
  /// a_p = a_T_b b_p with its Jacobians: J_p_T (3x6) = [I, -a_p^] for a left perturbation and J_p_p (3x3) for
  /// the point.
  [[nodiscard]] Point act(const Point& b_p, Eigen::Matrix<double, 3, 6>* J_p_T,
                          Eigen::Matrix3d* J_p_p = nullptr) const;

  [[nodiscard]] Matrix matrix() const;
  /// X exp(xi) X^-1 = exp(X.adjoint() xi): [R, t^ R; 0, R].
  [[nodiscard]] Jacobian adjoint() const;
  /// ad(xi) eta = vee(hat(xi) hat(eta) - hat(eta) hat(xi)).
  [[nodiscard]] static Jacobian ad(const Tangent& xi);
  [[nodiscard]] static Matrix hat(const Tangent& xi);
  [[nodiscard]] static Tangent vee(const Matrix& m);

  /// exp(xi + d) = exp(left_jacobian(xi) d) exp(xi) to first order in d: [J, Q; 0, J].
  [[nodiscard]] static Jacobian left_jacobian(const Tangent& xi);
  /// [J^-1, -J^-1 Q J^-1; 0, J^-1]. Defined if the rotation part is < 2 pi.
  [[nodiscard]] static Jacobian left_jacobian_inverse(const Tangent& xi);
  [[nodiscard]] static Jacobian right_jacobian(const Tangent& xi);
  [[nodiscard]] static Jacobian right_jacobian_inverse(const Tangent& xi);

  /// Compares bit by bit.
  friend bool operator==(const SE3&, const SE3&) = default;

 private:
  [[nodiscard]] static Jacobian blocks(const Eigen::Matrix3d& diagonal, const Eigen::Matrix3d& upper);

  SO3 rotation_;
  Eigen::Vector3d translation_ = Eigen::Vector3d::Zero();
};

/// An extended pose (R, p, v) in SE_2(3): position, velocity and rotation of b in a, all written in a (Barrau
/// and Bonnabel, "The Invariant Extended Kalman Filter as a Stable Observer", IEEE TAC 62(4), 2017; Brossard,
/// Barrau, Chauchat and Bonnabel, "Associating Uncertainty to Extended Poses for on Lie Group IMU
/// Preintegration with Rotating Earth", IEEE T-RO 38(2), 2022). Tangent: (position, velocity, rotation) [m,
/// m/s, rad], in the parent frame.
class SE23 {
 public:
  static constexpr int kDof = 9;
  static constexpr int kRotationDof = 3;  ///< number of rotation components, which come last in a tangent
  static constexpr int kMatrixSize = 5;
  using Tangent = Eigen::Matrix<double, 9, 1>;
  using Jacobian = Eigen::Matrix<double, 9, 9>;
  using Matrix = Eigen::Matrix<double, 5, 5>;

  SE23() = default;
  /// Rotation a_R_b, position a_t_b [m], and velocity of b relative to a, expressed in a [m/s].
  SE23(const SO3& a_R_b, const Eigen::Vector3d& a_t_b, const Eigen::Vector3d& a_v_b)
      : rotation_(a_R_b), position_(a_t_b), velocity_(a_v_b) {}

  [[nodiscard]] const SO3& rotation() const { return rotation_; }
  [[nodiscard]] const Eigen::Vector3d& position() const { return position_; }
  [[nodiscard]] const Eigen::Vector3d& velocity() const { return velocity_; }
  /// The pose without the velocity; a homomorphism.
  [[nodiscard]] SE3 pose() const { return {rotation_, position_}; }

  [[nodiscard]] static SE23 identity() { return {}; }
  [[nodiscard]] static SE23 exp(const Tangent& xi);
  /// The rotation part is as for SO3::log, with |rotation| <= pi.
  [[nodiscard]] Tangent log() const;

  [[nodiscard]] SE23 inverse() const;
  [[nodiscard]] SE23 operator*(const SE23& b_X_c) const {
    return {rotation_ * b_X_c.rotation_, rotation_ * b_X_c.position_ + position_,
            rotation_ * b_X_c.velocity_ + velocity_};
  }

  /// [R, p, v; 0, 1, 0; 0, 0, 1].
  [[nodiscard]] Matrix matrix() const;
  /// X exp(xi) X^-1 = exp(X.adjoint() xi): [R, 0, p^ R; 0, R, v^ R; 0, 0, R].
  [[nodiscard]] Jacobian adjoint() const;
  /// ad(xi) eta = vee(hat(xi) hat(eta) - hat(eta) hat(xi)).
  [[nodiscard]] static Jacobian ad(const Tangent& xi);
  [[nodiscard]] static Matrix hat(const Tangent& xi);
  [[nodiscard]] static Tangent vee(const Matrix& m);

  /// exp(xi + d) = exp(left_jacobian(xi) d) exp(xi) to first order in d: [J, 0, Q_p; 0, J, Q_v; 0, 0, J].
  [[nodiscard]] static Jacobian left_jacobian(const Tangent& xi);
  /// Defined if the rotation part is < 2 pi.
  [[nodiscard]] static Jacobian left_jacobian_inverse(const Tangent& xi);
  [[nodiscard]] static Jacobian right_jacobian(const Tangent& xi);
  [[nodiscard]] static Jacobian right_jacobian_inverse(const Tangent& xi);

  /// Compares bit by bit.
  friend bool operator==(const SE23&, const SE23&) = default;

 private:
  [[nodiscard]] static Jacobian blocks(const Eigen::Matrix3d& diagonal, const Eigen::Matrix3d& position,
                                       const Eigen::Matrix3d& velocity);

  SO3 rotation_;
  Eigen::Vector3d position_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d velocity_ = Eigen::Vector3d::Zero();
};

}  // namespace waymark
