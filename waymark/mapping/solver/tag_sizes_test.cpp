// Sizes according to the observations alone, their spread, and the error that all sizes share.
#include "waymark/mapping/solver/tag_sizes.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Cholesky>

#include "tests/support/rig_scene.hpp"
#include "waymark/base/random.hpp"
#include "waymark/geometry/uncertainty.hpp"
#include "waymark/samples/visibility.hpp"

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

constexpr double kPrintedLarger = 1.02;

/// A rig among tags that are all 2 % larger than given, near the minimum of its cost. `own`: standard
/// deviation of each size.
SceneMap printed_larger(double own, double noise_px, std::uint64_t seed = 1) {
  SceneMap map = test::true_scene_map(test::rig_scene({.frames = 40, .noise_px = noise_px, .seed = seed}),
                                      std::max(noise_px, 0.02));
  for (CornerTerm& term : map.problem.bundle.corners) term.factor.size_m /= kPrintedLarger;
  for (BundleSize& size : map.problem.bundle.sizes) size.sigma = own;
  map.problem.bundle.common_size.sigma = 0.02;
  return map;
}

/// Adds the true distance between two points on tags. `corner`: which one, or -1 for the centre.
void measure(int a, int b, int corner, SceneMap& map) {
  Bundle& bundle = map.problem.bundle;
  const auto point = [&](int tag, double size_m) -> BundlePoint {
    const Eigen::Vector3d p =
        corner < 0 ? Eigen::Vector3d::Zero().eval() : tag_corners(size_m)[static_cast<std::size_t>(corner)];
    return {map.problem.bodies[0].front(), map.problem.tags[0][static_cast<std::size_t>(tag)], p};
  };
  const double true_m =
      (map_point(bundle, point(a, test::kRigTag_m)) - map_point(bundle, point(b, test::kRigTag_m))).norm();
  const double given_m = test::kRigTag_m / kPrintedLarger;
  bundle.point_distances.push_back({point(a, given_m), point(b, given_m), true_m, 1e-4});
}

/// The normalised squared error of the position of a tag, with three degrees of freedom.
double chi2_of_position(const SceneMap& map, const SE3& truth, std::size_t tag) {
  const PoseIndex pose = map.problem.tags[0][tag];
  const SE3& found = map.problem.bundle.poses[pose].value;
  const Eigen::Vector3d off = truth.translation() - found.translation();
  const Matrix6 P = coordinate_covariance(Uncertain<SE3>{found, covariance(map.problem.bundle).poses[pose]});
  return off.dot(P.topLeftCorner<3, 3>().llt().solve(off));
}

TEST(CommonSize, ADistanceDeterminesIt) {
  for (const double own : {0.0, 0.003}) {
    for (const int corner : {-1, 0}) {
      SCOPED_TRACE(::testing::Message() << own << " " << corner);
      SceneMap map = printed_larger(own, 0);
      measure(1, 6, corner, map);
      ASSERT_TRUE(solve(map.problem.bundle).usable());
      const double sigma = std::sqrt(covariance(map.problem.bundle).common_size);
      EXPECT_LT(sigma, own > 0 ? 0.002 : 0.0005);
      EXPECT_NEAR(map.problem.bundle.common_size.log_scale, std::log(kPrintedLarger), own > 0 ? sigma : 1e-4);
      for (const BundleSize& size : map.problem.bundle.sizes)
        EXPECT_NEAR(size.log_scale, std::log(kPrintedLarger), 1e-3);
    }
  }
}

TEST(CommonSize, KeepsItsSigmaIfNothingDeterminesIt) {
  double chi2 = 0;
  constexpr int kSeeds = 10;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    SceneMap map = printed_larger(0.001, 0.2, seed);
    const SE3 truth = map.problem.bundle.poses[map.problem.tags[0][7]].value;
    ASSERT_TRUE(solve(map.problem.bundle).usable());
    EXPECT_NEAR(map.problem.bundle.common_size.log_scale, 0, 0.003);
    EXPECT_NEAR(std::sqrt(covariance(map.problem.bundle).common_size), 0.02, 0.002);
    chi2 += chi2_of_position(map, truth, 7) / kSeeds;
  }
  EXPECT_LT(chi2, 7) << "an error of one standard deviation, and two other directions";
}

TEST(CommonSize, OneOfZeroChangesNothing) {
  SceneMap map = printed_larger(0.003, 0.2);
  map.problem.bundle.common_size.sigma = 0;
  const internal::Unknowns unknowns = internal::unknowns_of(map.problem.bundle);
  EXPECT_EQ(unknowns.of_common_size, -1);
  EXPECT_EQ(std::ranges::count(unknowns.dimensions, 1), std::ssize(map.problem.bundle.sizes));
  ASSERT_TRUE(solve(map.problem.bundle).usable());
  EXPECT_EQ(map.problem.bundle.common_size.log_scale, 0);
  const BundleCovariance P = covariance(map.problem.bundle);
  EXPECT_EQ(P.common_size, 0);
  EXPECT_EQ(P.size_deviations, P.sizes);
}

TEST(CommonSize, IsOneUnknownIfSizesHaveNoOtherError) {
  const internal::Unknowns unknowns = internal::unknowns_of(printed_larger(0, 0.2).problem.bundle);
  EXPECT_EQ(std::ranges::count(unknowns.dimensions, 1), 1);
  for (const int size : unknowns.of_sizes) EXPECT_EQ(size, unknowns.of_common_size);
}

TEST(CommonSize, AWrongSizeIsJudgedBesideTheOthers) {
  SceneMap map = printed_larger(0.003, 0.2);
  measure(1, 6, -1, map);
  Bundle& bundle = map.problem.bundle;
  for (CornerTerm& term : bundle.corners) {
    if (term.size == 3U) term.factor.size_m /= 1.05;
  }
  const auto adjust = [&] { EXPECT_TRUE(solve(bundle).usable()); };
  adjust();
  const ReleasedSizes sizes = release_sizes(bundle, 0.003, {.adjust = adjust});
  EXPECT_EQ(sizes.released, std::vector<std::size_t>{3});
  EXPECT_LT(sizes.spread, 0.006);
  const double given_m = test::kRigTag_m / kPrintedLarger / 1.05;
  const auto wrong = wrong_size(test::rig_tag(3), given_m, 3, bundle,
                                size_estimates(bundle, covariance(bundle)), sizes.spread);
  ASSERT_TRUE(wrong);
  EXPECT_NEAR(wrong->found_m, test::kRigTag_m, 4 * wrong->sigma_m);
  EXPECT_LT(wrong->sigma_m, 0.003 * test::kRigTag_m);
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
