#pragma once

#include <cstddef>
#include <vector>

namespace waymark {

/// What a list of errors amounts to, in their unit. All 0 when there is none.
struct ErrorStatistics {
  std::size_t count = 0;
  double rmse = 0;
  double mean = 0;
  double median = 0;
  double p95 = 0;  ///< 95 of 100 are no larger
  double max = 0;
};

/// Of the absolute values. O(n log n).
[[nodiscard]] ErrorStatistics statistics_of(std::vector<double> errors);

}  // namespace waymark
