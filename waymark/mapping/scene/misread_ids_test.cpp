// Observations with the id of another tag: they count for the tag that is there, where that is beyond doubt.
#include "waymark/mapping/scene/misread_ids.hpp"

#include <algorithm>

#include <gtest/gtest.h>

#include "tests/support/rig_scene.hpp"

namespace waymark {
namespace {

using test::rig_scene;
using test::rig_tag;
using test::RigScene;
using test::true_scene_map;

constexpr double kGate = 26;

/// A frame in the middle that shows at least three tags.
struct Spoilt {
  RigScene made = rig_scene();
  std::size_t frame = 0;
  TagId is{};

  Spoilt() {
    frame = made.recording.frames.size() / 2;
    while (detections().size() < 3) ++frame;
    is = detections()[1].tag;
  }
  std::vector<TagDetection>& detections() { return made.recording.frames[frame].views[0].detections; }
  /// A tag of the wall that the frame does not show.
  TagId absent() {
    for (std::size_t number = 0;; ++number) {
      if (std::ranges::count(detections(), rig_tag(number), &TagDetection::tag) == 0) return rig_tag(number);
    }
  }
  /// The map once this observation was found to contradict the rest.
  SceneMap map(const TagId& read) {
    SceneMap map = true_scene_map(made);
    for (std::size_t i = 0; i < map.observations.seen.size(); ++i) {
      const SceneObservation& seen = map.observations.seen[i];
      if (seen.frame == frame && map.scene.bodies[0].tags[seen.tag].id == read)
        map.problem.bundle.corners[i].used = false;
    }
    return map;
  }
};

TEST(MisreadIds, WhereNothingContradictsNothingIsCorrected) {
  SceneMap map = true_scene_map(rig_scene());
  EXPECT_EQ(correct_misread_ids(map, kGate), 0);
  EXPECT_TRUE(map.corrected_ids.empty());
}

TEST(MisreadIds, CountForTheTagThatIsThere) {
  Spoilt spoilt;
  const TagId read = spoilt.absent();
  spoilt.detections()[1].tag = read;
  SceneMap map = spoilt.map(read);
  ASSERT_EQ(correct_misread_ids(map, kGate), 1);
  ASSERT_EQ(map.corrected_ids.size(), 1U);
  EXPECT_EQ(map.corrected_ids[0].frame, spoilt.frame);
  EXPECT_EQ(map.corrected_ids[0].read, read);
  EXPECT_EQ(map.corrected_ids[0].is, spoilt.is);
  EXPECT_TRUE(std::ranges::all_of(map.problem.bundle.corners, &CornerTerm::used)) << "from then on";
  for (const double chi2 : corner_chi2(map.problem.bundle)) EXPECT_LT(chi2, 1e-3);
  for (std::size_t i = 0; i < map.observations.seen.size(); ++i)
    EXPECT_EQ(map.problem.bundle.corners[i].tag, map.problem.tags[0][map.observations.seen[i].tag]);
  EXPECT_EQ(correct_misread_ids(map, kGate), 0) << "once";
}

TEST(MisreadIds, TheOrderOfTheirCornersMayBeAnyTurn) {
  for (int turn = 1; turn < 4; ++turn) {
    Spoilt spoilt;
    const TagId read = spoilt.absent();
    TagDetection& detection = spoilt.detections()[1];
    detection.tag = read;
    std::ranges::rotate(detection.corners_px, detection.corners_px.begin() + turn);
    SceneMap map = spoilt.map(read);
    EXPECT_EQ(correct_misread_ids(map, kGate), 1) << turn;
    for (const double chi2 : corner_chi2(map.problem.bundle)) EXPECT_LT(chi2, 1e-3) << turn;
  }
}

TEST(MisreadIds, CornersWhereNoTagIsStayWhatTheyAre) {
  Spoilt spoilt;
  const TagId read = spoilt.absent();
  TagDetection& detection = spoilt.detections()[1];
  detection.tag = read;
  for (Eigen::Vector2d& corner : detection.corners_px) corner += Eigen::Vector2d(25, -20);
  SceneMap map = spoilt.map(read);
  EXPECT_EQ(correct_misread_ids(map, kGate), 0);
}

TEST(MisreadIds, ATagThatTheViewShowsAlreadyIsNotThereTwice) {
  Spoilt spoilt;
  const TagId read = spoilt.absent();
  TagDetection twice = spoilt.detections()[1];
  twice.tag = read;
  spoilt.detections().push_back(twice);
  SceneMap map = spoilt.map(read);
  EXPECT_EQ(correct_misread_ids(map, kGate), 0);
}

TEST(MisreadIds, AViewOfWhichNothingAgreesTellsNothing) {
  Spoilt spoilt;
  const TagId read = spoilt.absent();
  spoilt.detections()[1].tag = read;
  SceneMap map = spoilt.map(read);
  for (std::size_t i = 0; i < map.observations.seen.size(); ++i) {
    if (map.observations.seen[i].frame == spoilt.frame) map.problem.bundle.corners[i].used = false;
  }
  EXPECT_EQ(correct_misread_ids(map, kGate), 0);
}

TEST(MisreadIds, TwoTagsThatLieOnEachOtherLeaveItOpen) {
  Spoilt spoilt;
  // Another tag in the place of the one that is there, seen in the frames around.
  const std::size_t number = static_cast<std::size_t>(spoilt.is.number);
  std::size_t other = number == 0 ? 1 : number - 1;
  spoilt.made.tags[other] = spoilt.made.tags[number];
  for (SceneFrame& frame : spoilt.made.recording.frames) {
    auto& seen = frame.views[0].detections;
    std::erase_if(seen, [&](const TagDetection& d) { return d.tag == rig_tag(other); });
    const auto original = std::ranges::find(seen, spoilt.is, &TagDetection::tag);
    if (original == seen.end() || frame.stamp == spoilt.made.recording.frames[spoilt.frame].stamp) continue;
    TagDetection twin = *original;
    twin.tag = rig_tag(other);
    seen.push_back(twin);
  }
  TagId read = spoilt.absent();
  while (read == rig_tag(other) || read == spoilt.is) ++read.number;
  const auto there = std::ranges::find(spoilt.detections(), spoilt.is, &TagDetection::tag);
  ASSERT_NE(there, spoilt.detections().end());
  ASSERT_EQ(std::ranges::count(spoilt.detections(), read, &TagDetection::tag), 0);
  there->tag = read;
  SceneMap map = spoilt.map(read);
  EXPECT_EQ(correct_misread_ids(map, kGate), 0) << "either may be meant";
}

}  // namespace
}  // namespace waymark
