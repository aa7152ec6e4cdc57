// Which observations of a lap nothing else confirms: misread ids, and none that are right.
#include "waymark/mapping/lap/lap_confirmation.hpp"

#include <algorithm>
#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/ring_drive.hpp"

namespace waymark::internal {
namespace {

using test::drive_ring;
using test::observed_frames;
using test::ring_tag;
using test::RingDrive;
using ::testing::IsEmpty;

std::vector<ObservationIndex> unconfirmed(const RingDrive& drive) {
  return unconfirmed_observations(drive.lap, observed_frames(drive.lap));
}

/// Gives a share of the detections the id of another tag of the ring; which.
std::set<ObservationIndex> misread(RingDrive& drive, double share, std::uint64_t seed) {
  Random random(seed);
  std::set<ObservationIndex> wrong;
  for (std::size_t f = 0; f < drive.lap.frames.size(); ++f) {
    auto& detections = drive.lap.frames[f].detections;
    for (std::size_t d = 0; d < detections.size(); ++d) {
      if (random.uniform() >= share) continue;
      const int number = (detections[d].tag.number + 3 + static_cast<int>(random.index(6))) % 12;
      if (std::ranges::count(detections, ring_tag(number), &TagDetection::tag) > 0) continue;
      detections[d].tag = ring_tag(number);
      wrong.insert({f, d});
    }
  }
  return wrong;
}

TEST(LapConfirmation, WhatIsRightIsConfirmed) {
  EXPECT_THAT(unconfirmed(drive_ring({.corner_sigma_px = 0.1, .noise_px = 0.1})), IsEmpty());
  EXPECT_THAT(unconfirmed(drive_ring({.rear = true})), IsEmpty());
}

TEST(LapConfirmation, MisreadIdsAreNotAndNothingElseIsInDoubt) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    RingDrive drive = drive_ring({.corner_sigma_px = 0.1, .noise_px = 0.1, .seed = seed});
    const std::set<ObservationIndex> wrong = misread(drive, 0.03, seed);
    ASSERT_GE(wrong.size(), 4U);
    const auto found = unconfirmed(drive);
    EXPECT_TRUE(std::ranges::is_sorted(found)) << "in order";
    for (const ObservationIndex& index : found)
      EXPECT_TRUE(wrong.contains(index)) << seed << ": frame " << index.frame;
    EXPECT_GE(static_cast<double>(found.size()), 0.8 * static_cast<double>(wrong.size())) << seed;
  }
}

TEST(LapConfirmation, WithoutWheelsNeighboursInThePictureConfirm) {
  RingDrive drive = drive_ring({.corner_sigma_px = 0.1, .noise_px = 0.1});
  const std::set<ObservationIndex> wrong = misread(drive, 0.03, 4);
  drive.lap.odometry.clear();
  const auto found = unconfirmed(drive);
  std::size_t right = 0;
  for (const ObservationIndex& index : found) {
    if (wrong.contains(index)) continue;
    ++right;
    const bool beside = std::ranges::any_of(wrong, [&](const auto& w) { return w.frame == index.frame; });
    EXPECT_TRUE(beside) << "what is right is in doubt beside a wrong one alone: frame " << index.frame;
  }
  EXPECT_GE(static_cast<double>(found.size() - right), 0.6 * static_cast<double>(wrong.size()));
}

TEST(LapConfirmation, AnIdSeenOnceAmongOthersIsInDoubt) {
  RingDrive drive = drive_ring();
  auto& detections = drive.lap.frames[40].detections;
  ASSERT_GE(detections.size(), 2U);
  detections[1].tag = ring_tag(300);
  EXPECT_EQ(unconfirmed(drive), (std::vector<ObservationIndex>{{40, 1}}));
}

TEST(LapConfirmation, DetectionsWithoutAPoseDoNotShiftTheOthers) {
  RingDrive drive = drive_ring();
  auto& detections = drive.lap.frames[40].detections;
  ASSERT_GE(detections.size(), 2U);
  detections[0].corners_px[1] = detections[0].corners_px[2] = detections[0].corners_px[0];
  detections[1].tag = ring_tag(300);
  EXPECT_EQ(unconfirmed(drive), (std::vector<ObservationIndex>{{40, 1}}));
}

TEST(LapConfirmation, OfNothingNothingIsInDoubt) {
  EXPECT_THAT(unconfirmed_observations({.camera = test::ring_camera()}, {}), IsEmpty());
}

}  // namespace
}  // namespace waymark::internal
