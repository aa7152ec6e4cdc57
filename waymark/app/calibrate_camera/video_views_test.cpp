// Which pictures of a video are taken for a calibration: those that stand still and show something new.
#include "waymark/app/calibrate_camera/video_views.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace waymark {
namespace {

using ::testing::Each;
using ::testing::ElementsAre;
using ::testing::Lt;

/// A board of six tags whose picture lies at x, in a picture k/30 s after the first.
StampedMarks board_at(int k, double x_px, int tags = 6) {
  StampedMarks picture{.stamp = SensorTime(std::chrono::microseconds(33'333 * k))};
  for (int i = 0; i < tags; ++i) {
    const Eigen::Vector2d at(x_px + 50 * (i % 3), 100 + 50 * (i / 3));
    TargetMark tag{.key = i, .target_points_m = std::vector<Eigen::Vector3d>(4, {0, 0, 0})};
    tag.seen_px = {at, at + Eigen::Vector2d(30, 0), at + Eigen::Vector2d(30, 30),
                   at + Eigen::Vector2d(0, 30)};
    picture.marks.push_back(tag);
  }
  return picture;
}

TEST(VideoViews, StillPicturesAreTakenOnceForEachPlace) {
  std::vector<StampedMarks> pictures;
  int k = 0;
  const auto stay = [&](double x_px) {
    for (int i = 0; i < 10; ++i) pictures.push_back(board_at(k++, x_px + 0.1 * i));
  };
  stay(10);
  for (int i = 1; i < 10; ++i) pictures.push_back(board_at(k++, 10 + 20 * i));  // 600 px/s
  stay(210);
  const auto chosen = choose_views(pictures, 800);
  ASSERT_EQ(chosen.size(), 2U);
  EXPECT_LT(chosen[0], 10U);
  EXPECT_GE(chosen[1], 19U);
}

TEST(VideoViews, WhatMovesFastOrShowsFewTagsIsLeftOut) {
  std::vector<StampedMarks> fast;
  for (int k = 0; k < 30; ++k) fast.push_back(board_at(k, 15.0 * k));
  EXPECT_TRUE(choose_views(fast, 800).empty());
  std::vector<StampedMarks> few;
  for (int k = 0; k < 30; ++k) few.push_back(board_at(k, 1.0 * k, 3));
  EXPECT_TRUE(choose_views(few, 800).empty());
  EXPECT_FALSE(choose_views(few, 800, {.fewest_tags = 3}).empty());
}

TEST(VideoViews, ThereAreNoMoreThanAskedFor) {
  std::vector<StampedMarks> slow;
  for (int k = 0; k < 600; ++k) slow.push_back(board_at(k, 1.0 * k));
  const auto all = choose_views(slow, 800);
  EXPECT_GT(all.size(), 10U);
  EXPECT_THAT(all, Each(Lt(600U)));
  EXPECT_EQ(choose_views(slow, 800, {.most_views = 5}).size(), 5U);
  EXPECT_THAT(choose_views({board_at(0, 10)}, 800), ElementsAre(0));
  EXPECT_TRUE(choose_views({}, 800).empty());
}

}  // namespace
}  // namespace waymark
