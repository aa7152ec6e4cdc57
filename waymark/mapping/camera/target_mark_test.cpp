// What a picture shows of a target, as marks: which tags count, how far pictures are apart, and what is no
// mark.
#include "waymark/mapping/camera/target_mark.hpp"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "waymark/base/random.hpp"
#include "waymark/mapping/camera/mark_projection.hpp"
#include "waymark/samples/visibility.hpp"

namespace waymark {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

/// Corners of a board, numbered, seen on a grid that is shifted.
TargetPicture grid(std::int64_t first, std::int64_t count, const Eigen::Vector2d& shift = {0, 0}) {
  TargetPicture marks;
  for (std::int64_t key = first; key < first + count; ++key) {
    const auto k = static_cast<double>(key);
    marks.push_back({.key = key,
                     .target_points_m = {{0.01 * k, 0, 0}},
                     .seen_px = {Eigen::Vector2d(10 * k, 5 * k) + shift}});
  }
  return marks;
}

TEST(TargetMarks, TagsOfTheTargetWithTheirCornersWhereTheyAreOnIt) {
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
  const TargetPicture marks = target_marks(std::vector{stranger, seen, other_family}, target);
  ASSERT_EQ(marks.size(), 1U);
  ASSERT_EQ(marks[0].target_points_m.size(), 4U);
  const auto corners = tag_corners(0.05);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_LT((marks[0].target_points_m[i] - target_T_tag * corners[i]).norm(), 1e-12);
    EXPECT_EQ(marks[0].seen_px[i], seen.corners_px[i]);
  }
  EXPECT_EQ(marks[0].covariance_px2.size(), 0) << "it is not known";
  seen.corner_covariance_px2 = CornerCovariance(0.01 * CornerCovariance::Identity());
  EXPECT_EQ(target_marks(std::vector{seen}, target)[0].covariance_px2.rows(), 8);
}

TEST(TargetMarks, TheSameNumberOfTwoFamiliesIsTwoMarks) {
  TagMap target;
  for (const FamilyId family : {FamilyId::Tag36h11, FamilyId::TagStandard52h13})
    target.tags[{family, 7}] = {.size_m = 0.05};
  const auto marks = target_marks(
      std::vector<TagDetection>{{.tag = {FamilyId::Tag36h11, 7}}, {.tag = {FamilyId::TagStandard52h13, 7}}},
      target);
  ASSERT_EQ(marks.size(), 2U);
  EXPECT_NE(marks[0].key, marks[1].key);
}

TEST(TargetMarks, CornersOfABoardLieInItsPlane) {
  const std::vector<Eigen::Vector2d> places = {{0, 0}, {0.03, 0}, {0, 0.03}};
  const auto marks = target_marks(std::vector<BoardCorner>{{2, {5, 6}}, {0, {1, 2}}}, places);
  ASSERT_EQ(marks.size(), 2U);
  EXPECT_EQ(marks[0].key, 2);
  EXPECT_EQ(marks[0].target_points_m[0], Eigen::Vector3d(0, 0.03, 0));
  EXPECT_EQ(marks[1].seen_px[0], Eigen::Vector2d(1, 2));
}

TEST(ApartPx, IsTheMeanDistanceOfWhatBothShowAndTheSameBothWays) {
  EXPECT_EQ(apart_px(grid(0, 10), grid(0, 10)), 0);
  EXPECT_NEAR(apart_px(grid(0, 10), grid(0, 10, {3, 4})), 5, 1e-12);
  EXPECT_NEAR(apart_px(grid(0, 10), grid(4, 10, {3, 4})), 5, 1e-12) << "six of ten";
  TargetPicture one_moved = grid(0, 10);
  one_moved[4].seen_px[0].x() += 20;
  EXPECT_NEAR(apart_px(grid(0, 10), one_moved), 2, 1e-12);
  for (std::int64_t first = 0; first < 12; ++first)
    EXPECT_EQ(apart_px(grid(0, 10), grid(first, 8, {1, 2})), apart_px(grid(first, 8, {1, 2}), grid(0, 10)));
}

