#include "waymark/simulation/point_spread.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace waymark::photo {
namespace {

/// Integral of the normal distribution function with standard deviation sigma, from minus infinity to x.
double integral_of_cdf(double x, double sigma) {
  const double z = x / sigma;
  const double cdf = 0.5 * std::erfc(-z / std::numbers::sqrt2);
  const double density = std::exp(-z * z / 2) / std::sqrt(2 * std::numbers::pi);
  return x * cdf + sigma * density;
}

/// Integral of box * Gaussian from minus infinity to u.
double gathered_up_to(double u, double sigma) {
  return integral_of_cdf(u + 0.5, sigma) - integral_of_cdf(u - 0.5, sigma);
}

}  // namespace

PointSpread point_spread(double sigma_px) {
  constexpr double kNoLens = 0.05;
  if (sigma_px < kNoLens) return {.cells_per_px = 1, .reach_px = 0, .weights = {1.0}};
  constexpr double kCellsPerSigma = 5;
  constexpr double kReachInSigmas = 5;
  PointSpread spread;
  spread.cells_per_px = std::clamp(static_cast<int>(std::ceil(kCellsPerSigma / sigma_px)), 2, 16);
  spread.reach_px = static_cast<int>(std::ceil(kReachInSigmas * sigma_px));
  const int n = spread.cells_per_px;
  const double sigma = std::sqrt(sigma_px * sigma_px - 1.0 / (6.0 * n * n));
  const int count = n * (1 + 2 * spread.reach_px);
  double sum = 0;
  for (int k = 0; k < count; ++k) {
    // By symmetry from the left half, where the difference of the two integrals keeps its digits.
    const double left = static_cast<double>(std::min(k, count - 1 - k)) / n - 0.5 - spread.reach_px;
    spread.weights.push_back(gathered_up_to(left + 1.0 / n, sigma) - gathered_up_to(left, sigma));
    sum += spread.weights.back();
  }
  for (double& weight : spread.weights) weight /= sum;
  return spread;
}

}  // namespace waymark::photo
