// Where tags should be in a picture, by the pose and the map, and the words of those that were not found.
#include "waymark/pipeline/expected_tags.hpp"

#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "waymark/geometry/planar.hpp"
#include "waymark/samples/visibility.hpp"

namespace waymark {
namespace {

constexpr SensorTime kNow{std::chrono::seconds(10)};

/// Looks along the base's x axis, 0.2 m above the floor.
MountedCamera camera() {
  Eigen::Matrix3d base_R_cam;
  base_R_cam << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  return {.name = "cam",
          .camera =
              CameraModel::make(PinholeRadtan{.fx = 500, .fy = 500, .cx = 320, .cy = 240}, 640, 480).value(),
          .base_T_cam = SE3(SO3::from_matrix(base_R_cam), {0.1, 0, 0.2})};
}

/// A wall across x = 2 m, whose tags look back, and a tag behind the robot.
TagMap wall() {
  Eigen::Matrix3d map_R_tag;  // z into the tag: along map x
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
  return {
      .stamp = kNow, .map_T_base = map_T_base, .covariance = Eigen::Vector3d(1e-4, 1e-4, 1e-4).asDiagonal()};
}

TEST(ExpectedTags, AreThoseInFrontWhereTheCameraSeesThem) {
  const SE2 pose(0.1, -0.2, 0.05);
  const auto expected = expected_tags(wall(), camera(), at(pose), kNow);
  ASSERT_EQ(expected.size(), 3U);
  const SE3 cam_T_map = (lift(pose) * camera().base_T_cam).inverse();
  for (const ExpectedTag& tag : expected) {
    const TagMap map = wall();
    const auto seen = visible_corners(camera().camera, cam_T_map * map.find(tag.tag)->map_T_tag, 0.16);
    ASSERT_TRUE(seen);
    for (std::size_t i = 0; i < 4; ++i) EXPECT_LT((tag.corners_px[i] - (*seen)[i]).norm(), 1e-9);
  }
}

/// One tag hangs half a metre before another, and hides it from here.
TEST(ExpectedTags, AreNotThoseBehindOthers) {
  TagMap map = wall();
  MappedTag front = map.tags.at({FamilyId::Tag36h11, 1});
  const Eigen::Vector3d away(-0.5, 0.02, 0);
  front.map_T_tag = SE3(front.map_T_tag.rotation(), front.map_T_tag.translation() + away);
  map.tags[{FamilyId::Tag36h11, 20}] = front;
  const auto expected = expected_tags(map, camera(), at(SE2(0, 0, 0)), kNow);
  std::vector<int> numbers;
  numbers.reserve(expected.size());
  for (const ExpectedTag& tag : expected) numbers.push_back(tag.tag.number);
  EXPECT_EQ(numbers, (std::vector<int>{0, 2, 20}));
}

/// The same place on a floor that leans: what the camera sees does not change.
TEST(ExpectedTags, StandOnTheFloorThatTheMapHas) {
  TagMap leaning = wall();
  leaning.floor.normal = Eigen::Vector3d(0.2, -0.1, 1).normalized();
  const SE3 map_T_level = map_T_floor(leaning.floor);
  for (auto& [tag, mapped] : leaning.tags) mapped.map_T_tag = map_T_level * mapped.map_T_tag;
  const auto level = expected_tags(wall(), camera(), at({0.1, 0, 0}), kNow);
  const auto leant = expected_tags(leaning, camera(), at({0.1, 0, 0}), kNow);
  ASSERT_EQ(leant.size(), level.size());
  for (std::size_t i = 0; i < level.size(); ++i)
    for (std::size_t k = 0; k < 4; ++k)
      EXPECT_LT((leant[i].corners_px[k] - level[i].corners_px[k]).norm(), 1e-9);
}

TEST(ExpectedTags, AreNoneWhereThePoseIsNotKnown) {
  EXPECT_TRUE(expected_tags(wall(), camera(), std::nullopt, kNow).empty());
  LocalizationEstimate estimate = at({});
  EXPECT_FALSE(expected_tags(wall(), camera(), estimate, kNow).empty());
  EXPECT_TRUE(expected_tags(wall(), camera(), estimate, kNow + std::chrono::seconds(1)).empty()) << "old";
  estimate.certain = false;
  EXPECT_TRUE(expected_tags(wall(), camera(), estimate, kNow).empty()) << "a guess";
  estimate = at({});
  estimate.covariance(0, 0) = 0.04;
  EXPECT_TRUE(expected_tags(wall(), camera(), estimate, kNow).empty()) << "known to 20 cm";
  estimate = at({});
  estimate.covariance(2, 2) = 0.01;
  EXPECT_TRUE(expected_tags(wall(), camera(), estimate, kNow).empty()) << "a heading known to 6 degrees";
}

TEST(MissedTags, AreSaidWithTheirReasons) {
  EXPECT_EQ(describe({}), "");
  const MissedTag one{{}, MissReason::Occluded};
  EXPECT_EQ(describe(std::vector{one}), "1 tag that should be in view was not found (1 occluded)");
  const std::vector<MissedTag> three = {one, {{}, MissReason::TooFaint}, {{}, MissReason::TooFaint}};
  EXPECT_EQ(describe(three), "3 tags that should be in view were not found (2 too faint, 1 occluded)");
}

}  // namespace
}  // namespace waymark
