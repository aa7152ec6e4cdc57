// Tests which tags are expected in an image, given the pose and the map. Also tests the description of tags
// that were not found.
#include "waymark/pipeline/expected_tags.hpp"

#include <numbers>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/samples/visibility.hpp"

namespace waymark {
namespace {

constexpr SensorTime kImageStamp{std::chrono::seconds(10)};

/// A camera that looks along the x axis of the base from 0.2 m above the floor.
MountedCamera camera() {
  Eigen::Matrix3d base_R_cam;
  base_R_cam << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  return {.name = "cam",
          .camera =
              CameraModel::make(PinholeRadtan{.fx = 500, .fy = 500, .cx = 320, .cy = 240}, 640, 480).value(),
          .base_T_cam = SE3(SO3::from_matrix(base_R_cam), {0.1, 0, 0.2})};
}

/// A wall at x = 2 m with tags that face the robot, and a tag behind the robot.
TagMap wall() {
  Eigen::Matrix3d map_R_tag;  // z points into the tag, along the map's x axis
  map_R_tag << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  TagMap map;
  for (int number = 0; number < 3; ++number)
    map.tags[{FamilyId::Tag36h11, number}] = {
        .map_T_tag = SE3(SO3::from_matrix(map_R_tag), {2, 0.4 * number - 0.4, 0.25}), .size_m = 0.16};
  map.tags[{FamilyId::Tag36h11, 9}] = {.map_T_tag = SE3(SO3::from_matrix(map_R_tag), {-3, 0, 0.25}),
                                       .size_m = 0.16};
  return map;
}

LocalizationEstimate at(const SE2& map_T_base) {
  return {.stamp = kImageStamp,
          .map_T_base = map_T_base,
          .covariance = Eigen::Vector3d(1e-4, 1e-4, 1e-4).asDiagonal()};
}

TEST(ExpectedTags, AreTheTagsInFrontOfTheCamera) {
  const SE2 pose(0.1, -0.2, 0.05);
  const auto expected = expected_tags(wall(), camera(), at(pose), kImageStamp);
  ASSERT_EQ(expected.size(), 3U);
  const SE3 cam_T_map = (lift(pose) * camera().base_T_cam).inverse();
  for (const ExpectedTag& tag : expected) {
    const TagMap map = wall();
    const auto seen = visible_corners(camera().camera, cam_T_map * map.find(tag.tag)->map_T_tag, 0.16);
    ASSERT_TRUE(seen);
    for (std::size_t i = 0; i < 4; ++i) EXPECT_LT((tag.corners_px[i] - (*seen)[i]).norm(), 1e-9);
  }
}

/// One tag is half a metre in front of another and occludes it.
TEST(ExpectedTags, ExcludeOccludedTags) {
  TagMap map = wall();
  MappedTag front = map.tags.at({FamilyId::Tag36h11, 1});
  const Eigen::Vector3d away(-0.5, 0.02, 0);
  front.map_T_tag = SE3(front.map_T_tag.rotation(), front.map_T_tag.translation() + away);
  map.tags[{FamilyId::Tag36h11, 20}] = front;
  const auto expected = expected_tags(map, camera(), at(SE2(0, 0, 0)), kImageStamp);
  std::vector<int> numbers;
  numbers.reserve(expected.size());
  for (const ExpectedTag& tag : expected) numbers.push_back(tag.tag.number);
  EXPECT_EQ(numbers, (std::vector<int>{0, 2, 20}));
}

/// The same scene on a tilted floor, which does not change the image.
TEST(ExpectedTags, UseTheFloorOfTheMap) {
  TagMap leaning = wall();
  leaning.floor.normal = Eigen::Vector3d(0.2, -0.1, 1).normalized();
  const SE3 map_T_level = map_T_floor(leaning.floor);
  for (auto& [tag, mapped] : leaning.tags) mapped.map_T_tag = map_T_level * mapped.map_T_tag;
  const auto level = expected_tags(wall(), camera(), at({0.1, 0, 0}), kImageStamp);
  const auto leant = expected_tags(leaning, camera(), at({0.1, 0, 0}), kImageStamp);
  ASSERT_EQ(leant.size(), level.size());
  for (std::size_t i = 0; i < level.size(); ++i)
    for (std::size_t k = 0; k < 4; ++k)
      EXPECT_LT((leant[i].corners_px[k] - level[i].corners_px[k]).norm(), 1e-9);
}

TEST(ExpectedTags, AreEmptyForAnUncertainPose) {
  EXPECT_TRUE(expected_tags(wall(), camera(), std::nullopt, kImageStamp).empty());
  LocalizationEstimate estimate = at({});
  EXPECT_FALSE(expected_tags(wall(), camera(), estimate, kImageStamp).empty());
  EXPECT_TRUE(expected_tags(wall(), camera(), estimate, kImageStamp + std::chrono::seconds(1)).empty())
      << "old";
  estimate.certain = false;
  EXPECT_TRUE(expected_tags(wall(), camera(), estimate, kImageStamp).empty()) << "not certain";
  estimate = at({});
  estimate.covariance(0, 0) = 0.04;
  EXPECT_TRUE(expected_tags(wall(), camera(), estimate, kImageStamp).empty())
      << "position uncertain by 20 cm";
  estimate = at({});
  estimate.covariance(2, 2) = 0.01;
  EXPECT_TRUE(expected_tags(wall(), camera(), estimate, kImageStamp).empty())
      << "heading uncertain by 6 degrees";
}

TEST(MissedTags, AreReportedWithTheirReasons) {
  EXPECT_EQ(describe({}), "");
  const MissedTag one{{}, MissReason::Occluded};
  EXPECT_THAT(describe(std::vector{one}), ::testing::HasSubstr("(1 occluded)"));
  testing::expect_on_page("replay", describe(std::vector{one}));
  const std::vector<MissedTag> three = {one, {{}, MissReason::TooFaint}, {{}, MissReason::TooFaint}};
  EXPECT_THAT(describe(three), ::testing::HasSubstr("(2 too faint, 1 occluded)"));
  testing::expect_on_page("replay", describe(three));
}

}  // namespace
}  // namespace waymark
