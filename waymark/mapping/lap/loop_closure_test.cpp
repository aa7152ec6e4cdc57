// What a lap that comes back says of its wheels and of its map, on a ring whose truth is known.
#include "waymark/mapping/lap/loop_closure.hpp"

#include <gtest/gtest.h>

#include "tests/support/ring_drive.hpp"

namespace waymark {
namespace {

using test::drive_ring;
using test::ring_tag;
using test::RingDrive;
using test::true_map;

TEST(LoopClosure, ExactWheelsAndAnExactMapCloseExactly) {
  const RingDrive drive = drive_ring();
  const auto loop = loop_closure(drive.lap, true_map(drive));
  ASSERT_TRUE(loop);
  EXPECT_GT(loop->away_s, 10);
  EXPECT_NEAR(loop->way_m, 0.5 * loop->away_s, 0.01) << "a frame in 0.1 s and every 5 cm";
  EXPECT_LT(loop->before_m, 1e-6);
  EXPECT_LT(loop->before_rad, 1e-6);
  EXPECT_LT(loop->after_m, 1e-4);
}

TEST(LoopClosure, WheelsThatTellTooLittleOfTheWayAreOffByThat) {
  const RingDrive drive = drive_ring({.told_distance = 0.9});
  const auto loop = loop_closure(drive.lap, true_map(drive));
  ASSERT_TRUE(loop);
  // On the same arc with nine tenths of its radius: the chord is a tenth shorter.
  const double turned_rad = loop->way_m;
  EXPECT_NEAR(loop->before_m, 0.1 * 2 * std::abs(std::sin(turned_rad / 2)), 1e-3);
  EXPECT_LT(loop->before_rad, 1e-6);
}

TEST(LoopClosure, WheelsThatTellTooLittleOfTheTurnsLoseTheHeading) {
  const RingDrive drive = drive_ring({.told_yaw = 0.98});
  const auto loop = loop_closure(drive.lap, true_map(drive));
  ASSERT_TRUE(loop);
  EXPECT_NEAR(loop->before_rad, 0.02 * loop->way_m, 1e-4)
      << "a radius of a metre; chords are shorter than arcs";
  EXPECT_GT(loop->before_m, 0.01);
}

TEST(LoopClosure, AWayThatDoesNotCloseInTheMapShowsAfterIt) {
  const RingDrive drive = drive_ring();
  BundleMap map = true_map(drive);
  const auto closed = loop_closure(drive.lap, map);
  ASSERT_TRUE(closed);
  const SE3 aside({}, {0.03, -0.04, 0});
  for (StampedPose& pose : map.trajectory) {
    if (to_seconds(pose.stamp - map.trajectory.front().stamp) > 6) pose.map_T_base = aside * pose.map_T_base;
  }
  const auto loop = loop_closure(drive.lap, map);
  ASSERT_TRUE(loop);
  EXPECT_EQ(loop->tag, closed->tag);
  EXPECT_NEAR(loop->after_m, 0.05, 1e-3);
}

TEST(LoopClosure, WhereTheMapStandsDoesNotMatter) {
  const RingDrive drive = drive_ring({.told_distance = 0.97, .told_yaw = 1.01});
  BundleMap moved = true_map(drive);
  const SE3 by(SO3::from_rpy(0, 0, 2), {5, -3, 0});
  for (auto& [id, tag] : moved.map.tags) tag.map_T_tag = by * tag.map_T_tag;
  for (StampedPose& pose : moved.trajectory) pose.map_T_base = by * pose.map_T_base;
  const auto here = loop_closure(drive.lap, true_map(drive));
  const auto there = loop_closure(drive.lap, moved);
  ASSERT_TRUE(here && there);
  EXPECT_EQ(here->tag, there->tag);
  EXPECT_NEAR(here->before_m, there->before_m, 1e-9);
  EXPECT_NEAR(here->before_rad, there->before_rad, 1e-9);
  EXPECT_NEAR(here->after_m, there->after_m, 1e-6);
}

TEST(LoopClosure, ObservationsThatTheMapLeavesOutDoNotCloseIt) {
  const RingDrive drive = drive_ring();
  BundleMap map = true_map(drive);
  const auto loop = loop_closure(drive.lap, map);
  ASSERT_TRUE(loop);
  test::reject(drive, loop->tag, 100, drive.lap.frames.size(), map);
  const auto another = loop_closure(drive.lap, map);
  if (another) {
    EXPECT_NE(another->tag, loop->tag);
  }
  for (int number = 0; number < 12; ++number) map.map.tags.erase(ring_tag(number));
  EXPECT_FALSE(loop_closure(drive.lap, map)) << "of tags that are in the map";
}

TEST(LoopClosure, NothingComesBackInLessThanARound) {
  const RingDrive open = drive_ring({.loops = 0.5});
  EXPECT_FALSE(loop_closure(open.lap, true_map(open)));
  RingDrive drive = drive_ring();
  drive.lap.odometry.clear();
  EXPECT_FALSE(loop_closure(drive.lap, true_map(drive))) << "without wheels there is no before";
  EXPECT_FALSE(loop_closure({.camera = test::ring_camera()}, {}));
}

}  // namespace
}  // namespace waymark
