#pragma once

#include "waymark/geometry/so3.hpp"
#include "waymark/geometry/stumpff.hpp"

namespace waymark {

namespace internal {

/// Q(rho, phi), the coupling of translation and rotation in the left Jacobians of SE(3) and SE_2(3) (Barfoot,
/// "State Estimation for Robotics", equation (7.86); docs/concepts/geometry.md, equation (16)). It is the
/// derivative of SO3's left Jacobian I + c2 phi^ + c3 phi^ phi^ along rho; written so, four products of
/// matrices fall away.
[[nodiscard]] Eigen::Matrix3d coupling(const Eigen::Vector3d& rho, const Eigen::Vector3d& phi,
                                       const Stumpff& c);

/// (I + a phi^ + b phi^ phi^) v: a Jacobian of SO3 times a vector, without the matrix.
[[nodiscard]] Eigen::Vector3d times_polynomial(const Eigen::Vector3d& phi, double a, double b,
                                               const Eigen::Vector3d& v);

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
  [[nodiscard]] static SE3 from_matrix(const Matrix& a_T_b);

  /// As from_matrix for numbers from outside: fails on what SO3::try_from_matrix does, on a translation that
  /// is not finite, and if the last row is not 0 0 0 1 (a transposed matrix, mostly).
  [[nodiscard]] static Result<SE3> try_from_matrix(const Matrix& a_T_b, double tolerance = 1e-3);

  [[nodiscard]] const SO3& rotation() const { return rotation_; }
  [[nodiscard]] const Eigen::Vector3d& translation() const { return translation_; }

  [[nodiscard]] static SE3 identity() { return {}; }
  [[nodiscard]] static SE3 exp(const Tangent& xi);
  /// Rotation part as SO3::log, |rotation| <= pi.
  [[nodiscard]] Tangent log() const;

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
  /// [J^-1, -J^-1 Q J^-1; 0, J^-1]. Defined for a rotation part < 2 pi.
  [[nodiscard]] static Jacobian left_jacobian_inverse(const Tangent& xi);
  [[nodiscard]] static Jacobian right_jacobian(const Tangent& xi);
  [[nodiscard]] static Jacobian right_jacobian_inverse(const Tangent& xi);

  /// Same bits.
  friend bool operator==(const SE3&, const SE3&) = default;

 private:
  [[nodiscard]] static Jacobian blocks(const Eigen::Matrix3d& diagonal, const Eigen::Matrix3d& upper);

  SO3 rotation_;
  Eigen::Vector3d translation_ = Eigen::Vector3d::Zero();
};

}  // namespace waymark
