// Tests initial poses if only some poses are known. Poses are placed using corners, bridged by motions,
// selected by votes, and re-initialised if most observations are inconsistent with them.
#include "waymark/mapping/scene/place_poses.hpp"

#include <algorithm>

#include <gtest/gtest.h>

#include "tests/support/rig_scene.hpp"
#include "waymark/geometry/lie.hpp"

namespace waymark {
namespace {

using test::at;
using test::rig_scene;
using test::RigScene;
using test::true_scene_map;

/// A problem, its true poses, and the known poses (static bodies, cameras and the first tag).
struct Start {
  SceneMap map;
  std::vector<SE3> truth{};
  std::vector<KnownPose> known{};

  explicit Start(const RigScene& made) : map(true_scene_map(made)) {
    for (const BundlePose& pose : map.problem.bundle.poses) truth.push_back(pose.value);
    known.resize(truth.size());
    for (std::size_t i = 0; i < known.size(); ++i) known[i].moves = map.problem.moves[i] != 0;
    for (const PoseIndex pose : map.problem.cameras) set_known(pose);
    set_known(map.problem.bodies[0].front());
    set_known(map.problem.tags[0][0]);
  }
  void set_known(PoseIndex pose) { known[pose] = {true, Matrix6(1e-8 * Matrix6::Identity()), false}; }
  /// Resets poses that are not known.
  void reset_unknown() {
    for (std::size_t i = 0; i < known.size(); ++i) {
      if (!known[i].placed) bundle().poses[i].value = SE3();
    }
  }
  Bundle& bundle() { return map.problem.bundle; }
  double off(PoseIndex pose) { return minus(bundle().poses[pose].value, truth[pose]).norm(); }
};

TEST(PlacePoses, PlacesEverythingFromOneTag) {
  Start start(rig_scene());
  start.reset_unknown();
  const std::vector<char> placed = place_poses(start.bundle(), start.known);
  EXPECT_EQ(std::ranges::count(placed, 0), 0);
  for (std::size_t i = 0; i < start.truth.size(); ++i) EXPECT_LT(start.off(i), 0.05) << i;
  EXPECT_TRUE(std::ranges::all_of(start.bundle().corners, &CornerTerm::used));
}

TEST(PlacePoses, PlacesASecondCameraByCommonTags) {
  Start start(rig_scene({.cameras = 2}));
  start.known[start.map.problem.cameras[1]] = {};
  start.reset_unknown();
  const std::vector<char> placed = place_poses(start.bundle(), start.known);
  EXPECT_NE(placed[start.map.problem.cameras[1]], 0);
  EXPECT_LT(start.off(start.map.problem.cameras[1]), 0.05);
}

TEST(PlacePoses, PlacesNothingWithoutAKnownPose) {
  Start start(rig_scene());
  for (KnownPose& pose : start.known) pose.placed = false;
  const std::vector<char> placed = place_poses(start.bundle(), start.known);
  EXPECT_EQ(std::ranges::count(placed, 1), 0);
  EXPECT_TRUE(std::ranges::none_of(start.bundle().corners, &CornerTerm::used))
      << "their poses are not placed";
}

TEST(PlacePoses, BridgesEmptyFramesByMeasuredMotion) {
  RigScene made = rig_scene();
  for (std::size_t f = 10; f < 14; ++f) made.recording.frames[f].views[0].detections.clear();
  for (std::size_t f = 0; f < made.rig.size(); ++f)
    made.recording.odometry.push_back(
        {made.recording.frames[f].stamp, 1, at(5, 1, 0, 0, 0, 2) * made.rig[f]});
  made.scene.bodies[1].odometry = {.sigma_m = 0.01, .sigma_rad = 0.01};
  Start start(made);
  start.reset_unknown();
  const std::vector<char> placed = place_poses(start.bundle(), start.known);
  for (std::size_t f = 0; f < made.rig.size(); ++f) {
    const PoseIndex pose = start.map.problem.bodies[1][f];
    EXPECT_NE(placed[pose], 0) << f;
    EXPECT_LT(start.off(pose), 0.05) << f;
  }
  made.recording.odometry.clear();
  Start without(made);
  without.reset_unknown();
  const std::vector<char> fewer = place_poses(without.bundle(), without.known);
  for (std::size_t f = 10; f < 14; ++f) EXPECT_EQ(fewer[without.map.problem.bodies[1][f]], 0) << f;
}

/// A rig that sees tags 0 to 3, then nothing, then tags 4 to 7, with odometry of this accuracy.
RigScene tied_by_odometry(double sigma_m, double sigma_rad) {
  RigScene made = rig_scene();
  for (std::size_t f = 0; f < made.rig.size(); ++f) {
    std::erase_if(made.recording.frames[f].views[0].detections, [&](const TagDetection& seen) {
      return f < 10 ? seen.tag.number > 3 : f < 14 || seen.tag.number < 4;
    });
    made.recording.odometry.push_back(
        {made.recording.frames[f].stamp, 1, at(5, 1, 0, 0, 0, 2) * made.rig[f]});
  }
  made.scene.bodies[1].odometry = {.sigma_m = sigma_m, .sigma_rad = sigma_rad};
  return made;
}

TEST(PlacePoses, PlacesTagsThatOnlyMotionsConnect) {
  for (const int min_votes : {1, 2}) {
    Start start(tied_by_odometry(0.01, 0.01));
    start.reset_unknown();
    const std::vector<char> placed = place_poses(start.bundle(), start.known, {.min_votes = min_votes});
    EXPECT_EQ(std::ranges::count(placed, 0), 0);
    for (std::size_t i = 0; i < start.truth.size(); ++i) EXPECT_LT(start.off(i), 0.05) << i;
    EXPECT_TRUE(std::ranges::all_of(start.bundle().corners, &CornerTerm::used));
  }
}

TEST(PlacePoses, PlacesFramesButNoTagsByMotionsWithoutInformation) {
  Start start(tied_by_odometry(5, 1));
  start.reset_unknown();
  const std::vector<char> placed = place_poses(start.bundle(), start.known);
  for (std::size_t t = 0; t < 8; ++t) EXPECT_EQ(placed[start.map.problem.tags[0][t]] != 0, t < 4) << t;
  for (const PoseIndex frame : start.map.problem.bodies[1]) EXPECT_NE(placed[frame], 0);
}

TEST(PlacePoses, ASingleBadViewIsNotDecisive) {
  RigScene made = rig_scene();
  // In the first frame with tag 4, its corners are those of tag 5.
  for (SceneFrame& frame : made.recording.frames) {
    auto& seen = frame.views[0].detections;
    const auto four = std::ranges::find(seen, test::rig_tag(4), &TagDetection::tag);
    const auto five = std::ranges::find(seen, test::rig_tag(5), &TagDetection::tag);
    if (four == seen.end() || five == seen.end()) continue;
    four->corners_px = five->corners_px;
    break;
  }
  Start start(made);
  start.reset_unknown();
  place_poses(start.bundle(), start.known);
  EXPECT_LT(start.off(start.map.problem.tags[0][4]), 0.05);
}

TEST(PlacePoses, UnconfirmedTermsVoteOnlyAsALastResort) {
  const RigScene made = rig_scene();
  Start start(made);
  const PoseIndex tag = start.map.problem.tags[0][4];
  for (CornerTerm& term : start.bundle().corners) term.unconfirmed = term.tag == tag;
  start.reset_unknown();
  const std::vector<char> placed = place_poses(start.bundle(), start.known);
  EXPECT_NE(placed[tag], 0) << "it has only unconfirmed observations";
  EXPECT_LT(start.off(tag), 0.05);
  start.reset_unknown();
  const std::vector<char> strict = place_poses(start.bundle(), start.known, {.min_unconfirmed_votes = 1000});
  EXPECT_EQ(strict[tag], 0);
}

TEST(PlacePoses, ATagWithTooFewAgreeingViewsIsNotPlaced) {
  RigScene made = rig_scene();
  int kept = 0;
  for (SceneFrame& frame : made.recording.frames) {
    std::erase_if(frame.views[0].detections,
                  [&](const TagDetection& d) { return d.tag == test::rig_tag(4) && ++kept > 1; });
  }
  Start start(made);
  start.reset_unknown();
  const PoseIndex tag = start.map.problem.tags[0][4];
  EXPECT_EQ(place_poses(start.bundle(), start.known, {.min_votes = 2})[tag], 0);
  for (const CornerTerm& term : start.bundle().corners) EXPECT_EQ(term.used, term.tag != tag);
}

TEST(PlacePoses, IsDeterministic) {
  Start a(rig_scene({.noise_px = 0.3}));
  Start b(rig_scene({.noise_px = 0.3}));
  a.reset_unknown();
  b.reset_unknown();
  EXPECT_EQ(place_poses(a.bundle(), a.known), place_poses(b.bundle(), b.known));
  for (std::size_t i = 0; i < a.truth.size(); ++i)
    EXPECT_EQ(a.bundle().poses[i].value.matrix(), b.bundle().poses[i].value.matrix()) << i;
}

TEST(ReplaceContradicted, MovesOnlyWrongPoses) {
  Start start(rig_scene());
  const std::vector<char> placed(start.truth.size(), 1);
  EXPECT_EQ(replace_contradicted(start.bundle(), placed, start.known, 100), 0) << "at the true poses";
  const PoseIndex tag = start.map.problem.tags[0][4];
  const PoseIndex rig = start.map.problem.bodies[1][12];
  start.bundle().poses[tag].value = at(0.5, 0.3, 0.2, 0.4) * start.truth[tag];
  EXPECT_EQ(replace_contradicted(start.bundle(), placed, start.known, 100), 1);
  EXPECT_LT(start.off(tag), 0.05);
  start.bundle().poses[rig].value = at(0.5, -0.3, 0.2, 0, 0.3) * start.truth[rig];
  EXPECT_EQ(replace_contradicted(start.bundle(), placed, start.known, 100), 1);
  EXPECT_LT(start.off(rig), 0.05);
}

TEST(ReplaceContradicted, KeepsFixedAndUnplacedPoses) {
  Start start(rig_scene());
  const PoseIndex tag = start.map.problem.tags[0][4];
  start.bundle().poses[tag] = {at(1, 0, 0) * start.truth[tag], true};
  std::vector<char> placed(start.truth.size(), 1);
  const SE3 before = start.bundle().poses[tag].value;
  replace_contradicted(start.bundle(), placed, start.known, 100);
  EXPECT_EQ(start.bundle().poses[tag].value.matrix(), before.matrix());
  placed[tag] = 0;
  replace_contradicted(start.bundle(), placed, start.known, 100);
  for (const CornerTerm& term : start.bundle().corners) EXPECT_EQ(term.used, term.tag != tag);
}

}  // namespace
}  // namespace waymark
