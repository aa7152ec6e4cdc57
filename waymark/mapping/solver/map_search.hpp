#pragma once

#include <functional>
#include <optional>
#include <string>

#include "waymark/base/error.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/base/time.hpp"
#include "waymark/families/family.hpp"

namespace waymark {

/// Limits of a mapping search: outlier rejection, the number of steps, and the accuracy of printed sizes.
struct SearchOptions {
  double outlier_chi2 = 26.1;
  double robust_chi2 = 12;
  int max_iterations = 100;
  /// Standard deviation of the printed size of each tag, relative to its given size. If 0, sizes are exact.
  double tag_size_sigma_percent = 0.3;
  /// Standard deviation of the error that all printed sizes share, relative to the given sizes. If 0, there
  /// is no such error; the default depends on the kind of map.
  std::optional<double> common_tag_size_sigma_percent{};

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.outlier_chi2, Field{"outlier_chi2",
                                   "Squared normalised error of a tag observation (8 numbers) above which it "
                                   "is rejected; the default is the 0.999 quantile.",
                                   8, 1e9});
    visit(self.robust_chi2, Field{"robust_chi2",
                                  "Squared normalised error above which the robust loss reduces the weight "
                                  "of an observation during the search for outliers.",
                                  1, 1e9});
    visit(self.max_iterations, Field{"max_iterations", "Maximum number of steps of each search.", 1, 10000});
    visit(
        self.tag_size_sigma_percent,
        Field{
            "tag_size_sigma_percent",
            "Standard deviation of the printed size of each tag, in percent of the given size. 0: sizes are "
            "exact. Half a millimetre of 16 cm is 0.3 %. Sizes that the observations contradict by more than "
            "three standard deviations are estimated and reported.",
            0, 20});
    visit(
        self.common_tag_size_sigma_percent,
        Field{
            "common_tag_size_sigma_percent",
            "Standard deviation of the error that all printed sizes share, as when a printer scales every "
            "page, in percent of the given sizes. 0: no such error. Default: 0.5 mm in maps of videos, 0.5 % "
            "in scenes with distances, otherwise 0.",
            0, 20});
  }
};

/// Called with the stage, the iteration and the cost before each iteration of a mapping search. Returning
/// false ends the search with an error.
using MapProgress = std::function<bool(const std::string& stage, int iteration, double cost)>;

/// An observation of a mapped tag that is inconsistent with all others.
struct RejectedObservation {
  SensorTime stamp{};
  TagId tag{};
  /// With 8 degrees of freedom. Infinite if the tag is not visible from the estimated pose, or if the
  /// observation was excluded before the search.
  double chi2 = 0;
};

}  // namespace waymark

namespace waymark::internal {

/// The error returned by a search that was stopped by its progress callback.
inline tl::unexpected<Error> stopped_on_request() {
  return fail(ErrorCode::LimitExceeded, "stopped before the map was finished");
}

}  // namespace waymark::internal
