// Tests which tags only their prior places.
#include "waymark/mapping/scene/prior_checks.hpp"

#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/rig_scene.hpp"

namespace waymark {
namespace {

using test::exactly;
using test::rig_scene;
using test::rig_tag;
using test::RigScene;
using test::true_scene_map;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::Pair;

/// Tag 7 has a prior, and images that show it show no other tag.
RigScene with_a_lonely_tag() {
  RigScene made = rig_scene();
  made.scene.bodies[0].tags[7].body_T_tag = exactly(made.tags[7]);
  for (SceneFrame& frame : made.recording.frames) {
    for (SceneView& view : frame.views) {
      const auto lonely = [](const TagDetection& seen) { return seen.tag == rig_tag(7); };
      if (std::ranges::any_of(view.detections, lonely))
        std::erase_if(view.detections, [&](const TagDetection& seen) { return !lonely(seen); });
    }
  }
  return made;
}

int observations_of_tag_7(const RigScene& made) {
  int count = 0;
  for (const SceneFrame& frame : made.recording.frames) {
    for (const SceneView& view : frame.views)
      count += static_cast<int>(std::ranges::count(view.detections, rig_tag(7), &TagDetection::tag));
  }
  return count;
}

TEST(TagsOnPriorAlone, IsATagThatIsNeverSeenWithAnother) {
  const RigScene made = with_a_lonely_tag();
  const int count = observations_of_tag_7(made);
  ASSERT_GT(count, 0);
  EXPECT_THAT(tags_on_prior_alone(true_scene_map(made)), ElementsAre(Pair(rig_tag(7), count)));
}

TEST(TagsOnPriorAlone, IsNoTagThatIsSeenWithOthers) {
  RigScene made = rig_scene();
  made.scene.bodies[0].tags[7].body_T_tag = exactly(made.tags[7]);
  EXPECT_THAT(tags_on_prior_alone(true_scene_map(made)), IsEmpty());
}

TEST(TagsOnPriorAlone, MotionBetweenFramesConnects) {
  RigScene made = with_a_lonely_tag();
  made.scene.bodies[1].stays_put = SceneMotionNoise{.sigma_m = 0.1, .sigma_rad = 0.1};
  EXPECT_THAT(tags_on_prior_alone(true_scene_map(made)), IsEmpty());
}

TEST(TagsOnPriorAlone, AGivenDistanceConnects) {
  RigScene made = with_a_lonely_tag();
  const double true_m = (made.tags[7].translation() - made.tags[0].translation()).norm();
  made.scene.distances = {{7, 0, -1, -1, true_m, 0.01}};
  EXPECT_THAT(tags_on_prior_alone(true_scene_map(made)), IsEmpty());
}

}  // namespace
}  // namespace waymark
