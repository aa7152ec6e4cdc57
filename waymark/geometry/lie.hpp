#pragma once

#include <concepts>

#include <Eigen/Core>

namespace waymark {

/// The interface shared by all groups: SO2, SE2, SO3, SE3 and SE23. A filter or a test can be written once
/// for all of them.
template <class G>
concept LieGroup = requires(const G& X, const typename G::Tangent& xi) {
  { G::kDof } -> std::convertible_to<int>;
  { G::kRotationDof } -> std::convertible_to<int>;
  { G::identity() } -> std::same_as<G>;
  { G::exp(xi) } -> std::same_as<G>;
  { X.log() } -> std::same_as<typename G::Tangent>;
  { X.inverse() } -> std::same_as<G>;
  { X* X } -> std::same_as<G>;
  { X.adjoint() } -> std::same_as<typename G::Jacobian>;
  { G::ad(xi) } -> std::same_as<typename G::Jacobian>;
  { G::left_jacobian(xi) } -> std::same_as<typename G::Jacobian>;
  { G::left_jacobian_inverse(xi) } -> std::same_as<typename G::Jacobian>;
  { G::right_jacobian(xi) } -> std::same_as<typename G::Jacobian>;
  { G::right_jacobian_inverse(xi) } -> std::same_as<typename G::Jacobian>;
  { G::hat(xi) } -> std::same_as<typename G::Matrix>;
  { G::vee(X.matrix()) } -> std::same_as<typename G::Tangent>;
};

// The Jacobians below are for perturbations on the left of group-valued arguments and results, X = exp(xi)
// X_hat. Each tangent is expressed in the parent frame of its transform (docs/concepts/geometry.md, equations
// (20) to (22)). Pass nullptr for Jacobians that are not needed.

/// exp(xi) X: applies the correction xi, expressed in the parent frame, on the left.
template <LieGroup G>
[[nodiscard]] inline G plus(const typename G::Tangent& xi, const G& X) {
  return G::exp(xi) * X;
}

/// xi = log(X Y^-1): the correction, expressed in the parent frame, that takes Y to X. Hence plus(minus(X,
/// Y), Y) = X.
template <LieGroup G>
[[nodiscard]] inline typename G::Tangent minus(const G& X, const G& Y, typename G::Jacobian* J_xi_X = nullptr,
                                               typename G::Jacobian* J_xi_Y = nullptr) {
  const typename G::Tangent xi = (X * Y.inverse()).log();
  if (J_xi_X != nullptr) *J_xi_X = G::left_jacobian_inverse(xi);
  if (J_xi_Y != nullptr) *J_xi_Y = -G::right_jacobian_inverse(xi);
  return xi;
}

/// b_X_a from a_X_b.
template <LieGroup G>
[[nodiscard]] inline G inverse(const G& X, typename G::Jacobian* J_inverse_X = nullptr) {
  const G inverse_X = X.inverse();
  if (J_inverse_X != nullptr) *J_inverse_X = -inverse_X.adjoint();
  return inverse_X;
}

/// Z = X Y: a_X_c from a_X_b and b_X_c.
template <LieGroup G>
[[nodiscard]] inline G compose(const G& X, const G& Y, typename G::Jacobian* J_Z_X,
                               typename G::Jacobian* J_Z_Y = nullptr) {
  if (J_Z_X != nullptr) *J_Z_X = G::Jacobian::Identity();
  if (J_Z_Y != nullptr) *J_Z_Y = X.adjoint();
  return X * Y;
}

/// Z = X^-1 Y: b_X_c from a_X_b and a_X_c.
template <LieGroup G>
[[nodiscard]] inline G between(const G& X, const G& Y, typename G::Jacobian* J_Z_X = nullptr,
                               typename G::Jacobian* J_Z_Y = nullptr) {
  const G inverse_X = X.inverse();
  if (J_Z_X != nullptr) *J_Z_X = -inverse_X.adjoint();
  if (J_Z_Y != nullptr) *J_Z_Y = inverse_X.adjoint();
  return inverse_X * Y;
}

/// Z = exp(s log(Y X^-1)) X: the geodesic from X (s = 0) to Y (s = 1) at constant velocity in the parent
/// frame. If s is outside [0, 1], the result is extrapolated. X exp(s log(X^-1 Y)) is the same path, so the
/// choice of frame does not matter. Between rotations that are exactly pi apart, SO3::log determines the
/// direction.
template <LieGroup G>
[[nodiscard]] inline G interpolate(const G& X, const G& Y, double s, typename G::Jacobian* J_Z_X = nullptr,
                                   typename G::Jacobian* J_Z_Y = nullptr) {
  const typename G::Tangent xi = minus(Y, X);
  const typename G::Tangent part = s * xi;
  const G step = G::exp(part);
  if (J_Z_X != nullptr) *J_Z_X = step.adjoint() - s * G::left_jacobian(part) * G::right_jacobian_inverse(xi);
  if (J_Z_Y != nullptr) *J_Z_Y = s * G::left_jacobian(part) * G::left_jacobian_inverse(xi);
  return step * X;
}

}  // namespace waymark
