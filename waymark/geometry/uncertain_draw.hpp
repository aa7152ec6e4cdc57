#pragma once

#include "waymark/base/random.hpp"
#include "waymark/geometry/dense.hpp"
#include "waymark/geometry/uncertainty.hpp"

namespace waymark {

/// Draws a random X = exp(xi) mean. The covariance may be singular; eigenvalues that are negative due to
/// rounding count as zero.
template <LieGroup G>
[[nodiscard]] inline G sample(const Uncertain<G>& a_X_b, Random& random) {
  const SymmetricEigen<G::kDof> axes = symmetric_eigen<G::kDof>(a_X_b.covariance);
  typename G::Tangent white;
  for (int i = 0; i < G::kDof; ++i) white[i] = random.normal();
  const typename G::Tangent deviations = axes.values.cwiseMax(0.0).cwiseSqrt();
  return plus(typename G::Tangent(axes.vectors * deviations.cwiseProduct(white)), a_X_b.mean);
}

}  // namespace waymark
