// Maps of circuit24 by bundle adjustment from noisy corners: errors at the Cramer-Rao bound with a consistent
// covariance, and laps with defects.
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <optional>
#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/circuit_lap.hpp"
#include "waymark/evaluation/map_errors.hpp"
#include "waymark/samples/tag_detection.hpp"

namespace waymark {
namespace {

using namespace test;

TEST(BundleMap, ReachesTheCramerRaoBoundConsistently) {
  const bool full = std::getenv("WAYMARK_FULL") != nullptr;
  const int laps = full ? 800 : 16;
  Score tags;
  Score trajectory;
  for (int seed = 1; seed <= laps; ++seed) {
    const Lap lap = drive(static_cast<std::uint64_t>(seed));
    const BundleMap map = map_of(lap.input, exact_sizes());
    ASSERT_EQ(map.map.tags.size(), circuit().tags.tags.size());
    for (const auto& [id, tag] : map.map.tags) {
      if (!tag.covariance) continue;  // the anchor
      tags.add(tag.map_T_tag.translation() - circuit().tags.find(id)->map_T_tag.translation(),
               position_covariance(tag.map_T_tag, *tag.covariance));
    }
    for (std::size_t i = 0; i < map.trajectory.size(); ++i) {
      const auto truth = true_pose(lap, map.trajectory[i].stamp);
      if (!truth) continue;
      const SE3& estimate = map.trajectory[i].map_T_base;
      trajectory.add(estimate.translation() - truth->translation(),
                     position_covariance(estimate, map.trajectory_covariance[i]));
    }
    tags.end_lap();
    trajectory.end_lap();
  }
  std::printf(
      "%d laps: tags %.4f m rmse, %.3f +- %.3f of the bound, %.3f +- %.3f in their 95 %% ellipsoids; "
      "trajectory "
      "%.4f m, %.3f +- %.3f, %.3f +- %.3f\n",
      laps, tags.rmse_m(), tags.ratio(), tags.ratio_sigma(), tags.coverage(), tags.coverage_sigma(),
      trajectory.rmse_m(), trajectory.ratio(), trajectory.ratio_sigma(), trajectory.coverage(),
      trajectory.coverage_sigma());
  EXPECT_GT(trajectory.count, 100 * laps);
  // The errors of a lap are strongly correlated, mostly a rotation about the anchor, so few laps give a large
  // scatter, estimated from the laps themselves.
  constexpr double kSigmas = 2;
  EXPECT_LT(tags.ratio() - kSigmas * tags.ratio_sigma(), 1.15);
  EXPECT_GT(tags.ratio() + kSigmas * tags.ratio_sigma(), 0.85)
      << "below the bound: the covariance is too large";
  EXPECT_LT(trajectory.ratio() - kSigmas * trajectory.ratio_sigma(), 1.15);
  EXPECT_GT(tags.coverage() + kSigmas * tags.coverage_sigma(), 0.92);
  EXPECT_LT(tags.coverage() - kSigmas * tags.coverage_sigma(), 0.98);
  EXPECT_LT(tags.ratio_sigma(), 0.25) << "too few laps for these bounds";
  if (!full) return;
  for (const Score* score : {&tags, &trajectory}) {  // significantly
    EXPECT_LT(score->ratio() + kSigmas * score->ratio_sigma(), 1.15);
    EXPECT_GT(score->coverage() - kSigmas * score->coverage_sigma(), 0.92);
    EXPECT_LT(score->coverage() + kSigmas * score->coverage_sigma(), 0.98);
  }
}

TEST(BundleMap, RepeatedRunsAreIdentical) {
  const Lap lap = drive(3);
  const BundleMap a = map_of(lap.input);
  const BundleMap b = map_of(lap.input);
  for (const auto& [id, tag] : a.map.tags) EXPECT_EQ(tag.map_T_tag, b.map.tags.at(id).map_T_tag);
}

TEST(BundleMap, StopsOnRequestAtAnyStepWithoutAResult) {
  Lap lap = drive(3);
  lap.input.frames.resize(lap.input.frames.size() / 4);
  BundleMapOptions options;
  options.find_mounting = true;  // the longest search: with mounting and odometry noise
  int steps = 0;
  const auto count = [&](const std::string&, int, double) { return ++steps > 0; };
  ASSERT_TRUE(map_by_bundle(lap.input, {}, options, count));
  ASSERT_GT(steps, 20);
  for (const int after : {0, steps / 2, steps - 1}) {
    int asked = 0;
    const auto stop = [&](const std::string&, int, double) { return asked++ < after; };
    const Result<BundleMap> map = map_by_bundle(lap.input, {}, options, stop);
    ASSERT_FALSE(map) << after << " of " << steps;
    EXPECT_EQ(map.error().code, ErrorCode::LimitExceeded);
    EXPECT_EQ(asked, after + 1) << "the callback is not called again";
  }
}

TEST(BundleMap, WorksWithoutOdometryAndWithACoveredCamera) {
  Lap lap = drive(7);
  LapInput no_wheels = lap.input;
  no_wheels.odometry.clear();
  EXPECT_LT(worst_of_others(map_of(no_wheels), {}), 0.04);
  for (std::size_t i = 300; i < 345; ++i) lap.input.frames[i].detections.clear();  // covered for 3 s
  const BundleMap map = map_of(lap.input);
  EXPECT_EQ(map.frames_without_pose, 0) << "odometry bridges the gap";
  EXPECT_LT(worst_of_others(map, {}), 0.04);
  EXPECT_LT(trajectory_errors(map.trajectory, lap.truth).max_m, 0.06);
}

TEST(BundleMap, PlacesATagTooFarAwayForTheChain) {
  Lap lap = drive(9);
  const TagId far{FamilyId::Tag36h11, 12};
  constexpr double kSideAtMaxDistance_px = 442 * 0.16 / 2.6;  // side of a tag 2.6 m away
  for (TagFrame& frame : lap.input.frames) {
    std::erase_if(frame.detections, [&](const TagDetection& detection) {
      return detection.tag == far && mean_side_px(detection.corners_px) > kSideAtMaxDistance_px;
    });
  }
  int observations = 0;
  for (const TagFrame& frame : lap.input.frames)
    observations += static_cast<int>(std::ranges::count(frame.detections, far, &TagDetection::tag));
  ASSERT_GE(observations, 10);
  const ChainOptions chain{.max_distance_m = 2.5};
  const auto mapped = map_by_bundle(lap.input, chain);
  ASSERT_TRUE(mapped) << to_string(mapped.error());
  const BundleMap& map = *mapped;
  ASSERT_NE(map.map.find(far), nullptr) << "placed by its observations once the base poses are known";
  EXPECT_TRUE(map.unconnected.empty());
  const double off =
      (map.map.find(far)->map_T_tag.translation() - circuit().tags.find(far)->map_T_tag.translation()).norm();
  EXPECT_LT(off, 0.15);
}

TEST(BundleMap, SkipsInvalidMeasurements) {
  Lap lap = drive(8);
  lap.input.frames[100].detections[0].corners_px[2].x() = std::nan("");
  lap.input.frames[200].stamp = lap.input.frames[199].stamp;
  lap.input.odometry[500].odom_T_base = SE2(std::nan(""), 0, 0);
  const BundleMap map = map_of(lap.input);
  EXPECT_LT(worst_of_others(map, {}), 0.03);
  for (const StampedPose& pose : map.trajectory) EXPECT_TRUE(pose.map_T_base.log().allFinite());
  LapInput no_anchor = lap.input;
  no_anchor.anchor = {FamilyId::Tag36h11, 99};
  EXPECT_FALSE(map_by_bundle(no_anchor));
}

}  // namespace
}  // namespace waymark
