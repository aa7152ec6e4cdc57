#pragma once

#include <functional>

#include "waymark/mapping/lap/lap_bundle.hpp"
#include "waymark/mapping/solver/tag_sizes.hpp"

/// Printed sizes of the tags in a lap that deviate from their given values.
namespace waymark::internal {

/// Steps of the search for a map, and its corner noise.
struct SizeSteps {
  std::function<void(double robust_chi2)> find{};  ///< minimises the cost with a robust loss
  std::function<void()> adjust{};                  ///< estimates the noise and rejects outliers
  double robust_chi2 = 12;                         ///< that of SearchOptions
  double& noise_ratio;                             ///< estimated by adjust()
  BundleSummary& summary;                          ///< of the last search
};

/// Finds the sizes that the observations contradict and the spread of the others. The scale of a lap depends
/// on the mean of all printed sizes, and not on odometry, whose scale is an unknown. An error that all sizes
/// have in common therefore changes the odometry scale and no size.
[[nodiscard]] ReleasedSizes release_wrong_sizes(LapBundle& lap, double assumed_sigma, const SizeSteps& steps);

}  // namespace waymark::internal
