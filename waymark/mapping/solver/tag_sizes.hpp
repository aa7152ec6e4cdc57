#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "waymark/families/family.hpp"
#include "waymark/mapping/solver/bundle.hpp"

/// Printed sizes that deviate from their given values. In a bundle, each size is an unknown with a narrow
/// prior (BundleSize), so that usual printing errors enter the covariance. A size that was measured wrongly
/// is beyond that prior; it is found here, and released from it.
namespace waymark {

/// The deviation of a printed size from the common size of all tags (Bundle::common_size) according to the
/// observations, without its prior.
struct SizeEstimate {
  std::size_t size = 0;  ///< index into Bundle::sizes
  double log_scale = 0;
  double sigma = 0;       ///< standard deviation of log_scale
  double side_sigma = 0;  ///< of the logarithm of the side, which also contains the common size
};

/// The estimates for all sizes with a prior of their own. Let s^2 be the variance of the prior, and x and v
/// the mean and the variance of the posterior. The mean is then x s^2 / (s^2 - v), and the variance s^2 v /
/// (s^2 - v). Sizes that the observations do not determine at all are omitted.
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

/// What explains the observations that contradict a size.
enum class SizeCause : std::uint8_t { Size, Other, Unknown };

struct SizeSearch {
  /// Sizes of tags with many rejected observations, those with the largest share first. They are tried first,
  /// because the remaining observations of such a tag may fit any size.
  std::function<std::vector<std::size_t>()> suspects{};
  /// Minimises the cost again after the priors of sizes have changed.
  std::function<void()> adjust{};
  /// Releases the last of these sizes by giving it the standard deviation `sigma`, minimises the cost, and
  /// returns what explains the observations of its tag best. If it is not the size, this function has changed
  /// the bundle accordingly. Without it, each size is released, adjusted and kept.
  std::function<SizeCause(const std::vector<std::size_t>& released, double sigma)> cause{};
};

/// Releases the sizes that contradict the observations by more than three standard deviations (3.5 in a map
/// of 24 tags, 3.9 in one of 100), the worst one first. The others get the spread of sizes that the
/// observations suggest as their prior. A bundle without free sizes is not changed. Costs one covariance()
/// and one search per attempt, and one covariance() more.
ReleasedSizes release_sizes(Bundle& bundle, double assumed_sigma, const SizeSearch& search);

/// The number of observations of a tag, by their use.
struct SizeObservations {
  int used = 0;
  int rejected = 0;
  int unconfirmed =
      0;  ///< and not used; with a wrong size, only those at similar distances confirm each other

  [[nodiscard]] int all() const { return used + rejected + unconfirmed; }
  [[nodiscard]] double share_unused() const { return (rejected + unconfirmed) / std::max(1.0, 1.0 * all()); }
  /// Whether so many are not used that the tag itself is the cause.
  [[nodiscard]] bool contradict() const;
};

/// For each size of the bundle. `placed`: whether each pose is placed; only terms whose poses all are count.
/// If it is empty, all terms count.
[[nodiscard]] std::vector<SizeObservations> observations_by_size(const Bundle& bundle,
                                                                 const std::vector<char>& placed = {});

/// Whether these are at most a quarter of the observed tags, or three. If more contradict the map, the tags
/// are not the cause.
[[nodiscard]] bool are_few_tags(std::size_t tags, const std::vector<SizeObservations>& observations);

/// The sizes whose observations contradict them, those with the largest share of unused ones first. Empty
/// unless these are few tags.
[[nodiscard]] std::vector<std::size_t> contradicted_sizes(const std::vector<SizeObservations>& observations);

/// For each size, whether the observations of its tag agree with the map as well as those of other tags. If a
/// tag was moved, or two tags have its number, another size explains only some of its observations. `chi2`:
/// of each corner term; a common factor has no effect.
[[nodiscard]] std::vector<char> sizes_that_fit(const Bundle& bundle, const std::vector<double>& chi2,
                                               const std::vector<SizeObservations>& observations);

/// A tag whose given size contradicts the observations.
struct WrongSize {
  TagId tag{};
  double given_m = 0;
  double found_m = 0, sigma_m = 0;  ///< from the observations
  double deviations = 0;            ///< of the given size, in standard deviations
};

/// The result for a released size. `spread`: standard deviation of printed sizes. Empty if the observations
/// do not determine the size.
[[nodiscard]] std::optional<WrongSize> wrong_size(const TagId& tag, double given_m, std::size_t size,
                                                  const Bundle& bundle,
                                                  const std::vector<SizeEstimate>& estimates, double spread);

}  // namespace waymark
