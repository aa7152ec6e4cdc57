#pragma once

#include "waymark/geometry/so2.hpp"
#include "waymark/geometry/stumpff.hpp"

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
  [[nodiscard]] static SE2 exp(const Tangent& xi) {
    const double s = xi[2] * xi[2];
    const Stumpff c = stumpff(s);
    const double b = xi[2] * c.c2;
    return {SO2(xi[2]), {c.c1 * xi[0] - b * xi[1], b * xi[0] + c.c1 * xi[1]}};
  }
  /// Yaw in (-pi, pi].
  [[nodiscard]] Tangent log() const {
    const double theta = yaw();
    const double half = theta / 2;
    const double a =
        1.0 - theta * theta * inverse_jacobian_coefficient(theta * theta);  // (theta/2) cot(theta/2)
    return {a * x() + half * y(), -half * x() + a * y(), theta};
  }

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
                          Eigen::Matrix2d* J_p_p = nullptr) const {
    Point a_p = *this * b_p;
    if (J_p_T != nullptr) *J_p_T << 1, 0, -a_p.y(), 0, 1, a_p.x();
    if (J_p_p != nullptr) *J_p_p = rotation_.matrix();
    return a_p;
  }

  [[nodiscard]] Matrix matrix() const {
    Matrix m = Matrix::Identity();
    m.topLeftCorner<2, 2>() = rotation_.matrix();
    m.topRightCorner<2, 1>() = translation_;
    return m;
  }
  /// X exp(xi) X^-1 = exp(X.adjoint() xi).
  [[nodiscard]] Jacobian adjoint() const {
    Jacobian m = Jacobian::Identity();
    m.topLeftCorner<2, 2>() = rotation_.matrix();
    m.topRightCorner<2, 1>() << y(), -x();
    return m;
  }
  /// ad(xi) eta = vee(hat(xi) hat(eta) - hat(eta) hat(xi)).
  [[nodiscard]] static Jacobian ad(const Tangent& xi) {
    return (Jacobian() << 0, -xi[2], xi[1], xi[2], 0, -xi[0], 0, 0, 0).finished();
  }
  [[nodiscard]] static Matrix hat(const Tangent& xi) {
    return (Matrix() << 0, -xi[2], xi[0], xi[2], 0, xi[1], 0, 0, 0).finished();
  }
  [[nodiscard]] static Tangent vee(const Matrix& m) { return {m(0, 2), m(1, 2), (m(1, 0) - m(0, 1)) / 2}; }

  /// ad^3 = -theta^2 ad here as in SO(3), so the same polynomial serves both: I + c2 ad + c3 ad^2.
  [[nodiscard]] static Jacobian left_jacobian(const Tangent& xi) {
    const Stumpff c = stumpff(xi[2] * xi[2]);
    const Jacobian a = ad(xi);
    return Jacobian::Identity() + c.c2 * a + c.c3 * (a * a);
  }
  /// Defined for |yaw| < 2 pi.
  [[nodiscard]] static Jacobian left_jacobian_inverse(const Tangent& xi) {
    const Jacobian a = ad(xi);
    return Jacobian::Identity() - a / 2 + inverse_jacobian_coefficient(xi[2] * xi[2]) * (a * a);
  }
  [[nodiscard]] static Jacobian right_jacobian(const Tangent& xi) { return left_jacobian(-xi); }
  [[nodiscard]] static Jacobian right_jacobian_inverse(const Tangent& xi) {
    return left_jacobian_inverse(-xi);
  }

  /// Same bits.
  friend bool operator==(const SE2&, const SE2&) = default;

 private:
  SO2 rotation_;
  Eigen::Vector2d translation_ = Eigen::Vector2d::Zero();
};

}  // namespace waymark
