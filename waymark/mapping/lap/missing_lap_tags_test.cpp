// Tags that were taken away between two loops of a ring, or since a map was made that a lap extends.
#include "waymark/mapping/lap/missing_lap_tags.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/ring_drive.hpp"
#include "waymark/base/angles.hpp"
#include "waymark/mapping/lap/map_checks.hpp"

namespace waymark {
namespace {

using test::drive_ring;
using test::ring_tag;
using test::RingDrive;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

test::RingShape loops(double count, std::uint64_t seed) {
  return {.loops = count,
          .stated_sigma_px = 0.2,
          .noise_px = 0.2,
          .odometry_sigma_m = 5e-4,
          .odometry_sigma_rad = 1e-3,
          .seed = seed};
}

BundleMap map_of_ring(const LapInput& lap) {
  auto map = map_by_bundle(lap);
  EXPECT_TRUE(map) << to_string(map.error());
  return map ? std::move(*map) : BundleMap();
}

/// Removes a share of all detections at random.
void drop_detections(double share, std::uint64_t seed, RingDrive& drive) {
  Random random(seed);
  for (TagFrame& frame : drive.lap.frames)
    std::erase_if(frame.detections, [&](const TagDetection&) { return random.uniform() < share; });
}

/// The first frame of the last pass of a tag.
std::size_t last_pass(const RingDrive& drive, int number) {
  constexpr std::size_t kGap = 50;
  std::size_t last = drive.lap.frames.size();
  for (std::size_t f = drive.lap.frames.size(); f-- > 0;) {
    if (std::ranges::count(drive.lap.frames[f].detections, ring_tag(number), &TagDetection::tag) == 0)
      continue;
    if (last < drive.lap.frames.size() && last - f > kGap) break;
    last = f;
  }
  return last;
}

TEST(MissingLapTags, NoneIsReportedIfNoneWasTakenAway) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    for (const double share : {0.0, 0.3}) {
      RingDrive drive = drive_ring(loops(2.3, seed));
      drop_detections(share, seed, drive);
      EXPECT_THAT(map_of_ring(drive.lap).missing_tags, IsEmpty()) << seed << " " << share;
    }
  }
}

TEST(MissingLapTags, ATagTakenAwayBetweenLoopsIsReported) {
  for (const int number : {5, 7, 10}) {
    for (const double share : {0.0, 0.2}) {
      SCOPED_TRACE(::testing::Message() << "tag " << number << ", " << share << " not detected");
      RingDrive drive = drive_ring(loops(2, 11));
      drop_detections(share, 5, drive);
      const std::size_t frame = last_pass(drive, number);
      const int gone = test::take_tag_away(drive, number, frame);
      const BundleMap map = map_of_ring(drive.lap);
      ASSERT_EQ(map.missing_tags.size(), 1U);
      const MissingTag& missing = map.missing_tags[0];
      EXPECT_EQ(missing.tag, ring_tag(number));
      EXPECT_EQ(missing.passes, 1);
      EXPECT_GE(missing.expected_images, gone / 2);
      EXPECT_LE(missing.expected_images, 1.1 * gone / (1 - share));
      ASSERT_TRUE(missing.last_seen_s);
      EXPECT_LT(*missing.last_seen_s, to_seconds(drive.lap.frames[frame].stamp - drive.lap.frames[0].stamp));
      EXPECT_TRUE(map.map.tags.contains(ring_tag(number))) << "it stays in the map";
      EXPECT_THAT(check_map(drive.lap, map), Contains(HasSubstr(to_string(ring_tag(number)) + ": expected")));
    }
  }
}

TEST(MissingLapTags, AMisreadIdDoesNotHideIt) {
  RingDrive drive = drive_ring(loops(2, 12));
  const std::size_t frame = last_pass(drive, 7);
  test::take_tag_away(drive, 7, frame);
  drive.lap.frames.back().detections.front().tag = ring_tag(7);
  const BundleMap map = map_of_ring(drive.lap);
  ASSERT_EQ(map.missing_tags.size(), 1U);
  EXPECT_EQ(map.missing_tags[0].tag, ring_tag(7));
}

TEST(MissingLapTags, ACoveredCameraIsNotAMissingTag) {
  RingDrive drive = drive_ring(loops(2, 13));
  for (std::size_t f = 3 * drive.lap.frames.size() / 4; f < drive.lap.frames.size(); ++f)
    drive.lap.frames[f].detections.clear();
  EXPECT_THAT(map_of_ring(drive.lap).missing_tags, IsEmpty());
}

TEST(MissingLapTags, AShortLapDoesNotReportTagsThatItDidNotPass) {
  for (const double count : {1.1, 1.5}) {
    const RingDrive drive = drive_ring(loops(count, 14));
    EXPECT_THAT(map_of_ring(drive.lap).missing_tags, IsEmpty()) << count;
  }
}

TEST(MissingLapTags, ATagOfAnExtendedMapThatWasTakenAwayIsReported) {
  const BundleMap first = map_of_ring(drive_ring(loops(1.1, 15)).lap);
  test::RingShape shape = loops(1.1, 16);
  shape.frame_m = 0.03;  // more than ten images show a tag together with a neighbour that is farther away
  for (const int number : {3, 7, 10}) {
    RingDrive drive = drive_ring(shape);
    const int gone = test::take_tag_away(drive, number, 0);
    drive.lap.prior = LapPrior{.map = first.map};
    const BundleMap map = map_of_ring(drive.lap);
    ASSERT_EQ(map.missing_tags.size(), 1U) << number;
    EXPECT_EQ(map.missing_tags[0].tag, ring_tag(number));
    EXPECT_FALSE(map.missing_tags[0].last_seen_s);
    EXPECT_GE(map.missing_tags[0].expected_images, 10);
    EXPECT_LE(map.missing_tags[0].expected_images, gone);
    EXPECT_TRUE(map.map.tags.contains(ring_tag(number)));
  }
}

