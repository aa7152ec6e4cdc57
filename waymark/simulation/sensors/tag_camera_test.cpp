#include "waymark/simulation/sensors/tag_camera.hpp"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>
#include <Eigen/LU>

#include "waymark/simulation/world/world_check.hpp"

namespace waymark {
namespace {

constexpr double kPi = std::numbers::pi;
const TagId kNearTag{FamilyId::Tag36h11, 1};
const TagId kDistantTag{FamilyId::Tag36h11, 2};

/// Two 16 cm tags on 24 cm papers, in front of a camera at the origin that faces map x.
World two_tags(const Eigen::Vector3d& near, const Eigen::Vector3d& far, double near_facing_rad = kPi) {
  World world{
      .name = "two tags", .anchor = kNearTag, .path_m = {{-0.2, 0}, {-0.1, 0}, {0, 0}}, .path_closed = false};
  world.tags.tags[kNearTag] = {.map_T_tag = upright_tag(near, near_facing_rad), .size_m = 0.16};
  world.tags.tags[kDistantTag] = {.map_T_tag = upright_tag(far, kPi), .size_m = 0.16};
  return world;
}

CameraModel camera() {
  return CameraModel::make(PinholeRadtan{.fx = 500, .fy = 500, .cx = 320, .cy = 240}, 640, 480).value();
}

RobotModel robot() { return {.base_T_cam = SE3(SO3::from_rpy(-kPi / 2, 0, -kPi / 2), {0, 0, 0.5})}; }

std::vector<int> seen(const World& world) {
  Random random(1);
  std::vector<int> numbers;
  for (const TagDetection& tag :
       see_tags(world, camera(), robot().base_T_cam, SensorTime{}, {.miss_probability = 0}, random)
           .detections)
    numbers.push_back(tag.tag.number);
  return numbers;
}

TEST(TagOcclusion, ATagBehindAnotherIsNotSeen) {
  EXPECT_EQ(seen(two_tags({1.5, 0, 0.5}, {3, 0, 0.5})), std::vector<int>{1});
  EXPECT_EQ(seen(two_tags({1.5, 0, 0.5}, {3, 1.0, 0.5})), (std::vector<int>{1, 2})) << "to the side of it";
  EXPECT_EQ(seen(two_tags({1.5, 0, 0.9}, {3, 0, 0.5})), (std::vector<int>{1, 2})) << "below it";
}

TEST(TagOcclusion, TheCornerCameraMaySeeThroughPaper) {
  World world = two_tags({1.5, 0, 0.5}, {3, 0, 0.5});
  world.corners_through_paper = true;
  EXPECT_EQ(seen(world), (std::vector<int>{1, 2}));
  const auto check = check_world(world, robot(), camera());
  ASSERT_TRUE(check);
  EXPECT_EQ(check->two_tags_fraction, 1);
  EXPECT_EQ(check->hidden.size(), 1U) << "still reported";
}

TEST(TagOcclusion, PartialOcclusionHidesATag) {
  // The paper ends 12 cm from the centre of the near tag, which corresponds to 24 cm at twice the distance.
  // The black square of the far tag begins 8 cm before its own centre.
  EXPECT_EQ(seen(two_tags({1.5, 0, 0.5}, {3, 0.31, 0.5})), std::vector<int>{1});
  EXPECT_EQ(seen(two_tags({1.5, 0, 0.5}, {3, 0.33, 0.5})), (std::vector<int>{1, 2}));
}

TEST(TagOcclusion, TheBackOfAPaperHidesLikeItsFront) {
  EXPECT_TRUE(seen(two_tags({1.5, 0, 0.5}, {3, 0, 0.5}, 0)).empty());
}

TEST(TagOcclusion, APanelHidesTagsBehindItButNotItsOwn) {
  World world = two_tags({1.5, 0, 0.5}, {3, 0.4, 0.5});
  ASSERT_EQ(seen(world), (std::vector<int>{1, 2}));
  world.panels.push_back({.map_T_panel = upright_tag({1.5, 0, 0.5}, kPi), .width_m = 0.6, .height_m = 0.4});
  EXPECT_EQ(seen(world), std::vector<int>{1});
}

TEST(TagOcclusion, AWallInFrontOfACornerHidesTheTag) {
  World world = two_tags({1.5, 1.0, 0.5}, {3, 0, 0.5});
  ASSERT_EQ(seen(world), (std::vector<int>{2})) << "the other tag is outside the image";
  world.walls.push_back({.from_m = {2, 0.04}, .to_m = {2, 1}, .height_m = 1, .thickness_m = 0.02});
  EXPECT_TRUE(seen(world).empty()) << "its centre is visible, but its left corners are not";
}

TEST(TagOcclusion, ACameraInThePlaneOfAPaperSeesPastIt) {
  const Screen paper =
      paper_of(kNearTag, {.map_T_tag = upright_tag({1, 0, 0.5}, kPi / 2), .size_m = 0.16}, 1);
  EXPECT_FALSE(hides(paper, {0, 0, 0.5}, {.map_T_tag = upright_tag({3, 0.3, 0.5}, kPi), .size_m = 0.16}));
}

TEST(TagOcclusion, TagsOverlapIfPaperCoversBlack) {
  const auto at = [](double y, double x = 2, double facing = kPi) {
    return TagCopy{kNearTag, {.map_T_tag = upright_tag({x, y, 0.5}, facing), .size_m = 0.16}};
  };
  EXPECT_TRUE(overlap(at(0), at(0.1)));
  EXPECT_TRUE(overlap(at(0), at(0.17))) << "the white border of one covers the black of the other";
  EXPECT_FALSE(overlap(at(0), at(0.19)));
  EXPECT_FALSE(overlap(at(0), at(0, 2.1)))
      << "one behind the other, so one hides the other without overlapping it";
  EXPECT_TRUE(overlap(at(0), at(0, 2.05, kPi / 2 + 0.3))) << "one intersects the other";
  EXPECT_FALSE(overlap(at(0), at(0, 2.003, 0))) << "back to back";
}

TEST(WorldCheck, ReportsOverlappingAndHiddenTags) {
  const auto free = check_world(two_tags({1.5, 0.2, 0.5}, {3, -0.4, 0.5}), robot(), camera());
  ASSERT_TRUE(free);
  EXPECT_TRUE(free->overlapping.empty());
  EXPECT_TRUE(free->hidden.empty());
  EXPECT_EQ(free->two_tags_fraction, 1);

  const auto hidden = check_world(two_tags({1.5, 0, 0.5}, {3, 0, 0.5}), robot(), camera());
  ASSERT_TRUE(hidden);
  EXPECT_EQ(hidden->two_tags_fraction, 0);
  ASSERT_EQ(hidden->hidden.size(), 1U);
  EXPECT_EQ(hidden->hidden[0].tag, kDistantTag);
  EXPECT_EQ(hidden->hidden[0].by, kNearTag);
  EXPECT_NEAR(hidden->hidden[0].from_m, 0.2, 0.03);

  const auto overlapping = check_world(two_tags({1.5, 0, 0.5}, {1.5, 0.1, 0.5}), robot(), camera());
  ASSERT_TRUE(overlapping);
  EXPECT_EQ(overlapping->overlapping, (std::vector<std::pair<TagId, TagId>>{{kNearTag, kDistantTag}}));
}

TEST(TagCamera, NoiseMatchesItsCovariance) {
  World world;
  world.tags.tags[TagId{.number = 3}] = {.map_T_tag = SE3(SO3(), {0.1, 0, 1.5}), .size_m = 0.16};
  const CameraModel camera =
      CameraModel::make(PinholeRadtan{.fx = 442, .fy = 443, .cx = 320, .cy = 240}, 640, 480).value();
  const auto truth = visible_corners(camera, SE3(SO3(), {0.1, 0, 1.5}), 0.16);
  ASSERT_TRUE(truth);
  Random random(5);
  double normalized = 0;
  int seen = 0;
  constexpr int kFrames = 4000;
  for (int i = 0; i < kFrames; ++i) {
    const TagFrame frame = see_tags(world, camera, SE3(), SensorTime{}, {.miss_probability = 0.1}, random);
    if (frame.detections.empty()) continue;
    ++seen;
    const TagDetection& tag = frame.detections[0];
    Eigen::Matrix<double, 8, 1> error;
    for (std::size_t k = 0; k < 4; ++k)
      error.segment<2>(2 * static_cast<Eigen::Index>(k)) = tag.corners_px[k] - (*truth)[k];
    normalized += error.dot(tag.corner_covariance_px2->inverse() * error);
  }
  EXPECT_NEAR(seen, 0.9 * kFrames, 4 * std::sqrt(0.09 * kFrames));
  EXPECT_NEAR(normalized / seen, 8.0, 4 * std::sqrt(16.0 / seen));
}

}  // namespace
}  // namespace waymark
