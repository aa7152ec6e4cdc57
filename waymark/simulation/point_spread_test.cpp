#include "waymark/simulation/point_spread.hpp"

#include <cmath>
#include <numbers>
#include <numeric>

#include <gtest/gtest.h>

namespace waymark::photo {
namespace {

constexpr double kSigmas[] = {0.05, 0.1, 0.3, 0.6, 1.0, 2.5, 8.0};

/// Centre of weight k, from the middle of the pixel [px].
double position(const PointSpread& spread, std::size_t k) {
  return (static_cast<double>(k) + 0.5) / spread.cells_per_px - 0.5 - spread.reach_px;
}

TEST(PointSpread, SumsToOneAndIsSymmetric) {
  for (const double sigma : kSigmas) {
    const PointSpread spread = point_spread(sigma);
    const std::size_t count = spread.weights.size();
    ASSERT_EQ(count, static_cast<std::size_t>(spread.cells_per_px * (1 + 2 * spread.reach_px)));
    EXPECT_NEAR(std::accumulate(spread.weights.begin(), spread.weights.end(), 0.0), 1, 1e-14);
    for (std::size_t k = 0; k < count; ++k) {
      EXPECT_EQ(spread.weights[k], spread.weights[count - 1 - k]);
      EXPECT_GE(spread.weights[k], 0);
    }
  }
}

TEST(PointSpread, HasTheVarianceOfBoxAndGaussian) {
  for (const double sigma : kSigmas) {
    const PointSpread spread = point_spread(sigma);
    double variance = 1.0 / (12.0 * spread.cells_per_px * spread.cells_per_px);  // of a cell
    for (std::size_t k = 0; k < spread.weights.size(); ++k) {
      variance += spread.weights[k] * position(spread, k) * position(spread, k);
    }
    EXPECT_NEAR(variance, sigma * sigma + 1.0 / 12, 2e-5 * (1 + sigma * sigma)) << sigma;
  }
}

TEST(PointSpread, WithoutLensThePixelAlone) {
  EXPECT_EQ(point_spread(0), (PointSpread{1, 0, {1.0}}));
  EXPECT_EQ(point_spread(0.049), point_spread(0));
}

/// Mean over a pixel at u of a step at 0 spread by a Gaussian: the exact response.
double exact_step(double u, double sigma) {
  const auto integral = [&](double x) {
    return x * 0.5 * std::erfc(-x / sigma / std::numbers::sqrt2) +
           sigma * std::exp(-x * x / sigma / sigma / 2) / std::sqrt(2 * std::numbers::pi);
  };
  return integral(u + 0.5) - integral(u - 0.5);
}

TEST(PointSpread, RespondsToAStepAsTheExactIntegral) {
  for (const double sigma : {0.3, 0.6, 1.0, 2.5}) {
    const PointSpread spread = point_spread(sigma);
    const double half = 0.5 / spread.cells_per_px;
    for (double u = -4; u <= 4; u += 0.0371) {  // the step lies at -u
      double response = 0;
      for (std::size_t k = 0; k < spread.weights.size(); ++k) {
        response += spread.weights[k] * std::clamp((position(spread, k) + half + u) / (2 * half), 0.0, 1.0);
      }
      EXPECT_NEAR(response, exact_step(u, sigma), 1e-3) << sigma << " at " << u;
    }
  }
}

}  // namespace
}  // namespace waymark::photo
