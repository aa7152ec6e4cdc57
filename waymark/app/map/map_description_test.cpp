// What a user says of a map, as a job.
#include "waymark/app/map/map_description.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "waymark/app/scene/map_scene.hpp"

namespace waymark {
namespace {

using ::testing::HasSubstr;

std::string refusal(const MapDescription& of) {
  MapJob job;
  Status status = describe_map(of, job);
  if (status) status = read_described_maps(of, job);
  return status ? "" : to_string(status.error());
}

TEST(MapDescription, BecomesMethodAnchorAndSizes) {
  MapJob job;
  ASSERT_TRUE(describe_map({.method = "chain", .anchor = "7", .tag_sizes = {"0.16", "9=0.08"}}, job));
  EXPECT_EQ(job.options.method, MapMethod::Chain);
  EXPECT_EQ(job.overrides.anchor, "7");
  EXPECT_EQ(job.overrides.tag_size_m, 0.16);
  EXPECT_EQ(job.overrides.size_by_tag_m.at({FamilyId::Tag36h11, 9}), 0.08);
  EXPECT_FALSE(job.truth);
  ASSERT_TRUE(describe_map({.world = "circuit24"}, job));
  EXPECT_EQ(job.truth->name, "circuit24");
  EXPECT_EQ(refusal({}), "");
}

TEST(MapDescription, WhatDoesNotGoTogetherIsNamedByItsFlag) {
  EXPECT_THAT(refusal({.method = "magic"}), HasSubstr("magic"));
  EXPECT_EQ(refusal({.anchor = "3", .extend = "map"}),
            "(--anchor): the map that is extended says where its tags stand. Leave it out.");
  EXPECT_THAT(refusal({.anchor_pose = {0, 0, 0, 0, 0, 0}, .extend = "map"}), HasSubstr("(--anchor-pose)"));
  EXPECT_THAT(refusal({.route_name = "kitchen"}), HasSubstr("(--route-name)"));
  EXPECT_THAT(refusal({.freeze = {"3"}}), HasSubstr("(--freeze)"));
  EXPECT_THAT(refusal({.prior = "/nowhere/map.yaml"}), HasSubstr("/nowhere/map.yaml"));
  EXPECT_THAT(refusal({.world = "nowhere"}), HasSubstr("nowhere"));
}

TEST(SceneDescription, TheModelOfTagslamTakesTheCamerasAsGiven) {
  MapSceneJob job;
  ASSERT_TRUE(describe_scene("tagslam", false, job));
  EXPECT_EQ(job.options.model, SceneModel::Tagslam);
  ASSERT_TRUE(describe_scene("waymark", true, job));
  EXPECT_TRUE(job.options.free_intrinsics);
  EXPECT_EQ(to_string(describe_scene("tagslam", true, job).error()),
            "(--free-intrinsics): TagSLAM's model takes the cameras as given. Leave it out, or leave out "
            "--model tagslam.");
  EXPECT_THAT(to_string(describe_scene("tagslm", false, job).error()), HasSubstr("(--model): there is no"));
}

}  // namespace
}  // namespace waymark
