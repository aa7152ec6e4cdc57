#pragma once

#include "waymark/geometry/se3.hpp"

namespace waymark {

/// An extended pose (R, p, v) in SE_2(3): position, velocity and rotation of b in a, all written in a (Barrau
/// and Bonnabel, "The Invariant Extended Kalman Filter as a Stable Observer", IEEE TAC 62(4), 2017; Brossard,
/// Barrau, Chauchat and Bonnabel, "Associating Uncertainty to Extended Poses for on Lie Group IMU
/// Preintegration with Rotating Earth", IEEE T-RO 38(2), 2022). Tangent: (position, velocity, rotation) [m,
/// m/s, rad], in the parent frame.
class SE23 {
 public:
  static constexpr int kDof = 9;
  static constexpr int kRotationDof = 3;  ///< the last so many of a tangent are rotation
  static constexpr int kMatrixSize = 5;
  using Tangent = Eigen::Matrix<double, 9, 1>;
  using Jacobian = Eigen::Matrix<double, 9, 9>;
  using Matrix = Eigen::Matrix<double, 5, 5>;

  SE23() = default;
  /// Rotation a_R_b, position a_t_b [m], velocity of b as seen from a, written in a [m/s].
  SE23(const SO3& a_R_b, const Eigen::Vector3d& a_t_b, const Eigen::Vector3d& a_v_b)
      : rotation_(a_R_b), position_(a_t_b), velocity_(a_v_b) {}

  [[nodiscard]] const SO3& rotation() const { return rotation_; }
  [[nodiscard]] const Eigen::Vector3d& position() const { return position_; }
  [[nodiscard]] const Eigen::Vector3d& velocity() const { return velocity_; }
  /// Without the velocity; a homomorphism.
  [[nodiscard]] SE3 pose() const { return {rotation_, position_}; }

  [[nodiscard]] static SE23 identity() { return {}; }
  [[nodiscard]] static SE23 exp(const Tangent& xi);
  /// Rotation part as SO3::log, |rotation| <= pi.
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
  /// Defined for a rotation part < 2 pi.
  [[nodiscard]] static Jacobian left_jacobian_inverse(const Tangent& xi);
  [[nodiscard]] static Jacobian right_jacobian(const Tangent& xi);
  [[nodiscard]] static Jacobian right_jacobian_inverse(const Tangent& xi);

  /// Same bits.
  friend bool operator==(const SE23&, const SE23&) = default;

 private:
  [[nodiscard]] static Jacobian blocks(const Eigen::Matrix3d& diagonal, const Eigen::Matrix3d& position,
                                       const Eigen::Matrix3d& velocity);

  SO3 rotation_;
  Eigen::Vector3d position_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d velocity_ = Eigen::Vector3d::Zero();
};

}  // namespace waymark
