// Tests corners from a rolling shutter that are transformed to the time of the middle row.
#include "waymark/mapping/scene/rolling_corners.hpp"

#include <algorithm>

#include <gtest/gtest.h>

#include "tests/support/rig_scene.hpp"

namespace waymark {
namespace {

using test::rig_scene;
using test::RigScene;
using test::RigShape;
using test::true_scene_map;

constexpr double kReadout_s = 0.03;

/// The largest distance between a corner in use and its position with a global shutter.
double worst_px(const SceneMap& map, const RigScene& made) {
  RigScene global = made;
  global.shape.readout_s = 0;
  double worst = 0;
  for (std::size_t i = 0; i < map.observations.seen.size(); ++i) {
    const CornerTerm& term = map.problem.bundle.corners[i];
    if (!term.used) continue;
    const SceneObservation& seen = map.observations.seen[i];
    const auto number = static_cast<std::size_t>(map.scene.bodies[0].tags[seen.tag].id.number);
    const auto corners = test::rig_corners(global, seen.camera, seen.frame, made.tags[number]);
    for (std::size_t k = 0; corners && k < 4; ++k)
      worst = std::max(worst, (term.factor.corners_px[k] - (*corners)[k]).norm());
  }
  return worst;
}

TEST(RollingCorners, AGlobalShutterIsNotCorrected) {
  SceneMap map = true_scene_map(rig_scene());
  const auto before = map.problem.bundle.corners;
  EXPECT_EQ(bring_corners_to_middle(rig_scene().recording, map), 0);
  for (std::size_t i = 0; i < before.size(); ++i)
    EXPECT_EQ(map.problem.bundle.corners[i].factor.corners_px, before[i].factor.corners_px);
}

TEST(RollingCorners, EqualThoseOfAGlobalShutter) {
  for (const double readout_s : {kReadout_s, -kReadout_s}) {
    const RigScene made = rig_scene({.frames = 60, .step_s = 0.05, .readout_s = readout_s});
    SceneMap map = true_scene_map(made);
    const double before = worst_px(map, made);
    EXPECT_GT(before, 2) << "a hand moves by pixels during the readout";
    const double moved = bring_corners_to_middle(made.recording, map);
    EXPECT_NEAR(moved, before, 0.5 * before);
    EXPECT_LT(worst_px(map, made), 0.02 * before);
  }
}

TEST(RollingCorners, ASecondCallChangesHardlyAnything) {
  const RigScene made = rig_scene({.frames = 60, .step_s = 0.05, .readout_s = kReadout_s});
  SceneMap map = true_scene_map(made);
  bring_corners_to_middle(made.recording, map);
  EXPECT_LT(bring_corners_to_middle(made.recording, map), 1e-9) << "computed from the measured corners";
}

TEST(RollingCorners, AFrameWithoutANeighbourIsExcluded) {
  RigScene made = rig_scene({.frames = 20, .step_s = 0.05, .readout_s = kReadout_s});
  // The last frame is half a second later.
  made.recording.frames.back().stamp += std::chrono::milliseconds(500);
  SceneMap map = true_scene_map(made);
  bring_corners_to_middle(made.recording, map);
  const std::size_t last = made.recording.frames.size() - 1;
  for (std::size_t f = 0; f < made.recording.frames.size(); ++f)
    EXPECT_EQ(map.placed[map.problem.bodies[1][f]] != 0, f != last) << f;
  for (std::size_t i = 0; i < map.observations.seen.size(); ++i)
    EXPECT_EQ(map.problem.bundle.corners[i].used, map.observations.seen[i].frame != last);
}

TEST(RollingCorners, OnlyCamerasWithARollingShutterAreCorrected) {
  RigScene made = rig_scene({.frames = 30, .cameras = 2, .step_s = 0.05, .readout_s = kReadout_s});
  made.scene.cameras[1].readout_s = 0;
  SceneMap map = true_scene_map(made);
  const auto before = map.problem.bundle.corners;
  EXPECT_GT(bring_corners_to_middle(made.recording, map), 1);
  for (std::size_t i = 0; i < before.size(); ++i) {
    const bool same = map.problem.bundle.corners[i].factor.corners_px == before[i].factor.corners_px;
    if (map.observations.seen[i].camera == 1) {
      EXPECT_TRUE(same) << i;
    }
  }
}

TEST(RollingCorners, ATagThatIsNotPlacedIsNotCorrected) {
  const RigScene made = rig_scene({.step_s = 0.05, .readout_s = kReadout_s});
  SceneMap map = true_scene_map(made);
  const PoseIndex tag = map.problem.tags[0][3];
  map.placed[tag] = 0;
  const auto before = map.problem.bundle.corners;
  bring_corners_to_middle(made.recording, map);
  for (std::size_t i = 0; i < before.size(); ++i) {
    if (before[i].tag == tag) {
      EXPECT_EQ(map.problem.bundle.corners[i].factor.corners_px, before[i].factor.corners_px);
    }
  }
}

}  // namespace
}  // namespace waymark
