#pragma once

#include <array>
#include <optional>
#include <vector>

#include <Eigen/Core>

namespace waymark {

/// The coefficients of a real polynomial in ascending order: c[0] + c[1] x + c[2] x^2 + ...
using Polynomial = std::vector<double>;

[[nodiscard]] double evaluate(const Polynomial& p, double x);
[[nodiscard]] Polynomial derivative(const Polynomial& p);
[[nodiscard]] Polynomial operator+(const Polynomial& a, const Polynomial& b);
[[nodiscard]] Polynomial operator-(const Polynomial& a, const Polynomial& b);
[[nodiscard]] Polynomial operator*(const Polynomial& a, const Polynomial& b);
[[nodiscard]] Polynomial operator*(double factor, const Polynomial& p);

/// The end of the interval, within (0, high], in which a polynomial that is positive at 0 remains positive.
/// The polynomial is positive there, but not at the next double. Returns `nullopt` if it remains positive
/// throughout. Between two neighbouring zeros of its derivative, a polynomial is monotonic, so bisection
/// there cannot miss a crossing. O(degree^2) bisections.
[[nodiscard]] std::optional<double> last_positive_before_root(const Polynomial& p, double high);

/// The radial-tangential map of normalised image coordinates, with k1 k2 p1 p2 k3 k4 k5 k6 in OpenCV's order
/// (Brown, "Decentering distortion of lenses", 1966; OpenCV, "Camera Calibration and 3D Reconstruction"):
///
///     x_d = x g(r^2) + 2 p1 x y + p2 (r^2 + 2 x^2)
///     y_d = y g(r^2) + p1 (r^2 + 2 y^2) + 2 p2 x y
///     g(s) = (1 + k1 s + k2 s^2 + k3 s^3) / (1 + k4 s + k5 s^2 + k6 s^3)
///
/// It is the gradient of a potential, so its Jacobian is symmetric.
struct Radtan {
  std::array<double, 8> k{};

  [[nodiscard]] bool is_identity() const;
  /// The distorted coordinates for undistorted ones. If J is not null, it receives the symmetric 2x2
  /// Jacobian.
  [[nodiscard]] Eigen::Vector2d distort(const Eigen::Vector2d& undistorted,
                                        Eigen::Matrix2d* J = nullptr) const;
  /// The inverse inside the disk of radius `limit`; `nullopt` if no point in the disk is mapped there. Uses
  /// bracketed Newton iteration for the radius, then Newton's method in the plane for the tangential part.
  [[nodiscard]] std::optional<Eigen::Vector2d> undistort(const Eigen::Vector2d& distorted,
                                                         double limit) const;
  /// Radius of the largest disk about the axis in which the map is provably one-to-one: infinite without
  /// distortion, otherwise at most kLargestRadius.
  ///
  /// The Jacobian of the radial part has the eigenvalues A = d(r g)/dr and B = g; those of the tangential
  /// part lie within +-6 r |p|. While min(A, B) > 6 r |p| and the denominator is positive, the Jacobian is
  /// positive definite. A gradient map with a positive definite Jacobian on a convex set is one-to-one. The
  /// disk also ends where A exceeds kLargestStretch, because rounding errors become too large near a pole of
  /// g.
  [[nodiscard]] double domain() const;
  /// Smallest distorted radius, over all directions, of the edge of the disk of radius `limit`.
  [[nodiscard]] double distorted_radius(double limit) const;

  static constexpr double kLargestRadius = 1e3;   ///< corresponds to 89.94 degrees off the axis
  static constexpr double kLargestStretch = 100;  ///< limit for A beyond any lens; exceeded near a pole of g

  friend bool operator==(const Radtan&, const Radtan&) = default;
};

/// The equidistant map of the angle from the optical axis (Kannala and Brandt, "A generic camera model and
/// calibration method for conventional, wide-angle, and fish-eye lenses", PAMI 2006, the radially symmetric
/// model): theta_d = theta (1 + k1 theta^2 + k2 theta^4 + k3 theta^6 + k4 theta^8).
struct EquidistantAngle {
  std::array<double, 4> k{};

  /// theta_d; if `slope` is not null, it receives the derivative.
  [[nodiscard]] double distort(double theta, double* slope = nullptr) const;
  /// The angle in [0, limit] that is mapped to theta_d; `nullopt` if there is none.
  [[nodiscard]] std::optional<double> undistort(double theta_d, double limit) const;
  /// The largest angle, at most pi, up to which theta_d is strictly increasing.
  [[nodiscard]] double domain() const;
};

}  // namespace waymark
