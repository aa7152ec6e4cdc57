#pragma once

#include "waymark/base/fields.hpp"

namespace waymark {

/// How sightings that contradict the others are found, and when a search gives up.
struct SearchOptions {
  double outlier_chi2 = 26.1;
  double robust_chi2 = 12;
  int max_iterations = 100;

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.outlier_chi2, Field{"outlier_chi2",
                                   "A sighting whose squared error over its variance (8 numbers) exceeds "
                                   "this is left out (0.999 quantile).",
                                   8, 1e9});
    visit(
        self.robust_chi2,
        Field{"robust_chi2",
              "From this squared error on a sighting's say shrinks while outliers are looked for.", 1, 1e9});
    visit(self.max_iterations,
          Field{"max_iterations", "Steps of each search after which to give up.", 1, 10000});
  }
};

}  // namespace waymark
