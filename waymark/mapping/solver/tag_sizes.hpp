#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "waymark/mapping/solver/bundle.hpp"

/// Printed sizes that deviate from their given values. In a bundle, each size is an unknown with a narrow
/// prior (BundleSize), so that usual printing errors enter the covariance. A size that was measured wrongly
/// is beyond that prior; it is found here, and released from it.
namespace waymark {

/// The size of a tag according to the observations alone, without its prior.
struct SizeEstimate {
  std::size_t size = 0;  ///< index into Bundle::sizes
  double log_scale = 0;
  double sigma = 0;  ///< standard deviation of log_scale
};

/// The estimates for all sizes with a prior. Let s^2 be the variance of the prior, and x and v the mean and
/// the variance of the posterior. The mean is then x s^2 / (s^2 - v), and the variance s^2 v / (s^2 - v).
/// Sizes that the observations do not determine at all are omitted.
[[nodiscard]] std::vector<SizeEstimate> size_estimates(const Bundle& bundle,
                                                       const BundleCovariance& covariance);

/// The standard deviation of printed sizes that explains the estimates best: the mode of the marginal
/// likelihood. Its prior is a scaled inverse chi-square distribution of the variance, worth `kTags` tags with
/// the assumed standard deviation (Gelman, "Prior distributions for variance parameters in hierarchical
/// models", Bayesian Analysis 1(3), 2006, section 2).
[[nodiscard]] double size_spread(const std::vector<SizeEstimate>& estimates, double assumed_sigma);

struct ReleasedSizes {
  std::vector<std::size_t> released{};  ///< indices into Bundle::sizes, in the order of their release
  double spread = 0;                    ///< standard deviation of the other sizes
};

struct SizeSearch {
  /// Sizes of tags with many rejected observations, those with the largest share first. They are tried first,
  /// because the remaining observations of such a tag may fit any size.
  std::function<std::vector<std::size_t>()> suspects{};
  /// Minimises the cost again after the priors of these sizes, or of all, have changed.
  std::function<void(const std::vector<std::size_t>& released)> adjust{};
  /// Whether something else explains the observations of a tag better than its released size. It may change
  /// the bundle, whose state before the release is given; otherwise the release is kept.
  std::function<bool(std::size_t size, const Bundle& before)> other_cause{};
};

/// Releases the sizes that contradict the observations by more than three standard deviations (3.5 in a map
/// of 24 tags, 3.9 in one of 100), the worst one first. The others get the spread of sizes that the
/// observations suggest as their prior. A bundle without free sizes is not changed. Costs one covariance()
/// and one search per attempt, and one covariance() more.
ReleasedSizes release_sizes(Bundle& bundle, double assumed_sigma, const SizeSearch& search);

}  // namespace waymark
