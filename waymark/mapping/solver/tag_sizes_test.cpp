// Sizes according to the observations alone, and their spread.
#include "waymark/mapping/solver/tag_sizes.hpp"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/rig_scene.hpp"
#include "waymark/base/random.hpp"

namespace waymark {
namespace {

/// A rig among tags of which one has a size that is 1 % off, at the minimum of its cost.
Bundle with_wrong_size(double prior_sigma) {
  constexpr double kNoisePx = 0.2;
  SceneMap map = test::true_scene_map(test::rig_scene({.frames = 40, .noise_px = kNoisePx}), kNoisePx);
  for (CornerTerm& term : map.problem.bundle.corners) {
    if (term.size == 3U) term.factor.size_m *= 0.99;
  }
  for (BundleSize& size : map.problem.bundle.sizes) size.sigma = prior_sigma;
  EXPECT_TRUE(solve(map.problem.bundle).usable());
  return map.problem.bundle;
}

TEST(SizeEstimates, AreThoseWithoutAPrior) {
  Bundle narrow = with_wrong_size(0.005);
  const std::vector<SizeEstimate> estimates = size_estimates(narrow, covariance(narrow));
  ASSERT_EQ(estimates.size(), narrow.sizes.size());
  for (const SizeEstimate& estimate : estimates) {
    Bundle wide = narrow;
    wide.sizes[estimate.size].sigma = 10;
    ASSERT_TRUE(solve(wide).usable());
    EXPECT_NEAR(estimate.sigma, std::sqrt(covariance(wide).sizes[estimate.size]), 0.01 * estimate.sigma);
    EXPECT_NEAR(estimate.log_scale, wide.sizes[estimate.size].log_scale, 0.05 * estimate.sigma);
  }
}

TEST(SizeEstimates, OmitSizesThatNothingDetermines) {
  Bundle bundle = with_wrong_size(0.005);
  for (CornerTerm& term : bundle.corners) term.used = term.used && term.size != 5U;
  for (const SizeEstimate& estimate : size_estimates(bundle, covariance(bundle)))
    EXPECT_NE(estimate.size, 5U);
}

TEST(SizeSpread, IsThatOfTheSizes) {
  constexpr double kAssumed = 0.003;
  Random random(3);
  EXPECT_NEAR(size_spread({}, kAssumed), kAssumed, 0.1 * kAssumed);
  for (const double spread : {0.002, 0.003, 0.02}) {
    std::vector<SizeEstimate> estimates;
    for (std::size_t i = 0; i < 200; ++i) {
      const double sigma = 0.001 + 0.002 * random.uniform();
      estimates.push_back({i, std::hypot(spread, sigma) * random.normal(), sigma});
    }
    EXPECT_NEAR(size_spread(estimates, kAssumed), spread, 0.15 * spread + 0.0003);
  }
}

TEST(ReleasedSizes, AreOnlyTheWrongOnes) {
  Bundle bundle = with_wrong_size(0.001);
  const auto adjust = [&] { EXPECT_TRUE(solve(bundle).usable()); };
  const ReleasedSizes sizes = release_sizes(bundle, 0.001, {.adjust = adjust});
  EXPECT_EQ(sizes.released, std::vector<std::size_t>{3});
  EXPECT_NEAR(bundle.sizes[3].log_scale, -std::log(0.99), 0.003);
  EXPECT_LT(sizes.spread, 0.002);
}

TEST(ReleasedSizes, AreEmptyForExactSizesAndOtherCauses) {
  Bundle exact = with_wrong_size(0);
  const auto never = [] { ADD_FAILURE() << "there is nothing to adjust"; };
  EXPECT_TRUE(release_sizes(exact, 0.001, {.adjust = never}).released.empty());
  Bundle bundle = with_wrong_size(0.001);
  const auto adjust = [&] { EXPECT_TRUE(solve(bundle).usable()); };
  const auto moved = [&](const std::vector<std::size_t>& released, double) {
    EXPECT_EQ(released, std::vector<std::size_t>{3});
    return SizeCause::Other;
  };
  EXPECT_TRUE(release_sizes(bundle, 0.001, {.adjust = adjust, .cause = moved}).released.empty());
}

}  // namespace
}  // namespace waymark
