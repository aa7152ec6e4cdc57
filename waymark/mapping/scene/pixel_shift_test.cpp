#include "waymark/mapping/scene/pixel_shift.hpp"

#include <gtest/gtest.h>

#include "tests/support/rig_scene.hpp"

namespace waymark {
namespace {

using test::at;
using test::rig_scene;
using test::RigScene;
using test::true_scene_map;

TEST(LargestShift, IsTheMovementOfAnObservedCorner) {
  const RigScene made = rig_scene();
  const SceneMap map = true_scene_map(made);
  const Bundle& bundle = map.problem.bundle;
  const PoseIndex camera = map.problem.cameras[0];
  const auto shift = [&](double turn_rad) {
    return largest_shift_px(bundle, camera, bundle.poses[camera].value * at(0, 0, 0, 0, turn_rad));
  };
  EXPECT_NEAR(shift(0).value(), 0, 1e-9);
  EXPECT_NEAR(shift(1e-4).value() / shift(1e-5).value(), 10, 0.01) << "linear for small turns";
  EXPECT_GE(shift(1e-3).value(), 0.44) << "a focal length of 442 px";
  EXPECT_LT(shift(1e-3).value(), 1.5);
  Bundle unseen = bundle;
  for (CornerTerm& term : unseen.corners) term.used = false;
  EXPECT_FALSE(largest_shift_px(unseen, camera, SE3()));
}

}  // namespace
}  // namespace waymark
