// Tests that observations with the id of another tag are assigned to the tag at their position if that tag is
// unambiguous.
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

/// A scene in which a frame in the middle shows at least three tags.
struct MisreadScene {
  RigScene made = rig_scene();
  std::size_t frame = 0;
  TagId is{};

  MisreadScene() {
    frame = made.recording.frames.size() / 2;
    while (detections().size() < 3) ++frame;
    is = detections()[1].tag;
  }
  std::vector<TagDetection>& detections() { return made.recording.frames[frame].views[0].detections; }
  /// A tag on the wall that is not in the frame.
  TagId absent() {
    for (std::size_t number = 0;; ++number) {
      if (std::ranges::count(detections(), rig_tag(number), &TagDetection::tag) == 0) return rig_tag(number);
    }
  }
  /// The map as it is after this observation has been rejected.
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

TEST(MisreadIds, ConsistentObservationsAreNotChanged) {
  SceneMap map = true_scene_map(rig_scene());
  EXPECT_EQ(correct_misread_ids(map, kGate), 0);
  EXPECT_TRUE(map.corrected_ids.empty());
}

TEST(MisreadIds, AreAssignedToTheTagAtTheirPosition) {
  MisreadScene changed;
  const TagId read = changed.absent();
  changed.detections()[1].tag = read;
  SceneMap map = changed.map(read);
  ASSERT_EQ(correct_misread_ids(map, kGate), 1);
  ASSERT_EQ(map.corrected_ids.size(), 1U);
  EXPECT_EQ(map.corrected_ids[0].frame, changed.frame);
  EXPECT_EQ(map.corrected_ids[0].read, read);
  EXPECT_EQ(map.corrected_ids[0].is, changed.is);
  EXPECT_TRUE(std::ranges::all_of(map.problem.bundle.corners, &CornerTerm::used)) << "the corrected one too";
  for (const double chi2 : corner_chi2(map.problem.bundle)) EXPECT_LT(chi2, 1e-3);
  for (std::size_t i = 0; i < map.observations.seen.size(); ++i)
    EXPECT_EQ(map.problem.bundle.corners[i].tag, map.problem.tags[0][map.observations.seen[i].tag]);
  EXPECT_EQ(correct_misread_ids(map, kGate), 0) << "corrected once";
}

TEST(MisreadIds, AreCorrectedInAnyOrderOfCorners) {
  for (int turn = 1; turn < 4; ++turn) {
    MisreadScene changed;
    const TagId read = changed.absent();
    TagDetection& detection = changed.detections()[1];
    detection.tag = read;
    std::ranges::rotate(detection.corners_px, detection.corners_px.begin() + turn);
    SceneMap map = changed.map(read);
    EXPECT_EQ(correct_misread_ids(map, kGate), 1) << turn;
    for (const double chi2 : corner_chi2(map.problem.bundle)) EXPECT_LT(chi2, 1e-3) << turn;
  }
}

TEST(MisreadIds, CornersFarFromAnyTagAreNotCorrected) {
  MisreadScene changed;
  const TagId read = changed.absent();
  TagDetection& detection = changed.detections()[1];
  detection.tag = read;
  for (Eigen::Vector2d& corner : detection.corners_px) corner += Eigen::Vector2d(25, -20);
  SceneMap map = changed.map(read);
  EXPECT_EQ(correct_misread_ids(map, kGate), 0);
}

TEST(MisreadIds, ATagAlreadyInTheViewIsNotAssignedAgain) {
  MisreadScene changed;
  const TagId read = changed.absent();
  TagDetection twice = changed.detections()[1];
  twice.tag = read;
  changed.detections().push_back(twice);
  SceneMap map = changed.map(read);
  EXPECT_EQ(correct_misread_ids(map, kGate), 0);
}

TEST(MisreadIds, AViewWithoutAcceptedObservationsIsNotCorrected) {
  MisreadScene changed;
  const TagId read = changed.absent();
  changed.detections()[1].tag = read;
  SceneMap map = changed.map(read);
  for (std::size_t i = 0; i < map.observations.seen.size(); ++i) {
    if (map.observations.seen[i].frame == changed.frame) map.problem.bundle.corners[i].used = false;
  }
  EXPECT_EQ(correct_misread_ids(map, kGate), 0);
}

TEST(MisreadIds, TwoTagsAtOnePositionAreAmbiguous) {
  MisreadScene changed;
  // A second tag at the same position, observed in the other frames.
  const std::size_t number = static_cast<std::size_t>(changed.is.number);
  std::size_t other = number == 0 ? 1 : number - 1;
  changed.made.tags[other] = changed.made.tags[number];
  for (SceneFrame& frame : changed.made.recording.frames) {
    auto& seen = frame.views[0].detections;
    std::erase_if(seen, [&](const TagDetection& d) { return d.tag == rig_tag(other); });
    const auto original = std::ranges::find(seen, changed.is, &TagDetection::tag);
    if (original == seen.end() || frame.stamp == changed.made.recording.frames[changed.frame].stamp) continue;
    TagDetection twin = *original;
    twin.tag = rig_tag(other);
    seen.push_back(twin);
  }
  TagId read = changed.absent();
  while (read == rig_tag(other) || read == changed.is) ++read.number;
  const auto there = std::ranges::find(changed.detections(), changed.is, &TagDetection::tag);
  ASSERT_NE(there, changed.detections().end());
  ASSERT_EQ(std::ranges::count(changed.detections(), read, &TagDetection::tag), 0);
  there->tag = read;
  SceneMap map = changed.map(read);
  EXPECT_EQ(correct_misread_ids(map, kGate), 0) << "both tags fit the observation";
}

}  // namespace
}  // namespace waymark
