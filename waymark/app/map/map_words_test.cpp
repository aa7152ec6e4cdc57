// What a user says of a map, as a job.
#include "waymark/app/map/map_words.hpp"

#include <limits>
#include <numbers>
#include <set>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "waymark/app/common/flag_refusals.hpp"
#include "waymark/app/scene/map_scene.hpp"
#include "waymark/base/random.hpp"

namespace waymark {
namespace {

TEST(AnchorWords, WhatIsNotSaidIsNotOverridden) {
  const auto nothing = overrides_of({});
  ASSERT_TRUE(nothing);
  EXPECT_FALSE(nothing->anchor);
  EXPECT_FALSE(nothing->map_T_anchor);
  EXPECT_FALSE(nothing->tag_size_m);
}

// Roll, pitch and yaw as in REP 103: about the fixed axes x, y, z in this order.
TEST(AnchorWords, DegreesAreTurnsAboutFixedAxesOneAfterTheOther) {
  Random random(20261124);
  for (int trial = 0; trial < 50; ++trial) {
    std::vector<double> words;
    for (int i = 0; i < 3; ++i) words.push_back(random.uniform(-20, 20));
    for (int i = 0; i < 3; ++i) words.push_back(random.uniform(-180, 180));
    const auto overrides = overrides_of({.anchor_pose = words});
    ASSERT_TRUE(overrides);
    const auto about = [&](const Eigen::Vector3d& axis, double deg) {
      return Eigen::AngleAxisd(deg * std::numbers::pi / 180, axis);
    };
    const Eigen::Matrix3d expected =
        (about(Eigen::Vector3d::UnitZ(), words[5]) * about(Eigen::Vector3d::UnitY(), words[4]) *
         about(Eigen::Vector3d::UnitX(), words[3]))
            .toRotationMatrix();
    EXPECT_NEAR((overrides->map_T_anchor->rotation().quaternion().toRotationMatrix() - expected).norm(), 0,
                1e-12);
    EXPECT_EQ(overrides->map_T_anchor->translation(), Eigen::Vector3d(words[0], words[1], words[2]));
  }
}

TEST(AnchorWords, NumbersThatAreNoPlaceAndNoSizeAreRefusedByTheirFlag) {
  const double inf = std::numeric_limits<double>::infinity();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const std::vector<std::vector<double>> poses = {
      {nan, 0, 0, 0, 0, 0}, {0, 0, 0, 0, 0, inf}, {1.1e4, 0, 0, 0, 0, 0}, {0, 0, -1.1e4, 0, 0, 0}, {1, 2, 3}};
  for (const auto& pose : poses) {
    const auto refused = overrides_of({.anchor_pose = pose});
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().place.key, "--anchor-pose");
  }
  for (const double size : {0.0, -0.16, 100.0, 160.0, nan, inf}) {
    const auto refused = overrides_of({.tag_size_m = size});
    ASSERT_FALSE(refused) << size;
    EXPECT_EQ(refused.error().place.key, "--tag-size-m");
  }
  EXPECT_TRUE(overrides_of({.anchor_pose = {9999, -9999, 0, 720, 0, 0}, .tag_size_m = 0.16}));
}

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

GivenFlags given(std::set<std::string> flags) {
  return [flags = std::move(flags)](const char* flag) { return flags.contains(flag); };
}

TEST(FlagRefusals, OfAMap) {
  MapWords words;
  EXPECT_FALSE(check_effects(words, given({})));
  words.job.lap = "lap.mcap";
  EXPECT_FALSE(check_effects(words, given({})));
  words.job.folder = "map";
  EXPECT_TRUE(check_effects(words, given({"--method"})));
  const Status alone = check_effects(words, given({"--map-sigma"}));
  ASSERT_FALSE(alone);
  EXPECT_EQ(alone.error().place.key, "--map-sigma");
  words.of.extend = "older";
  EXPECT_TRUE(check_effects(words, given({"--map-sigma"})));
}

}  // namespace
}  // namespace waymark
