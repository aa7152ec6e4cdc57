#pragma once

#include "waymark/geometry/so2.hpp"

namespace waymark {

/// A rigid motion of the plane, a_T_b = (a_R_b, a_t_b). Tangent: (x, y, yaw) [m, m, rad], in the parent frame
/// a.
class SE2 {
 public:
  static constexpr int kDof = 3;
  static constexpr int kRotationDof = 1;  ///< the last so many of a tangent are rotation
  static constexpr int kMatrixSize = 3;
  static constexpr int kPointSize = 2;
  using Tangent = Eigen::Vector3d;
  using Jacobian = Eigen::Matrix3d;
  using Matrix = Eigen::Matrix3d;
  using Point = Eigen::Vector2d;

  SE2() = default;
  SE2(const SO2& a_R_b, const Eigen::Vector2d& a_t_b) : rotation_(a_R_b), translation_(a_t_b) {}
  /// x, y [m], yaw [rad].
  SE2(double x, double y, double yaw) : rotation_(yaw), translation_(x, y) {}

  [[nodiscard]] const SO2& rotation() const { return rotation_; }
  [[nodiscard]] const Eigen::Vector2d& translation() const { return translation_; }
  [[nodiscard]] double x() const { return translation_.x(); }
  [[nodiscard]] double y() const { return translation_.y(); }
  /// In (-pi, pi] [rad].
  [[nodiscard]] double yaw() const { return rotation_.angle(); }

  [[nodiscard]] static SE2 identity() { return {}; }
  [[nodiscard]] static SE2 exp(const Tangent& xi);
  /// Yaw in (-pi, pi].
  [[nodiscard]] Tangent log() const;

  [[nodiscard]] SE2 inverse() const {
    const SO2 b_R_a = rotation_.inverse();
    return {b_R_a, -(b_R_a * translation_)};
  }
  [[nodiscard]] SE2 operator*(const SE2& b_T_c) const {
    return {rotation_ * b_T_c.rotation_, rotation_ * b_T_c.translation_ + translation_};
  }
  [[nodiscard]] Point operator*(const Point& b_p) const { return rotation_ * b_p + translation_; }
  /// a_p = a_T_b b_p with its Jacobians: J_p_T (2x3) for a left perturbation of a_T_b, J_p_p (2x2) for the
  /// point.
  [[nodiscard]] Point act(const Point& b_p, Eigen::Matrix<double, 2, 3>* J_p_T,
                          Eigen::Matrix2d* J_p_p = nullptr) const;

  [[nodiscard]] Matrix matrix() const;
  /// X exp(xi) X^-1 = exp(X.adjoint() xi).
  [[nodiscard]] Jacobian adjoint() const;
  /// ad(xi) eta = vee(hat(xi) hat(eta) - hat(eta) hat(xi)).
  [[nodiscard]] static Jacobian ad(const Tangent& xi);
  [[nodiscard]] static Matrix hat(const Tangent& xi);
  [[nodiscard]] static Tangent vee(const Matrix& m);

  /// ad^3 = -theta^2 ad here as in SO(3), so the same polynomial serves both: I + c2 ad + c3 ad^2.
  [[nodiscard]] static Jacobian left_jacobian(const Tangent& xi);
  /// Defined for |yaw| < 2 pi.
  [[nodiscard]] static Jacobian left_jacobian_inverse(const Tangent& xi);
  [[nodiscard]] static Jacobian right_jacobian(const Tangent& xi);
  [[nodiscard]] static Jacobian right_jacobian_inverse(const Tangent& xi);

  /// Same bits.
  friend bool operator==(const SE2&, const SE2&) = default;

 private:
  SO2 rotation_;
  Eigen::Vector2d translation_ = Eigen::Vector2d::Zero();
};

}  // namespace waymark
