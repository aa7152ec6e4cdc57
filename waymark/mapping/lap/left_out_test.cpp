// Why an observation contradicts a map, by what it shows.
#include "waymark/mapping/lap/left_out.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/ring_drive.hpp"

namespace waymark {
namespace {

using test::drive_ring;
using test::ring_tag;
using test::RingDrive;
using test::true_map;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr std::size_t kFrame = 40;

/// The detection of the first tag that a frame shows.
TagDetection& seen_in(RingDrive& drive, std::size_t frame = kFrame) {
  return drive.lap.frames[frame].detections.front();
}

LeftOutCounts counts_of(const RingDrive& drive, const TagId& tag) {
  BundleMap map = true_map(drive);
  test::reject(drive, tag, kFrame, kFrame + 1, map);
  return left_out_by_tag(drive.lap, map).at(tag);
}

TEST(LeftOut, ATagThatIsWhereItShouldBeHadInexactCorners) {
  RingDrive drive = drive_ring();
  EXPECT_EQ(counts_of(drive, seen_in(drive).tag), (LeftOutCounts{0, 0, 1, 0}));
}

TEST(LeftOut, AnotherTagUnderThisIdIsElsewhere) {
  RingDrive drive = drive_ring();
  auto& detections = drive.lap.frames[kFrame].detections;
  ASSERT_GE(detections.size(), 2U);
  std::swap(detections[0].tag, detections[1].tag);
  EXPECT_EQ(counts_of(drive, detections[0].tag), (LeftOutCounts{1, 0, 0, 0}));
}

TEST(LeftOut, AnIdThatIsNotInTheMapIsElsewhere) {
  RingDrive drive = drive_ring();
  seen_in(drive).tag = ring_tag(99);
  EXPECT_EQ(counts_of(drive, ring_tag(99)), (LeftOutCounts{1, 0, 0, 0}));
}

TEST(LeftOut, CornersThatAreNoSquareGiveNoPoseAndSoDoesAFrameWithoutOne) {
  RingDrive drive = drive_ring();
  TagDetection& seen = seen_in(drive);
  seen.corners_px[1] = seen.corners_px[2] = seen.corners_px[0];
  EXPECT_EQ(counts_of(drive, seen.tag), (LeftOutCounts{0, 0, 0, 1}));
  RingDrive lost = drive_ring();
  BundleMap map = true_map(lost);
  test::reject(lost, seen_in(lost).tag, kFrame, kFrame + 1, map);
  map.trajectory.erase(map.trajectory.begin() + kFrame);
  EXPECT_EQ(left_out_by_tag(lost.lap, map).at(seen_in(lost).tag), (LeftOutCounts{0, 0, 0, 1}));
}

TEST(LeftOut, ATagThatStandsAsItsOtherPoseIsToldFromOneThatWasMoved) {
  RingDrive drive = drive_ring();
  const TagId tag = seen_in(drive).tag;
  BundleMap map = true_map(drive);
  // The map has the tag turned to the mirror image of its pose about the line of sight.
  const SE3 map_T_cam = drive.truth[kFrame].map_T_base * drive.lap.base_T_cam;
  const SE3 cam_T_tag = map_T_cam.inverse() * drive.tags.tags.at(tag).map_T_tag;
  const auto observed = observe(drive.lap.frames[kFrame], drive.lap);
  const auto of_tag = std::ranges::find(observed.tags, tag, &TagPoseObservation::tag);
  ASSERT_NE(of_tag, observed.tags.end());
  ASSERT_TRUE(of_tag->other) << "seen from too near for two poses";
  EXPECT_LT((of_tag->cam_T_tag.translation() - cam_T_tag.translation()).norm(), 0.01);
  map.map.tags.at(tag).map_T_tag = map_T_cam * of_tag->other->cam_T_tag;
  test::reject(drive, tag, kFrame, kFrame + 1, map);
  const LeftOutCounts counts = left_out_by_tag(drive.lap, map).at(tag);
  EXPECT_EQ(counts[static_cast<std::size_t>(LeftOutReason::OtherPose)], 1);
}

TEST(LeftOut, OfAnIdThatIsTwiceInAFrameTheWorseIsMeant) {
  RingDrive drive = drive_ring();
  auto& detections = drive.lap.frames[kFrame].detections;
  ASSERT_GE(detections.size(), 2U);
  detections[1].tag = detections[0].tag;
  BundleMap map = true_map(drive);
  map.rejected.push_back({drive.lap.frames[kFrame].stamp, detections[0].tag, 1e6});
  EXPECT_EQ(left_out_by_tag(drive.lap, map).at(detections[0].tag), (LeftOutCounts{1, 0, 0, 0}));
}

TEST(LeftOut, EveryReasonHasItsWord) {
  const std::vector<std::string> words = {"elsewhere", "other_pose", "inexact_corners", "no_pose"};
  for (std::size_t i = 0; i < kLeftOutReasons; ++i)
    EXPECT_EQ(to_string(static_cast<LeftOutReason>(i)), words[i]);
}

TEST(LeftOut, OnlyManyAreWorthASentenceWhichNamesTheTagsThatLostMost) {
  const RingDrive drive = drive_ring();
  BundleMap map = true_map(drive);
  int all = 0;
  for (const auto& [id, count] : map.observations) all += count;
  std::vector<std::string> words;
  internal::check_observations(drive.lap, map, words);
  EXPECT_THAT(words, IsEmpty());
  test::reject(drive, ring_tag(3), 0, drive.lap.frames.size(), map);
  const auto rejected = map.rejected.size();
  ASSERT_GT(static_cast<double>(rejected), 0.03 * all);
  internal::check_observations(drive.lap, map, words);
  EXPECT_THAT(
      words, ElementsAre(
                 AllOf(HasSubstr(std::to_string(rejected) + " of " + std::to_string(all) + " observations"),
                       HasSubstr(std::to_string(rejected) + " have inexact corners"),
                       HasSubstr("most of tag36h11:3 (" + std::to_string(rejected) + " of " +
                                 std::to_string(rejected) + ": " + std::to_string(rejected) + " inexact)"))));
  words.clear();
  internal::check_observations({.camera = test::ring_camera()}, {}, words);
  EXPECT_THAT(words, IsEmpty());
}

}  // namespace
}  // namespace waymark
