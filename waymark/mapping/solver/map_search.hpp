#pragma once

#include <functional>
#include <string>

#include "waymark/base/error.hpp"
#include "waymark/base/fields.hpp"
#include "waymark/base/time.hpp"
#include "waymark/families/family.hpp"

namespace waymark {

/// Limits of a mapping search: outlier rejection and the number of steps.
struct SearchOptions {
  double outlier_chi2 = 26.1;
  double robust_chi2 = 12;
  int max_iterations = 100;

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
  }
};

/// Called with the stage, the iteration and the cost before each iteration of a mapping search. Returning
/// false ends the search with an error.
using MapProgress = std::function<bool(const std::string& stage, int iteration, double cost)>;

/// An observation of a mapped tag that is inconsistent with all others.
struct RejectedObservation {
  SensorTime stamp{};
  TagId tag{};
  double chi2 = 0;  ///< with 8 degrees of freedom; infinite if the tag is not visible from the estimated pose
};

}  // namespace waymark

namespace waymark::internal {

/// The error returned by a search that was stopped by its progress callback.
inline tl::unexpected<Error> stopped_on_request() {
  return fail(ErrorCode::LimitExceeded, "stopped before the map was finished");
}

}  // namespace waymark::internal
