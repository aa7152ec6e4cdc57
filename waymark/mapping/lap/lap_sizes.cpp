#include "waymark/mapping/lap/lap_sizes.hpp"

#include <algorithm>
#include <cstddef>
#include <set>
#include <vector>

namespace waymark::internal {
namespace {

/// Observations that contradicted the given size of a tag may agree with another size. Errors are large at
/// first, so the outlier threshold is decreased in steps.
void use_again(const std::vector<std::size_t>& sizes, const SizeSteps& steps, LapBundle& lap) {
  for (CornerTerm& term : lap.bundle.corners) {
    if (term.size && std::ranges::find(sizes, *term.size) != sizes.end()) term.used = true;
  }
  for (const double chi2 : {20000.0, 200.0, steps.robust_chi2}) steps.find(chi2);
}

}  // namespace

ReleasedSizes release_wrong_sizes(LapBundle& lap, double assumed_sigma, const SizeSteps& steps) {
  std::set<std::size_t> tried;
  double noise_before = steps.noise_ratio;
  BundleSummary summary_before = steps.summary;
  const auto suspects = [&] { return contradicted_sizes(observations_by_size(lap.bundle)); };
  const auto adjust = [&](const std::vector<std::size_t>& released) {
    if (!released.empty() && tried.insert(released.back()).second) {
      noise_before = steps.noise_ratio;
      summary_before = steps.summary;
      use_again(released, steps, lap);
    }
    steps.adjust();
  };
  const auto cause = [&](std::size_t size, const Bundle& before) {
    const std::vector<SizeObservations> observations = observations_by_size(lap.bundle);
    if (sizes_that_fit(lap.bundle, corner_chi2(lap.bundle), observations)[size] != 0) return SizeCause::Size;
    lap.bundle = before;
    steps.noise_ratio = noise_before;
    if (!steps.summary.stopped) steps.summary = summary_before;
    return SizeCause::Unknown;
  };
  return release_sizes(lap.bundle, assumed_sigma, {suspects, adjust, cause});
}

}  // namespace waymark::internal
