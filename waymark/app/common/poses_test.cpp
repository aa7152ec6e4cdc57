#include "waymark/app/common/poses.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "waymark/samples/visibility.hpp"

namespace waymark {
namespace {

using ::testing::HasSubstr;

CameraModel pose_camera() {
  return CameraModel::make(PinholeRadtan{.fx = 500, .fy = 500, .cx = 320, .cy = 240}, 640, 480).value();
}

/// A tag of 0.2 m, two metres ahead, a little turned.
SE3 true_pose() { return {SO3::from_rpy(0.2, 0.5, 0.1), {0.1, -0.2, 2}}; }

TagDetection seen(int number, double size_m = 0.2) {
  TagDetection detection{.tag = {FamilyId::Tag36h11, number}};
  detection.corners_px = visible_corners(pose_camera(), true_pose(), size_m).value();
  return detection;
}

TEST(ParseTagSizes, OneForAllOthersById) {
  const auto sizes = parse_tag_sizes({"0.16", "7=0.08", "tag25h9:3=0.2"});
  ASSERT_TRUE(sizes) << to_string(sizes.error());
  EXPECT_EQ(sizes->size_m({FamilyId::Tag36h11, 1}).value(), 0.16);
  EXPECT_EQ(sizes->size_m({FamilyId::Tag36h11, 7}).value(), 0.08);
  EXPECT_EQ(sizes->size_m({FamilyId::Tag25h9, 3}).value(), 0.2);
  const auto some = parse_tag_sizes({"7=0.08"});
  ASSERT_TRUE(some);
  EXPECT_FALSE(some->size_m({FamilyId::Tag36h11, 1})) << "no size for all others";
  EXPECT_EQ(parse_tag_sizes({"0.1", "0.2"})->default_size_m, 0.2) << "the last one counts";
  EXPECT_TRUE(parse_tag_sizes({}));
}

TEST(ParseTagSizes, WhatIsNoSizeNamesTheFlagAndTheWord) {
  for (const char* word :
       {"", "x", "0", "-0.1", "nan", "inf", "0.16m", "7=", "=0.1", "7=0.1=2", "tag1=0.1"}) {
    const auto sizes = parse_tag_sizes({word});
    ASSERT_FALSE(sizes) << word;
    EXPECT_FALSE(sizes.error().message.empty());
  }
  const auto error = parse_tag_sizes({"7=large"}).error();
  EXPECT_EQ(error.place.key, "--tag-size-m");
  EXPECT_THAT(error.message, HasSubstr("7=large"));
}

TEST(PosesOf, EachDetectionHasItsPoseOrAnErrorInItsPlace) {
  const PoseSetup setup{pose_camera(), parse_tag_sizes({"7=0.2"}).value()};
  const std::vector<TagDetection> detections = {seen(3), seen(7)};
  const PoseList poses = poses_of(detections, setup);
  ASSERT_EQ(poses.size(), 2U);
  EXPECT_FALSE(poses[0]) << "its size is not known";
  ASSERT_TRUE(poses[1]) << to_string(poses[1].error());
  EXPECT_LT((poses[1]->best.cam_T_tag.translation() - true_pose().translation()).norm(), 1e-6);
  const auto axes = axes_of(detections, poses, setup);
  ASSERT_EQ(axes.size(), 1U) << "only where there is a pose";
  const auto middle = pose_camera().project(true_pose().translation());
  ASSERT_TRUE(middle);
  EXPECT_LT((axes[0].origin_px - *middle).norm(), 1e-3);
  EXPECT_GT((axes[0].x_px - axes[0].origin_px).norm(), 10);
}

TEST(PosesOf, AWrongSizeScalesTheDistance) {
  const PoseSetup setup{pose_camera(), {.default_size_m = 0.4}};
  const std::vector<TagDetection> detections = {seen(1)};
  const PoseList poses = poses_of(detections, setup);
  ASSERT_TRUE(poses[0]);
  EXPECT_NEAR(poses[0]->best.cam_T_tag.translation().norm(), 2 * true_pose().translation().norm(), 1e-6);
}

TEST(PoseJson, ThePoseOrWhyThereIsNone) {
  const std::vector<TagDetection> detections = {seen(1)};
  nlohmann::ordered_json known;
  add_to_json(known, poses_of(detections, {pose_camera(), {.default_size_m = 0.2}})[0]);
  EXPECT_NEAR(known["pose"]["cam_t_tag_m"][2].get<double>(), 2, 1e-6);
  EXPECT_EQ(known["pose"]["cam_q_tag_xyzw"].size(), 4U);
  EXPECT_EQ(known["pose"]["sigma_t_m"].size(), 3U);
  for (const auto& sigma : known["pose"]["sigma_t_m"]) EXPECT_GT(sigma.get<double>(), 0);
  EXPECT_TRUE(known.contains("other_pose"));
  EXPECT_FALSE(known.contains("pose_error"));
  nlohmann::ordered_json unknown;
  add_to_json(unknown, poses_of(detections, {pose_camera(), {}})[0]);
  EXPECT_FALSE(unknown.contains("pose"));
  EXPECT_FALSE(unknown["pose_error"]["message"].get<std::string>().empty());
}

}  // namespace
}  // namespace waymark