TEST(ApartPx, IsInfiniteWhereTheyShareLessThanHalfOfTheFewer) {
  EXPECT_EQ(apart_px(grid(0, 10), grid(6, 10)), kInfinite) << "four of ten";
  EXPECT_LT(apart_px(grid(0, 10), grid(5, 10)), 1) << "five of ten";
  EXPECT_LT(apart_px(grid(0, 100), grid(97, 6)), 1) << "of the picture with fewer";
  EXPECT_EQ(apart_px({}, {}), kInfinite);
  EXPECT_EQ(apart_px(grid(0, 3), {}), kInfinite);
}

TEST(ViewMark, WhitensByItsCovarianceOrByWhatIsSaid) {
  TargetMark mark{.key = 1, .target_points_m = {{0, 0, 0}}, .seen_px = {{100, 50}}};
  const auto plain = internal::view_mark(mark, 0.25);
  ASSERT_TRUE(plain);
  EXPECT_LT((plain->whitening - 4 * Eigen::Matrix2d::Identity()).norm(), 1e-12);
  EXPECT_TRUE(plain->used);
  Eigen::Matrix2d P;
  P << 0.04, 0.01, 0.01, 0.09;
  mark.covariance_px2 = P;
  const auto whitened = internal::view_mark(mark, 0.25);
  ASSERT_TRUE(whitened);
  const Eigen::Matrix2d W = whitened->whitening;
  EXPECT_LT((W * P * W.transpose() - Eigen::Matrix2d::Identity()).norm(), 1e-12);
}

TEST(ViewMark, WhatIsNoMeasurementIsRefused) {
  const TargetMark good{.key = 1, .target_points_m = {{0, 0, 0}}, .seen_px = {{100, 50}}};
  std::vector<TargetMark> bad(8, good);
  bad[0].seen_px[0].x() = std::nan("");
  bad[1].target_points_m[0].z() = kInfinite;
  bad[2].seen_px.clear();
  bad[3].target_points_m.emplace_back(1, 0, 0);
  bad[4].covariance_px2 = Eigen::Matrix2d::Zero();
  bad[5].covariance_px2 = -Eigen::Matrix2d::Identity();
  bad[6].covariance_px2 = Eigen::Matrix3d::Identity();
  bad[7].seen_px.assign(5, {1, 2});
  bad[7].target_points_m.assign(5, {0, 0, 0});
  for (std::size_t i = 0; i < bad.size(); ++i) {
    const auto mark = internal::view_mark(bad[i], 0.2);
    ASSERT_FALSE(mark) << i;
    EXPECT_EQ(mark.error().code, ErrorCode::InvalidArgument) << i;
  }
  EXPECT_TRUE(internal::view_mark(good, 0.2));
}

TEST(MarkProjection, IsThatOfTheCameraAndItsChiSquareThatOfTheResidual) {
  const CameraModel camera =
      CameraModel::make(
          PinholeRadtan{.fx = 500, .fy = 510, .cx = 320, .cy = 240, .k = {-0.1}, .coefficients = 4}, 640, 480)
          .value();
  internal::TargetView view{.target_T_cam = SE3(SO3::exp({0.1, -0.2, 0.3}), {0.02, 0.01, -0.5})};
  const SE3 cam_T_target = view.target_T_cam.inverse();
  TargetMark mark{.key = 0};
  for (const auto& corner : tag_corners(0.04)) {
    mark.target_points_m.push_back(corner);
    mark.seen_px.push_back(*camera.project(cam_T_target * corner) + Eigen::Vector2d(0.3, -0.4));
  }
  const internal::ViewMark seen = internal::view_mark(mark, 0.5).value();
  const auto px = internal::projected(seen, internal::camera_points(seen, cam_T_target), camera);
  ASSERT_TRUE(px);
  for (Eigen::Index i = 0; i < 4; ++i)
    EXPECT_LT((px->segment<2>(2 * i) - mark.seen_px[static_cast<std::size_t>(i)] - Eigen::Vector2d(-0.3, 0.4))
                  .norm(),
              1e-12);
  EXPECT_NEAR(*internal::mark_chi2(seen, view, camera), 4.0, 1e-9) << "four times 0.5 px at sigma 0.5";
  view.target_T_cam = SE3({}, {0, 0, 0.5});
  EXPECT_FALSE(internal::mark_chi2(seen, view, camera)) << "behind the camera";
}

}  // namespace
}  // namespace waymark
