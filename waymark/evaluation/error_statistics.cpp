#include "waymark/evaluation/error_statistics.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace waymark {

ErrorStatistics statistics_of(std::vector<double> errors) {
  if (errors.empty()) return {};
  for (double& error : errors) error = std::abs(error);
  std::ranges::sort(errors);
  const auto n = static_cast<double>(errors.size());
  const auto quantile = [&](double share) {  // linear between ranks, as numpy.percentile
    const double rank = share * (n - 1);
    const auto below = static_cast<std::size_t>(rank);
    const std::size_t above = std::min(below + 1, errors.size() - 1);
    const double u = rank - static_cast<double>(below);
    return (1 - u) * errors[below] + u * errors[above];
  };
  return {.count = errors.size(),
          .rmse = std::sqrt(std::inner_product(errors.begin(), errors.end(), errors.begin(), 0.0) / n),
          .mean = std::accumulate(errors.begin(), errors.end(), 0.0) / n,
          .median = quantile(0.5),
          .p95 = quantile(0.95),
          .max = errors.back()};
}

}  // namespace waymark
