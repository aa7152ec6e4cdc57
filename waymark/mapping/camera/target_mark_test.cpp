// Marks of a target in an image, and the distance between images.
#include "waymark/mapping/camera/target_mark.hpp"

#include <limits>

#include <gtest/gtest.h>

#include "waymark/samples/visibility.hpp"

namespace waymark {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

/// Numbered corners of a board, observed as a shifted grid.
TargetMarks grid(std::int64_t first, std::int64_t count, const Eigen::Vector2d& shift = {0, 0}) {
  TargetMarks marks;
  for (std::int64_t key = first; key < first + count; ++key) {
    const auto k = static_cast<double>(key);
    marks.push_back({.key = key,
                     .target_points_m = {{0.01 * k, 0, 0}},
                     .seen_px = {Eigen::Vector2d(10 * k, 5 * k) + shift}});
  }
  return marks;
}

TEST(TargetMarks, ContainTheTargetTagsWithTheirCorners) {
  TagMap target;
  const TagId known{FamilyId::Tag36h11, 7};
  const SE3 target_T_tag(SO3::exp({0, 0, 0.3}), {0.2, 0.1, 0});
  target.tags[known] = {.map_T_tag = target_T_tag, .size_m = 0.05};
  TagDetection seen{.tag = known};
  for (std::size_t i = 0; i < 4; ++i) seen.corners_px[i] = {10.0 * static_cast<double>(i), 3};
  TagDetection stranger = seen;
  stranger.tag.number = 8;
  TagDetection other_family = seen;
  other_family.tag.family = FamilyId::TagStandard52h13;
  const TargetMarks marks = target_marks(std::vector{stranger, seen, other_family}, target);
  ASSERT_EQ(marks.size(), 1U);
  ASSERT_EQ(marks[0].target_points_m.size(), 4U);
  const auto corners = tag_corners(0.05);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_LT((marks[0].target_points_m[i] - target_T_tag * corners[i]).norm(), 1e-12);
    EXPECT_EQ(marks[0].seen_px[i], seen.corners_px[i]);
  }
  EXPECT_EQ(marks[0].covariance_px2.size(), 0) << "the covariance is unknown";
  seen.corner_covariance_px2 = CornerCovariance(0.01 * CornerCovariance::Identity());
  EXPECT_EQ(target_marks(std::vector{seen}, target)[0].covariance_px2.rows(), 8);
  seen.corner_state = CornerState::Unreliable;
  EXPECT_TRUE(target_marks(std::vector{seen}, target).empty());
}

TEST(TargetMarks, TheSameNumberInTwoFamiliesGivesTwoMarks) {
  TagMap target;
  for (const FamilyId family : {FamilyId::Tag36h11, FamilyId::TagStandard52h13})
    target.tags[{family, 7}] = {.size_m = 0.05};
  const auto marks = target_marks(
      std::vector<TagDetection>{{.tag = {FamilyId::Tag36h11, 7}}, {.tag = {FamilyId::TagStandard52h13, 7}}},
      target);
  ASSERT_EQ(marks.size(), 2U);
  EXPECT_NE(marks[0].key, marks[1].key);
}

TEST(TargetMarks, BoardCornersLieInItsPlane) {
  const std::vector<Eigen::Vector2d> places = {{0, 0}, {0.03, 0}, {0, 0.03}};
  const auto marks = target_marks(std::vector<BoardCorner>{{2, {5, 6}}, {0, {1, 2}}}, places);
  ASSERT_EQ(marks.size(), 2U);
  EXPECT_EQ(marks[0].key, 2);
  EXPECT_EQ(marks[0].target_points_m[0], Eigen::Vector3d(0, 0.03, 0));
  EXPECT_EQ(marks[1].seen_px[0], Eigen::Vector2d(1, 2));
}

TEST(ApartPx, IsTheSymmetricMeanDistanceOfCommonMarks) {
  EXPECT_EQ(apart_px(grid(0, 10), grid(0, 10)), 0);
  EXPECT_NEAR(apart_px(grid(0, 10), grid(0, 10, {3, 4})), 5, 1e-12);
  EXPECT_NEAR(apart_px(grid(0, 10), grid(4, 10, {3, 4})), 5, 1e-12) << "six of the ten marks are shared";
  TargetMarks one_moved = grid(0, 10);
  one_moved[4].seen_px[0].x() += 20;
  EXPECT_NEAR(apart_px(grid(0, 10), one_moved), 2, 1e-12);
  for (std::int64_t first = 0; first < 12; ++first)
    EXPECT_EQ(apart_px(grid(0, 10), grid(first, 8, {1, 2})), apart_px(grid(first, 8, {1, 2}), grid(0, 10)));
}

TEST(ApartPx, IsInfiniteBelowHalfOfTheMarksInCommon) {
  EXPECT_EQ(apart_px(grid(0, 10), grid(6, 10)), kInfinite) << "only four of the ten marks are shared";
  EXPECT_LT(apart_px(grid(0, 10), grid(5, 10)), 1) << "five of the ten marks are shared";
  EXPECT_LT(apart_px(grid(0, 100), grid(97, 6)), 1) << "the share refers to the image with fewer marks";
  EXPECT_EQ(apart_px({}, {}), kInfinite);
  EXPECT_EQ(apart_px(grid(0, 3), {}), kInfinite);
}

}  // namespace
}  // namespace waymark
