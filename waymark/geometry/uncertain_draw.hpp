#pragma once

#include <Eigen/Eigenvalues>

#include "waymark/base/random.hpp"
#include "waymark/geometry/uncertainty.hpp"

namespace waymark {

/// One draw of X = exp(xi) mean. The covariance may be singular; what of it is negative by rounding counts as
/// zero.
template <LieGroup G>
[[nodiscard]] inline G sample(const Uncertain<G>& a_X_b, Random& random) {
  const Eigen::SelfAdjointEigenSolver<Covariance<G>> solver(a_X_b.covariance);
  typename G::Tangent white;
  for (int i = 0; i < G::kDof; ++i) white[i] = random.normal();
  const typename G::Tangent deviations = solver.eigenvalues().cwiseMax(0.0).cwiseSqrt();
  return plus(typename G::Tangent(solver.eigenvectors() * deviations.cwiseProduct(white)), a_X_b.mean);
}

}  // namespace waymark