TEST(MissingLapTags, AnExtendingLapReportsNoTagThatItDidNotPass) {
  const BundleMap first = map_of_ring(drive_ring(loops(1.1, 17)).lap);
  for (const double count : {0.4, 1.1}) {
    RingDrive drive = drive_ring(loops(count, 18));
    drive.lap.prior = LapPrior{.map = first.map};
    drive.lap.anchor = ring_tag(3);
    drive.lap.map_T_anchor = first.map.tags.at(ring_tag(3)).map_T_tag;
    EXPECT_THAT(map_of_ring(drive.lap).missing_tags, IsEmpty()) << count;
  }
}

/// Adds a large tag behind those of the ring. The camera sees it between them.
void add_tag_behind(RingDrive& drive, int number) {
  constexpr double kSize_m = 0.5;
  constexpr double kRadius_m = 4.2;
  const double angle = to_radians(75);
  const SE3 at = lift(SE2(kRadius_m * std::cos(angle), kRadius_m * std::sin(angle), angle));
  const SE3 map_T_tag = at * SE3(body_R_optical(), {0, 0, 0.3});
  drive.tags.tags[ring_tag(number)] = {.map_T_tag = map_T_tag, .size_m = kSize_m};
  drive.lap.sizes.size_by_tag_m[ring_tag(number)] = kSize_m;
  for (std::size_t f = 0; f < drive.lap.frames.size(); ++f) {
    const SE3 map_T_cam = drive.truth[f].map_T_base * drive.lap.base_T_cam;
    const auto corners = visible_corners(drive.lap.camera, map_T_cam.inverse() * map_T_tag, kSize_m);
    if (!corners) continue;
    drive.lap.frames[f].detections.push_back(
        {.tag = ring_tag(number),
         .decision_margin = 60,
         .corners_px = *corners,
         .corner_covariance_px2 = CornerCovariance(0.04 * CornerCovariance::Identity())});
  }
}

TEST(MissingLapTags, AnObstacleOnAnotherRouteIsNotAMissingTag) {
  constexpr int kBehind = 20;
  RingDrive before = drive_ring(loops(1.1, 19));
  add_tag_behind(before, kBehind);
  const BundleMap first = map_of_ring(before.lap);
  ASSERT_TRUE(first.map.tags.contains(ring_tag(kBehind)));
  test::RingShape shape = loops(1.1, 20);
  shape.radius_m = 1.4;
  shape.outside_m = 1.2;  // an obstacle behind the ring hides the tag from here
  RingDrive drive = drive_ring(shape);
  drive.lap.prior = LapPrior{.map = first.map};
  const BundleMap map = map_of_ring(drive.lap);
  EXPECT_TRUE(map.map.tags.contains(ring_tag(kBehind)));
  EXPECT_THAT(map.missing_tags, IsEmpty());
}

TEST(MissingLapTags, ATagThatWasMovedIsNotMissingAtItsFirstPlace) {
  for (const double distance_m : {0.3, 1.2, 2.5}) {
    const test::RingShape shape = loops(2, 21);
    RingDrive drive = drive_ring(shape);
    test::move_tag(drive, shape, 7, SE3({}, {distance_m, 0, 0}), last_pass(drive, 7));
    EXPECT_THAT(map_of_ring(drive.lap).missing_tags, IsEmpty()) << distance_m;
  }
}

TEST(MissingLapTags, TagsThatWereSwappedBetweenLoopsAreNotMissing) {
  for (const auto& [a, b] : {std::pair(5, 10), {5, 6}}) {
    RingDrive drive = drive_ring(loops(2, 22));
    for (std::size_t f = drive.lap.frames.size() / 2; f < drive.lap.frames.size(); ++f) {
      for (TagDetection& seen : drive.lap.frames[f].detections) {
        if (seen.tag == ring_tag(a))
          seen.tag = ring_tag(b);
        else if (seen.tag == ring_tag(b))
          seen.tag = ring_tag(a);
      }
    }
    EXPECT_THAT(map_of_ring(drive.lap).missing_tags, IsEmpty()) << a << ", " << b;
  }
}

TEST(MissingLapTags, OnlyAnAgreedSecondPlaceIsNotMissing) {
  const test::RingShape shape = loops(2, 23);
  RingDrive drive = drive_ring(shape);
  BundleMap map = test::true_map(drive);
  const std::size_t all = drive.lap.frames.size();
  const std::size_t frame = last_pass(drive, 5);
  test::move_tag(drive, shape, 5, SE3({}, {0.2, 0.15, 0}), frame);
  test::reject(drive, ring_tag(5), frame, all, map);
  test::take_tag_away(drive, 8, last_pass(drive, 8));
  drive.lap.frames.back().detections.front().tag = ring_tag(8);  // a misread id
  test::reject(drive, ring_tag(8), all - 1, all, map);
  std::vector<MissingTag> missing = {{.tag = ring_tag(5), .expected_images = 20, .passes = 1},
                                     {.tag = ring_tag(8), .expected_images = 20, .passes = 1}};
  internal::drop_tags_observed_elsewhere(second_places(drive.lap, map), missing);
  ASSERT_EQ(missing.size(), 1U);
  EXPECT_EQ(missing[0].tag, ring_tag(8));
}

}  // namespace
}  // namespace waymark
