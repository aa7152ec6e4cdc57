#pragma once

#include <Eigen/Core>

#include "waymark/geometry/lie.hpp"
#include "waymark/geometry/se2.hpp"
#include "waymark/geometry/se3.hpp"

namespace waymark {

/// Covariance in the tangent of G: translation first, then rotation, in the parent frame [m, rad, and their
/// products].
template <LieGroup G>
using Covariance = typename G::Jacobian;

/// a_X_b with its uncertainty: X = exp(xi) mean, xi ~ N(0, covariance), where xi is in the parent frame a
/// (Barfoot and Furgale, "Associating Uncertainty with Three-Dimensional Poses for Use in Estimation
/// Problems", IEEE T-RO 30(3), 2014; Barfoot, "State Estimation for Robotics", section 7.3). This is not the
/// covariance of the coordinates: see coordinate_covariance.
template <LieGroup G>
struct Uncertain {
  G mean;
  Covariance<G> covariance = Covariance<G>::Zero();
};

namespace internal {

/// Makes a matrix symmetric to the last bit regardless of earlier rounding, because filters propagate
/// covariances for hours.
template <int N>
[[nodiscard]] inline Eigen::Matrix<double, N, N> symmetrized(const Eigen::Matrix<double, N, N>& P) {
  return (P + P.transpose()) / 2;
}

/// J P J^T.
template <int N>
[[nodiscard]] inline Eigen::Matrix<double, N, N> propagate(const Eigen::Matrix<double, N, N>& J,
                                                           const Eigen::Matrix<double, N, N>& P) {
  return symmetrized<N>(J * P * J.transpose());
}

/// d(coordinates) / d(xi) for the translations t1 … of the group. Rotating everything by phi displaces each
/// translation t by phi x t. sign = -1 results in the inverse.
[[nodiscard]] SE2::Jacobian coordinate_jacobian(const SE2& X, double sign);
[[nodiscard]] SE3::Jacobian coordinate_jacobian(const SE3& X, double sign);
[[nodiscard]] SE23::Jacobian coordinate_jacobian(const SE23& X, double sign);
template <LieGroup G>  // SO2 and SO3 have no translation
[[nodiscard]] inline typename G::Jacobian coordinate_jacobian(const G&, double) {
  return G::Jacobian::Identity();
}

}  // namespace internal

/// a_X_c from a_X_b and b_X_c with independent errors, to first order (equation (23)). The fourth-order terms
/// that Barfoot and Furgale add are omitted.
template <LieGroup G>
[[nodiscard]] inline Uncertain<G> compose(const Uncertain<G>& a_X_b, const Uncertain<G>& b_X_c) {
  const Covariance<G> J_ac_bc = a_X_b.mean.adjoint();
  return {a_X_b.mean * b_X_c.mean, internal::symmetrized<G::kDof>(
                                       a_X_b.covariance + J_ac_bc * b_X_c.covariance * J_ac_bc.transpose())};
}

/// b_X_a from a_X_b (equation (24)), with the covariance expressed in frame b. Exact: (exp(xi) X)^-1 =
/// exp(-Ad(X^-1) xi) X^-1.
template <LieGroup G>
[[nodiscard]] inline Uncertain<G> inverse(const Uncertain<G>& a_X_b) {
  const G b_X_a = a_X_b.mean.inverse();
  return {b_X_a, internal::propagate<G::kDof>(b_X_a.adjoint(), a_X_b.covariance)};
}

/// b_X_c from a_X_b and a_X_c (equation (25)), to first order. `cross` is the covariance between their
/// errors, E[xi_ab xi_ac^T]; omit it if the errors are independent. The errors of two poses on the same
/// trajectory are correlated, so without `cross` the result is far too large.
template <LieGroup G>
[[nodiscard]] inline Uncertain<G> between(const Uncertain<G>& a_X_b, const Uncertain<G>& a_X_c,
                                          const Covariance<G>& cross = Covariance<G>::Zero()) {
  const G b_X_a = a_X_b.mean.inverse();
  const Covariance<G> difference = a_X_b.covariance + a_X_c.covariance - cross - cross.transpose();
  return {b_X_a * a_X_c.mean, internal::propagate<G::kDof>(b_X_a.adjoint(), difference)};
}

/// The covariance in ordinary coordinates (equation (26)), to first order. The coordinates are those of b
/// along the axes of a (position, and velocity for SE23), and the rotation about the axes of a. Their number
/// and order are those of the tangent. In ROS, this is a PoseWithCovariance.
template <LieGroup G>
[[nodiscard]] inline Covariance<G> coordinate_covariance(const Uncertain<G>& a_X_b) {
  return internal::propagate<G::kDof>(internal::coordinate_jacobian(a_X_b.mean, 1.0), a_X_b.covariance);
}

/// The inverse of coordinate_covariance, for covariances given in ordinary coordinates.
template <LieGroup G>
[[nodiscard]] inline Uncertain<G> from_coordinate_covariance(const G& a_X_b,
                                                             const Covariance<G>& covariance) {
  return {a_X_b, internal::propagate<G::kDof>(internal::coordinate_jacobian(a_X_b, -1.0), covariance)};
}

/// Standard deviations of the coordinates, for display: in metres (and m/s) along the axes of the parent
/// frame, then in radians about them.
template <LieGroup G>
[[nodiscard]] inline typename G::Tangent coordinate_deviations(const Uncertain<G>& a_X_b) {
  return coordinate_covariance(a_X_b).diagonal().cwiseMax(0.0).cwiseSqrt();
}

}  // namespace waymark
