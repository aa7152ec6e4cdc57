#pragma once

#include "waymark/base/fields.hpp"

namespace waymark {

/// How observations that contradict the others are found, and when a search gives up.
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
                                  "of an observation while outliers are searched.",
                                  1, 1e9});
    visit(self.max_iterations, Field{"max_iterations", "Maximum number of steps of each search.", 1, 10000});
  }
};

}  // namespace waymark
