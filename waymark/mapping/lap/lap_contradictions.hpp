#pragma once

#include <functional>

#include "waymark/mapping/lap/lap_bundle.hpp"
#include "waymark/mapping/solver/tag_sizes.hpp"

/// Tags in a lap whose observations contradict the map: their printed size deviates from the given one, or
/// they were moved during the lap.
namespace waymark::internal {

/// Steps of the search for a map, and its state beside the bundle.
struct LapSearchSteps {
  std::function<void(double robust_chi2)> find{};  ///< minimises the cost with a robust loss
  std::function<void()> adjust{};                  ///< estimates the noise and rejects outliers
  std::function<void()> gate{};                    ///< rejects outliers at the present poses and noise
  double robust_chi2 = 12;                         ///< that of SearchOptions
  double outlier_chi2 = 26.1;                      ///< of corner_chi2() beyond which gate() rejects
  double& noise_ratio;                             ///< estimated by adjust()
  BundleSummary& summary;                          ///< of the last search
};

/// Finds the sizes that the observations contradict and the spread of the others, and the tags that were
/// moved (LapBundle::moves). The scale of a lap depends on the mean of all printed sizes, and not on
/// odometry, whose scale is an unknown. An error that all sizes have in common therefore changes the odometry
/// scale and no size. `assumed_sigma`: standard deviation of sizes; if it is 0, sizes are exact, and only
/// moved tags are found.
[[nodiscard]] ReleasedSizes explain_contradictions(const LapInput& input, LapBundle& lap,
                                                   double assumed_sigma, const LapSearchSteps& steps);

/// Undoes all moves: each moved tag has one pose again.
void join_moved_tags(LapBundle& lap);

/// Whether explain_contradictions() would try anything for exact sizes.
[[nodiscard]] bool has_contradictions(const LapInput& input, const LapBundle& lap);

/// The tags of `map` that were moved, according to the poses in the bundle.
[[nodiscard]] std::vector<MovedTag> moved_tags(const LapInput& input, const LapBundle& lap,
                                               const TagMap& map);

}  // namespace waymark::internal
