// Invariants of the map made from any lap, tested on a short aisle of a warehouse with odometry.
#include "waymark/mapping/lap/bundle_map.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdlib>

#include <gtest/gtest.h>
#include <Eigen/Cholesky>

#include "tests/support/sanitized.hpp"
#include "tests/support/warehouse.hpp"
#include "waymark/geometry/lie.hpp"
#include "waymark/mapping/lap/map_checks.hpp"

#if defined(__GLIBC__) && !defined(WAYMARK_SANITIZED)
#include <malloc.h>
#endif

namespace waymark {
namespace {

constexpr std::size_t kTags = 10;

test::Warehouse aisle(std::uint64_t seed) {
  return test::drive_warehouse(
      {.tags = kTags, .aisle_m = 3.5, .frame_m = 0.06, .farthest_m = 4, .seed = seed});
}

BundleMap mapped(const LapInput& lap, const BundleMapOptions& options = {}) {
  auto map = map_by_bundle(lap, {}, options);
  EXPECT_TRUE(map) << to_string(map.error());
  return map ? std::move(*map) : BundleMap();
}

double worst_m(const test::Warehouse& house, const BundleMap& map) {
  double worst = 0;
  for (const auto& [id, tag] : map.map.tags)
    worst = std::max(worst,
                     (tag.map_T_tag.translation() - house.truth.tags.at(id).map_T_tag.translation()).norm());
  return worst;
}

TEST(LapLaws, EstimatesTagsWithConsistentCovariance) {
  double sum = 0;
  int count = 0;
  for (std::uint64_t seed = 1; seed <= 4; ++seed) {
    const test::Warehouse house = aisle(seed);
    const BundleMap map = mapped(house.lap, {.search = {.tag_size_sigma_percent = 0}});
    ASSERT_EQ(map.map.tags.size(), kTags);
    EXPECT_LT(worst_m(house, map), 0.06) << seed;
    EXPECT_EQ(map.trajectory.size(), house.path.size());
    for (const auto& [id, tag] : map.map.tags) {
      ASSERT_TRUE(tag.covariance) << seed;
      if (id == house.lap.anchor) continue;
      const Vector6 e = minus(house.truth.tags.at(id).map_T_tag, tag.map_T_tag);
      sum += e.dot(tag.covariance->llt().solve(e));
      ++count;
    }
  }
  // The errors in one lap are correlated, so the bounds are wide for 36 * 6 squares.
  EXPECT_GT(sum / count, 2.5);
  EXPECT_LT(sum / count, 12);
}

TEST(LapLaws, AMovedAnchorMovesOnlyTheMap) {
  const test::Warehouse house = aisle(5);
  LapInput moved = house.lap;
  const SE3 by(SO3::from_rpy(0, 0, 0.8), Eigen::Vector3d(3, -2, 0));  // the floor must remain level
  moved.map_T_anchor = by * moved.map_T_anchor;
  const BundleMap map = mapped(house.lap);
  const BundleMap other = mapped(moved);
  ASSERT_EQ(map.map.tags.size(), other.map.tags.size());
  EXPECT_NEAR(other.rms_px, map.rms_px, 1e-4);
  for (const auto& [id, tag] : map.map.tags)
    EXPECT_LT(minus(other.map.tags.at(id).map_T_tag, by * tag.map_T_tag).norm(), 1e-4);
}

TEST(LapLaws, AnUnconnectedAisleStartsFromItsTagsAndOdometry) {
  constexpr int kInAisle = 20;
  const test::Warehouse house = test::drive_warehouse(
      {.tags = 3 * kInAisle, .aisle_m = 7, .frame_m = 0.06, .farthest_m = 4, .seed = 1});
  int steps = 0;
  const auto count = [&](const std::string& stage, int /*iteration*/, double /*cost*/) {
    steps += stage == "rejecting outliers" ? 1 : 0;
    return true;
  };
  const auto map = map_by_bundle(house.lap, {}, {}, count);
  ASSERT_TRUE(map);
  EXPECT_TRUE(map->unconnected.empty());
  EXPECT_LE(steps, 8);
  ASSERT_EQ(map->start_map.tags.size(), house.truth.tags.size());
  const auto between = [](const TagMap& tags, const TagId& a, const TagId& b) {
    return tags.tags.at(a).map_T_tag.inverse() * tags.tags.at(b).map_T_tag;
  };
  for (const auto& [id, tag] : house.truth.tags) {
    const TagId next{id.family, id.number + 1};
    if (next.number % kInAisle == 0) continue;
    const SE3 off = between(map->start_map, id, next).inverse() * between(house.truth, id, next);
    EXPECT_LT(off.translation().norm(), 0.15) << id.number;
    EXPECT_LT(off.rotation().log().norm(), 0.1) << id.number;
  }
}

TEST(LapLaws, TheOrderOfDetectionsDoesNotMatter) {
  const test::Warehouse house = aisle(6);
  LapInput mixed = house.lap;
  for (TagFrame& frame : mixed.frames) std::ranges::reverse(frame.detections);
  const BundleMap map = mapped(house.lap);
  const BundleMap other = mapped(mixed);
  ASSERT_EQ(map.map.tags.size(), other.map.tags.size());
  for (const auto& [id, tag] : map.map.tags)
    EXPECT_LT(minus(other.map.tags.at(id).map_T_tag, tag.map_T_tag).norm(), 1e-5);
}

TEST(LapLaws, RepeatedRunsAreIdentical) {
  const test::Warehouse house = aisle(7);
  const BundleMap map = mapped(house.lap);
  const BundleMap again = mapped(house.lap);
  for (const auto& [id, tag] : map.map.tags)
    EXPECT_EQ(again.map.tags.at(id).map_T_tag.translation(), tag.map_T_tag.translation());
}

TEST(LapLaws, TagNumbersDoNotMatter) {
  const test::Warehouse house = aisle(8);
  LapInput renamed = house.lap;
  const auto name = [](const TagId& id) { return TagId{id.family, 500 - id.number}; };
  for (TagFrame& frame : renamed.frames) {
    for (TagDetection& detection : frame.detections) detection.tag = name(detection.tag);
  }
  renamed.anchor = name(renamed.anchor);
  const BundleMap map = mapped(house.lap);
  const BundleMap other = mapped(renamed);
  ASSERT_EQ(map.map.tags.size(), other.map.tags.size());
  for (const auto& [id, tag] : map.map.tags)
    EXPECT_LT(minus(other.map.tags.at(name(id)).map_T_tag, tag.map_T_tag).norm(), 1e-4);
}

TEST(LapLaws, NonFiniteCornersDoNotAffectTheMap) {
  const test::Warehouse house = aisle(9);
  LapInput broken = house.lap;
  int count = 0;
  for (std::size_t f = 0; f < broken.frames.size(); f += 7) {
    if (broken.frames[f].detections.empty()) continue;
    broken.frames[f].detections.front().corners_px[2].x() = std::nan("");
    ++count;
  }
  ASSERT_GT(count, 3);
  const BundleMap map = mapped(broken);
  EXPECT_EQ(map.map.tags.size(), kTags);
  EXPECT_LT(worst_m(house, map), 0.08);
}

TEST(LapLaws, NonFiniteOdometryIsSkipped) {
  const test::Warehouse house = aisle(10);
  LapInput broken = house.lap;
  for (std::size_t i = 5; i < broken.odometry.size(); i += 20)
    broken.odometry[i].odom_T_base = SE2(std::nan(""), 0, 0);
  const BundleMap map = mapped(broken);
  EXPECT_EQ(map.map.tags.size(), kTags);
  EXPECT_LT(worst_m(house, map), 0.08);
}

TEST(LapLaws, EmptyFramesHaveNoEffect) {
  const test::Warehouse house = aisle(11);
  LapInput more = house.lap;
  const SensorTime end = more.frames.back().stamp;
  for (int i = 1; i <= 20; ++i) more.frames.push_back({.stamp = end + std::chrono::milliseconds(10 * i)});
  const BundleMap map = mapped(house.lap);
  const BundleMap other = mapped(more);
  for (const auto& [id, tag] : map.map.tags)
    EXPECT_LT(minus(other.map.tags.at(id).map_T_tag, tag.map_T_tag).norm(), 1e-6);
}

TEST(LapLaws, AWrongTagSizeChangesTheOdometryScale) {
  const test::Warehouse house = aisle(12);
  LapInput large = house.lap;
  large.sizes.default_size_m = 1.1 * *large.sizes.default_size_m;
  const BundleMap map = mapped(house.lap);
  const BundleMap other = mapped(large);
  EXPECT_NEAR(other.odometry_scales.distance / map.odometry_scales.distance, 1.1, 0.02);
}

TEST(LapLaws, FailsWithoutTheAnchor) {
  const test::Warehouse house = aisle(13);
  LapInput lap = house.lap;
  lap.anchor.number = 900;
  const auto none = map_by_bundle(lap);
  ASSERT_FALSE(none);
  lap = house.lap;
  for (TagFrame& frame : lap.frames) frame.detections.clear();
  EXPECT_FALSE(map_by_bundle(lap));
}

TEST(LapLaws, AStoppedSearchGivesNoMap) {
  const test::Warehouse house = aisle(14);
  const auto stopped =
      map_by_bundle(house.lap, {}, {}, [](const std::string&, int, double) { return false; });
  EXPECT_FALSE(stopped);
}

TEST(LapLaws, ALapMappedInPlaceIsRestored) {
  const test::Warehouse house = aisle(16);
  LapInput given = house.lap;
  const TagId first = std::next(house.truth.tags.begin(), 2)->first;  // not the anchor
  const TagId last = house.truth.tags.rbegin()->first;
  for (TagFrame& frame : given.frames) {  // two tags with one id
    for (TagDetection& detection : frame.detections)
      detection.tag = detection.tag == last ? first : detection.tag;
  }
  for (Odometry& sample : given.odometry)  // far off, so that the search replaces it
    sample.odom_T_base =
        SE2(1.5 * sample.odom_T_base.x(), 1.5 * sample.odom_T_base.y(), sample.odom_T_base.yaw());
  const BundleMap copied = mapped(given);
  LapInput lap = given;
  const TagFrame* frames = lap.frames.data();
  const auto in_place = map_by_bundle_in_place(lap);
  ASSERT_TRUE(in_place) << to_string(in_place.error());
  EXPECT_EQ(lap.frames.data(), frames);
  EXPECT_TRUE(lap.other_turns.empty());
  for (std::size_t f = 0; f < given.frames.size(); ++f)
    EXPECT_TRUE(std::ranges::equal(lap.frames[f].detections, given.frames[f].detections, {},
                                   &TagDetection::tag, &TagDetection::tag))
        << f;
  ASSERT_EQ(lap.odometry.size(), given.odometry.size());
  EXPECT_EQ(lap.odometry.back().odom_T_base.x(), given.odometry.back().odom_T_base.x());
  EXPECT_EQ(in_place->rejected.size(), copied.rejected.size());
  ASSERT_EQ(in_place->map.tags.size(), copied.map.tags.size());
  for (const auto& [id, tag] : copied.map.tags)
    EXPECT_EQ(in_place->map.tags.at(id).map_T_tag.translation(), tag.map_T_tag.translation());
}

#if defined(__GLIBC__) && !defined(WAYMARK_SANITIZED)
/// Bytes that the process has allocated and not freed.
std::size_t allocated_bytes() {
  const auto info = mallinfo2();
  return info.uordblks + info.hblkhd;
}

TEST(LapLaws, NoCopyOfTheFramesIsKeptForTheSearch) {
  test::Warehouse house = test::drive_warehouse({.tags = 100, .frame_m = 0.06});
  std::size_t frame_bytes = 0;
  for (const TagFrame& frame : house.lap.frames)
    frame_bytes += frame.detections.size() * sizeof(TagDetection);
  const std::size_t before = allocated_bytes();
  std::size_t after = 0;
  const MapProgress measure = [&](const std::string&, int, double) {
    after = allocated_bytes();  // the initial map is finished
    return false;
  };
  EXPECT_FALSE(map_by_bundle_in_place(house.lap, {}, {}, measure));
  ASSERT_GT(after, 0U);
  EXPECT_LT(after, before + frame_bytes / 2);
}
#endif

TEST(LapLaws, OutliersAreRejectedAndCountedByTag) {
  const test::Warehouse house = aisle(15);
  LapInput torn = house.lap;
  const TagId which = std::next(house.truth.tags.begin(), 4)->first;
  int count = 0;
  for (std::size_t f = 0; f < torn.frames.size(); f += 5) {
    for (TagDetection& detection : torn.frames[f].detections) {
      if (detection.tag != which) continue;
      for (auto& corner : detection.corners_px) corner.x() += 40;
      ++count;
    }
  }
  ASSERT_GT(count, 2);
  const BundleMap map = mapped(torn);
  const auto left_out = rejections_by_tag(torn, map);
  ASSERT_TRUE(left_out.contains(which));
  const RejectionCounts& counts = left_out.at(which);
  EXPECT_GE(counts[0] + counts[1] + counts[2] + counts[3], count);
  EXPECT_LT(worst_m(house, map), 0.08);
}

}  // namespace
}  // namespace waymark
