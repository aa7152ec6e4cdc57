#pragma once

#include <memory>
#include <optional>

#include <Eigen/Core>

#include "waymark/mapping/solver/bundle.hpp"
#include "waymark/mapping/solver/front_cholesky.hpp"

namespace waymark::internal {

/// A factor of normal equations that later ones of the same unknowns are solved with, for as long as they are
/// alike: by conjugate gradients, preconditioned by the factor (Hestenes and Stiefel, "Methods of Conjugate
/// Gradients for Solving Linear Systems", J. Res. NBS 49(6), 1952). From step to step of a search weights and
/// poses change little, and a factorisation may cost as much as a hundred steps of conjugate gradients.
class KeptFactor {
 public:
  /// -(H + damping diag(H))^-1 g, to a thousandth of what the step gains or to `next_to_nothing`; nothing
  /// when that is not positive definite. Factorises anew where the factor that is kept does not lead there
  /// soon.
  [[nodiscard]] std::optional<Eigen::VectorXd> step(const BlockSystem& system, double damping,
                                                    double next_to_nothing = 0);
  /// Gives the memory back.
  void forget() { factor_.reset(); }

 private:
  struct Factor {
    explicit Factor(const BlockSystem& of);
    BlockSystem system;
    FrontPlan plan;
    FrontCholesky cholesky;
  };

  [[nodiscard]] bool fits(const BlockSystem& system) const;

  std::unique_ptr<Factor> factor_{};
};

/// A factorisation costs so much more than a product with the matrix that it pays to keep it.
[[nodiscard]] bool worth_keeping(const FrontPlan& plan, const BlockSystem& system);

}  // namespace waymark::internal

namespace waymark {

/// As solve(), for one of several searches over the same poses.
BundleSummary solve(Bundle& bundle, const BundleOptions& options, const BundleProgress& progress,
                    internal::KeptFactor& kept);

}  // namespace waymark
