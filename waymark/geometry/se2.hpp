#pragma once

#include <cassert>
#include <cmath>

#include <Eigen/Core>

namespace waymark {

/// A rotation in the plane, a_R_b, stored as a unit complex number (cos, sin), so that angles never need to
/// be wrapped. Tangent: the angle [rad], counter-clockwise. Drift is bounded as in SO3.
class SO2 {
 public:
  static constexpr int kDof = 1;
  static constexpr int kRotationDof = 1;  ///< number of rotation components, which come last in a tangent
  static constexpr int kMatrixSize = 2;
  static constexpr int kPointSize = 2;
  using Tangent = Eigen::Matrix<double, 1, 1>;
  using Jacobian = Eigen::Matrix<double, 1, 1>;
  using Matrix = Eigen::Matrix2d;
  using Point = Eigen::Vector2d;

  SO2() = default;
  /// A counter-clockwise rotation by `angle` [rad].
  explicit SO2(double angle) : cos_(std::cos(angle)), sin_(std::sin(angle)) { assert(std::isfinite(angle)); }

  /// From a direction (cosine, sine) of any non-zero length, e.g. a vector along the x axis of b, expressed
  /// in a.
  [[nodiscard]] static SO2 from_cos_sin(double cosine, double sine) {
    const double length = std::hypot(cosine, sine);
    assert(std::isfinite(length) && length > 0);
    return {cosine / length, sine / length};
  }

  [[nodiscard]] static SO2 identity() { return {}; }
  [[nodiscard]] static SO2 exp(const Tangent& xi) { return SO2(xi[0]); }
  [[nodiscard]] Tangent log() const { return Tangent(angle()); }
  /// The angle in (-pi, pi] [rad].
  [[nodiscard]] double angle() const {
    return std::atan2(sin_ + 0.0, cos_);  // + 0.0 prevents a sine of -0 from becoming an angle of -pi
  }

  [[nodiscard]] SO2 inverse() const { return {cos_, -sin_}; }
  [[nodiscard]] SO2 operator*(const SO2& b_R_c) const {
    return renormalized(cos_ * b_R_c.cos_ - sin_ * b_R_c.sin_, sin_ * b_R_c.cos_ + cos_ * b_R_c.sin_);
  }
  [[nodiscard]] Point operator*(const Point& b_p) const {
    return {cos_ * b_p.x() - sin_ * b_p.y(), sin_ * b_p.x() + cos_ * b_p.y()};
  }
  /// a_p = a_R_b b_p with its Jacobians: J_p_R (2x1) for a left perturbation of the rotation and J_p_p (2x2)
  /// for the point.
  [[nodiscard]] Point act(const Point& b_p, Eigen::Matrix<double, 2, 1>* J_p_R,
                          Matrix* J_p_p = nullptr) const;

  [[nodiscard]] Matrix matrix() const;
  [[nodiscard]] Jacobian adjoint() const { return Jacobian::Identity(); }
  [[nodiscard]] static Jacobian ad(const Tangent&) { return Jacobian::Zero(); }
  [[nodiscard]] static Matrix hat(const Tangent& xi);
  [[nodiscard]] static Tangent vee(const Matrix& m) { return Tangent((m(1, 0) - m(0, 1)) / 2); }

  [[nodiscard]] static Jacobian left_jacobian(const Tangent&) { return Jacobian::Identity(); }
  [[nodiscard]] static Jacobian left_jacobian_inverse(const Tangent&) { return Jacobian::Identity(); }
  [[nodiscard]] static Jacobian right_jacobian(const Tangent&) { return Jacobian::Identity(); }
  [[nodiscard]] static Jacobian right_jacobian_inverse(const Tangent&) { return Jacobian::Identity(); }

  /// Compares bit by bit.
  friend bool operator==(const SO2&, const SO2&) = default;

 private:
  SO2(double cosine, double sine) : cos_(cosine), sin_(sine) {}
  /// One Newton step towards unit length, which squares the rounding error. See SO3.
  [[nodiscard]] static SO2 renormalized(double cosine, double sine) {
    const double scale = (3.0 - (cosine * cosine + sine * sine)) / 2;
    return {cosine * scale, sine * scale};
  }

  double cos_ = 1.0;
  double sin_ = 0.0;
};

/// A rigid motion in the plane, a_T_b = (a_R_b, a_t_b). Tangent: (x, y, yaw) [m, m, rad], in the parent frame
/// a.
class SE2 {
 public:
  static constexpr int kDof = 3;
  static constexpr int kRotationDof = 1;  ///< number of rotation components, which come last in a tangent
  static constexpr int kMatrixSize = 3;
  static constexpr int kPointSize = 2;
  using Tangent = Eigen::Vector3d;
  using Jacobian = Eigen::Matrix3d;
  using Matrix = Eigen::Matrix3d;
  using Point = Eigen::Vector2d;

  SE2() = default;
  SE2(const SO2& a_R_b, const Eigen::Vector2d& a_t_b) : rotation_(a_R_b), translation_(a_t_b) {}
  /// x and y in [m], yaw in [rad].
  SE2(double x, double y, double yaw) : rotation_(yaw), translation_(x, y) {}

  [[nodiscard]] const SO2& rotation() const { return rotation_; }
  [[nodiscard]] const Eigen::Vector2d& translation() const { return translation_; }
  [[nodiscard]] double x() const { return translation_.x(); }
  [[nodiscard]] double y() const { return translation_.y(); }
  /// The yaw in (-pi, pi] [rad].
  [[nodiscard]] double yaw() const { return rotation_.angle(); }

  [[nodiscard]] static SE2 identity() { return {}; }
  [[nodiscard]] static SE2 exp(const Tangent& xi);
  /// The yaw of the result is in (-pi, pi].
  [[nodiscard]] Tangent log() const;

  [[nodiscard]] SE2 inverse() const {
    const SO2 b_R_a = rotation_.inverse();
    return {b_R_a, -(b_R_a * translation_)};
  }
  [[nodiscard]] SE2 operator*(const SE2& b_T_c) const {
    return {rotation_ * b_T_c.rotation_, rotation_ * b_T_c.translation_ + translation_};
  }
  [[nodiscard]] Point operator*(const Point& b_p) const { return rotation_ * b_p + translation_; }
  /// a_p = a_T_b b_p with its Jacobians: J_p_T (2x3) for a left perturbation of a_T_b and J_p_p (2x2) for the
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

  /// As in SO(3), ad^3 = -theta^2 ad, so the same polynomial applies: I + c2 ad + c3 ad^2.
  [[nodiscard]] static Jacobian left_jacobian(const Tangent& xi);
  /// Defined for |yaw| < 2 pi.
  [[nodiscard]] static Jacobian left_jacobian_inverse(const Tangent& xi);
  [[nodiscard]] static Jacobian right_jacobian(const Tangent& xi);
  [[nodiscard]] static Jacobian right_jacobian_inverse(const Tangent& xi);

  /// Compares bit by bit.
  friend bool operator==(const SE2&, const SE2&) = default;

 private:
  SO2 rotation_;
  Eigen::Vector2d translation_ = Eigen::Vector2d::Zero();
};

}  // namespace waymark
