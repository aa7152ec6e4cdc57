#pragma once

#include <concepts>

#include <Eigen/Core>

namespace waymark {

/// What every group here offers: SO2, SE2, SO3, SE3, SE23. One interface, so that one filter or one test
/// serves all.
template <class G>
concept LieGroup = requires(const G& X, const typename G::Tangent& xi) {
  { G::kDof } -> std::convertible_to<int>;
  { G::identity() } -> std::same_as<G>;
  { G::exp(xi) } -> std::same_as<G>;
  { X.log() } -> std::same_as<typename G::Tangent>;
  { X.inverse() } -> std::same_as<G>;
  { X* X } -> std::same_as<G>;
  { X.adjoint() } -> std::same_as<typename G::Jacobian>;
  { G::left_jacobian(xi) } -> std::same_as<typename G::Jacobian>;
  { G::left_jacobian_inverse(xi) } -> std::same_as<typename G::Jacobian>;
  { X.matrix() } -> std::same_as<typename G::Matrix>;
};

/// exp(xi) X: the correction xi, written in the parent frame, applied on the left.
template <LieGroup G>
[[nodiscard]] G plus(const typename G::Tangent& xi, const G& X) {
  return G::exp(xi) * X;
}

/// log(X Y^-1): the correction, in the parent frame, that takes Y to X; plus(minus(X, Y), Y) = X.
template <LieGroup G>
[[nodiscard]] typename G::Tangent minus(const G& X, const G& Y) {
  return (X * Y.inverse()).log();
}

/// The geodesic exp(s log(Y X^-1)) X from X (s = 0) to Y (s = 1), at constant velocity in the parent frame; s
/// outside [0, 1] goes on beyond the ends. exp(s log(Y X^-1)) X = X exp(s log(X^-1 Y)), so the choice of
/// frame does not change the path.
template <LieGroup G>
[[nodiscard]] G interpolate(const G& X, const G& Y, double s) {
  return plus(typename G::Tangent(s * minus(Y, X)), X);
}

}  // namespace waymark
