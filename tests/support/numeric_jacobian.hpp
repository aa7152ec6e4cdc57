#pragma once

#include <Eigen/Core>

namespace waymark::testing {

/// Derivative at 0 of f: double -> vector (or scalar), by the 5-point rule with one Richardson refinement:
/// error O(h^6). With values of order 1 and h = 1e-2 the result is accurate to some 1e-12 for functions of
/// scale 1.
template <class F>
[[nodiscard]] auto numeric_derivative(const F& f, double h = 1e-2) {
  const auto five_point = [&](double step) {
    return ((8.0 * (f(step) - f(-step)) - (f(2 * step) - f(-2 * step))) / (12.0 * step)).eval();
  };
  return ((16.0 * five_point(h / 2) - five_point(h)) / 15.0).eval();
}

/// J_out_in of f at x: a callback from Matrix<double, N, 1> to Matrix<double, M, 1>. M x N. Coordinates are
/// perturbed by addition; scale h to the size over which f is smooth.
///
///     const auto J_px_p = numeric_jacobian<2, 3>([&](const Eigen::Vector3d& p) { return *camera.project(p);
///     }, cam_p);
///
/// A group-valued argument or result goes through its tangent, with the perturbation on the left:
///
///     numeric_jacobian<2, 6>([&](const SE3::Tangent& xi) { return project(plus(xi, a_T_b)); },
///     SE3::Tangent::Zero()); numeric_jacobian<6, 6>([&](const SE3::Tangent& xi) { return minus(f(plus(xi,
///     X)), f(X)); }, SE3::Tangent::Zero());
template <int M, int N, class F>
[[nodiscard]] Eigen::Matrix<double, M, N> numeric_jacobian(const F& f, const Eigen::Matrix<double, N, 1>& x,
                                                           double h = 1e-2) {
  Eigen::Matrix<double, M, N> J_out_in;
  for (int i = 0; i < N; ++i) {
    const auto along = [&](double step) {
      Eigen::Matrix<double, N, 1> moved = x;
      moved[i] += step;
      return Eigen::Matrix<double, M, 1>(f(moved));
    };
    J_out_in.col(i) = numeric_derivative(along, h);
  }
  return J_out_in;
}

}  // namespace waymark::testing
