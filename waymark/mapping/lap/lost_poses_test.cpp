// Tests that frames and tags far from their true poses are re-initialised, and that correct ones do not
// change.
#include "waymark/mapping/lap/lost_poses.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/ring_drive.hpp"
#include "waymark/geometry/lie.hpp"

namespace waymark::internal {
namespace {

using test::drive_ring;
using test::ring_tag;
using test::RingDrive;
using test::true_start;
using ::testing::ElementsAre;

constexpr std::size_t kFrame = 50;
const SE3 kElsewhere(SO3::from_rpy(0, 0, 0.5), {0.8, -0.6, 0});

struct Problem {
  RingDrive drive = drive_ring({.loops = 1});
  LapBundle lap = lap_bundle(drive.lap, true_start(drive));
  const BundleMapOptions options{};

  SE3& base(std::size_t frame) { return lap.bundle.poses[*lap.bases[frame]].value; }
  SE3& tag(int number) { return lap.bundle.poses[lap.tags.at(ring_tag(number))].value; }
  double off(std::size_t frame) { return minus(base(frame), drive.truth[frame].map_T_base).norm(); }
  double off_tag(int number) {
    return minus(tag(number), drive.tags.tags.at(ring_tag(number)).map_T_tag).norm();
  }
};

TEST(LostFrames, ThereIsNoneAtTheTruePoses) {
  Problem p;
  const auto before = p.lap.bundle.poses;
  EXPECT_FALSE(reinitialise_lost_frames(p.drive.lap, p.options, p.lap));
  EXPECT_FALSE(reinitialise_lost_tags(p.drive.lap, p.options, p.lap));
  for (std::size_t i = 0; i < before.size(); ++i)
    EXPECT_EQ(p.lap.bundle.poses[i].value.matrix(), before[i].value.matrix()) << i;
}

TEST(LostFrames, ASingleFrameIsReinitialisedByTagsAndNeighbours) {
  Problem p;
  p.base(kFrame) = kElsewhere * p.base(kFrame);
  EXPECT_TRUE(reinitialise_lost_frames(p.drive.lap, p.options, p.lap));
  EXPECT_LT(p.off(kFrame), 0.02);
  EXPECT_LT(p.off(kFrame - 1), 1e-12) << "its neighbours do not change";
}

TEST(LostFrames, ARunOfFramesIsReinitialised) {
  Problem p;
  for (std::size_t f = kFrame; f < kFrame + 12; ++f) p.base(f) = kElsewhere * p.base(f);
  EXPECT_TRUE(reinitialise_lost_frames(p.drive.lap, p.options, p.lap));
  for (std::size_t f = kFrame; f < kFrame + 12; ++f) EXPECT_LT(p.off(f), 0.05) << f;
}

TEST(LostFrames, ObservationsOfAReinitialisedFrameAreUsedAgain) {
  Problem p;
  p.base(kFrame) = kElsewhere * p.base(kFrame);
  for (CornerTerm& term : p.lap.bundle.corners) term.used = term.rig != *p.lap.bases[kFrame];
  p.lap.bundle.corners.front().used = false;
  p.lap.bundle.corners.front().unconfirmed = true;
  EXPECT_TRUE(reinitialise_lost_frames(p.drive.lap, p.options, p.lap));
  EXPECT_FALSE(p.lap.bundle.corners.front().used) << "an unconfirmed observation stays unused";
  EXPECT_TRUE(std::all_of(p.lap.bundle.corners.begin() + 1, p.lap.bundle.corners.end(),
                          [](const CornerTerm& term) { return term.used; }));
}

TEST(LostTags, ATagWithAWrongPoseIsReinitialised) {
  Problem p;
  p.tag(5) = kElsewhere * p.tag(5);
  EXPECT_TRUE(reinitialise_lost_tags(p.drive.lap, p.options, p.lap));
  EXPECT_LT(p.off_tag(5), 0.02);
  EXPECT_LT(p.off_tag(4), 1e-12);
}

TEST(LostTags, TheAnchorIsNeverMoved) {
  Problem p;
  p.tag(0) = kElsewhere * p.tag(0);
  EXPECT_FALSE(reinitialise_lost_tags(p.drive.lap, p.options, p.lap));
  EXPECT_GT(p.off_tag(0), 0.5);
}

TEST(LostTags, ATagWithMostlyConsistentObservationsIsNotMoved) {
  Problem p;
  int spoiled = 0;
  for (std::size_t i = 0; i < p.lap.bundle.corners.size(); ++i) {
    CornerTerm& term = p.lap.bundle.corners[i];
    if (term.tag != p.lap.tags.at(ring_tag(5)) || ++spoiled % 3 != 0) continue;
    for (Eigen::Vector2d& corner : term.factor.corners_px) corner.x() += 50;
  }
  ASSERT_GT(spoiled, 9);
  EXPECT_FALSE(reinitialise_lost_tags(p.drive.lap, p.options, p.lap));
  EXPECT_LT(p.off_tag(5), 1e-12);
}

TEST(UnconnectedTags, ArePlacedByKnownFramesAndRemovedFromTheList) {
  const RingDrive drive = drive_ring({.loops = 1});
  ChainResult start = true_start(drive);
  start.map.tags.erase(ring_tag(5));
  LapBundle lap = lap_bundle(drive.lap, start);
  std::vector<TagId> unconnected = {ring_tag(5), ring_tag(70)};
  EXPECT_TRUE(place_unconnected(drive.lap, {}, lap, unconnected));
  EXPECT_THAT(unconnected, ElementsAre(ring_tag(70))) << "it was not observed";
  ASSERT_TRUE(lap.tags.contains(ring_tag(5)));
  EXPECT_LT(minus(lap.bundle.poses[lap.tags.at(ring_tag(5))].value, drive.tags.tags.at(ring_tag(5)).map_T_tag)
                .norm(),
            0.02);
  EXPECT_FALSE(place_unconnected(drive.lap, {}, lap, unconnected));
}

TEST(UnconnectedTags, AreNotPlacedByThreeObservationsOrWithoutASize) {
  RingDrive drive = drive_ring({.loops = 1});
  ChainResult start = true_start(drive);
  start.map.tags.erase(ring_tag(5));
  int kept = 0;
  for (TagFrame& frame : drive.lap.frames) {
    std::erase_if(frame.detections,
                  [&](const TagDetection& d) { return d.tag == ring_tag(5) && ++kept > 3; });
  }
  LapBundle lap = lap_bundle(drive.lap, start);
  std::vector<TagId> unconnected = {ring_tag(5)};
  EXPECT_FALSE(place_unconnected(drive.lap, {}, lap, unconnected));
  RingDrive sizeless = drive_ring({.loops = 1});
  sizeless.lap.sizes.default_size_m.reset();
  for (int number = 0; number < 12; ++number) {
    if (number != 5) sizeless.lap.sizes.size_by_tag_m[ring_tag(number)] = 0.16;
  }
  LapBundle other = lap_bundle(sizeless.lap, start);
  EXPECT_FALSE(place_unconnected(sizeless.lap, {}, other, unconnected));
  EXPECT_THAT(unconnected, ElementsAre(ring_tag(5)));
}

}  // namespace
}  // namespace waymark::internal
