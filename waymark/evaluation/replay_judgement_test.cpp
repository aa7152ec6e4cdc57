// Compares drives whose errors are known by construction.
#include "waymark/evaluation/replay_judgement.hpp"

#include <cmath>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"
#include "waymark/geometry/planar.hpp"

namespace waymark {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr Hull kHull{.front_m = 0.2, .rear_m = 0.2, .width_m = 0.2, .height_m = 0.3};

SensorTime at(double seconds) { return SensorTime(Duration(std::llround(seconds * 1e9))); }

/// A counter-clockwise circle around the origin; the heading is rotated by `turned_rad` from the tangent.
Trajectory circle(double radius_m, double from_turns, double turns, double turned_rad = 0) {
  Trajectory trajectory;
  for (int i = 0; i <= 3000; ++i) {
    const double angle = 2 * kPi * (from_turns + turns * i / 3000);
    trajectory.push_back({at(0.02 * i), lift(SE2(radius_m * std::cos(angle), radius_m * std::sin(angle),
                                                 angle + kPi / 2 + turned_rad))});
  }
  return trajectory;
}

TEST(ReplayJudgement, MeasuresTheOffsetOfCircles) {
  const auto judged = judge_replay(circle(1.95, 0.01, 1, 0.1), circle(2, 0, 1.1), {}, kHull);
  ASSERT_TRUE(judged);
  EXPECT_NEAR(judged->cross_track_rmse_m, 0.05, 1e-4);
  EXPECT_NEAR(judged->cross_track_p95_m, 0.05, 1e-4);
  EXPECT_NEAR(judged->cross_track_max_m, 0.05, 1e-4);
  EXPECT_NEAR(judged->heading_rmse_deg, 0.1 * 180 / kPi, 0.05);
  ASSERT_TRUE(judged->lap_m);
  EXPECT_NEAR(*judged->lap_m, 4 * kPi, 0.01);
  EXPECT_NEAR(judged->laps, 1.0, 0.002);
  EXPECT_EQ(judged->laps_completed, 1);
  EXPECT_NEAR(judged->distance_m, 2 * kPi * 1.95, 0.02);
  EXPECT_TRUE(std::isinf(judged->min_clearance_m));
}

TEST(ReplayJudgement, CountsLapsByTheDistanceAlongTheTaughtPath) {
  const Trajectory taught = circle(2, 0, 1.08);
  EXPECT_EQ(judge_replay(circle(2, 0, 0.5), taught, {}, kHull)->laps_completed, 0);
  EXPECT_EQ(judge_replay(circle(2, 0.9, 0.99), taught, {}, kHull)->laps_completed, 1)
      << "0.13 m short, which is within the tolerance";
  EXPECT_EQ(judge_replay(circle(2, 0, 0.97), taught, {}, kHull)->laps_completed, 0);
  EXPECT_EQ(judge_replay(circle(2, 0.3, 2.5), taught, {}, kHull)->laps_completed, 2);
  EXPECT_NEAR(judge_replay(circle(2, 0.3, 2.5), taught, {}, kHull)->laps, 2.5, 0.01);
}

TEST(ReplayJudgement, AcceptsSmallLaps) {
  const auto judged = judge_replay(circle(0.6, 0.1, 1), circle(0.6, 0, 1.2), {}, kHull);
  ASSERT_TRUE(judged->lap_m);
  EXPECT_NEAR(*judged->lap_m, 1.2 * kPi, 0.02);
  EXPECT_EQ(judged->laps_completed, 1);
}

TEST(ReplayJudgement, AcceptsEitherPassOfTheOverlap) {
  Trajectory taught = circle(2, 0, 1);
  for (StampedPose pose : circle(2.04, 0, 0.1)) {
    pose.stamp += std::chrono::seconds(100);
    taught.push_back(pose);
  }
  EXPECT_LT(judge_replay(circle(2.04, 0.02, 0.07), taught, {}, kHull)->cross_track_max_m, 1e-3);
  EXPECT_LT(judge_replay(circle(2, 0.02, 0.07), taught, {}, kHull)->cross_track_max_m, 1e-3);
  EXPECT_NEAR(judge_replay(circle(2.04, 0.2, 0.5), taught, {}, kHull)->cross_track_rmse_m, 0.04, 1e-3);
}

/// A drive 1.5 m forwards, back along the same path, and forwards again, `aside_m` to the left of it.
Trajectory there_and_back(double aside_m) {
  Trajectory trajectory;
  for (int i = 0; i <= 450; ++i) {
    const double x = i <= 150 ? 0.01 * i : (i <= 300 ? 3 - 0.01 * i : 0.01 * (i - 300));
    const double left = aside_m + (i <= 300 ? 0 : 0.3 * x * x);  // the last part is curved
    const double yaw = i <= 300 ? 0 : std::atan(0.6 * x);
    trajectory.push_back({at(0.05 * i), lift(SE2(x, left, yaw))});
  }
  return trajectory;
}

TEST(ReplayJudgement, DistinguishesTheWayBackFromTheWayThere) {
  for (const double aside_m : {0.0, 0.004, -0.004}) {
    const auto judged = judge_replay(there_and_back(aside_m), there_and_back(0), {}, kHull);
    ASSERT_TRUE(judged);
    EXPECT_LT(judged->cross_track_max_m, std::abs(aside_m) + 1e-3);
    EXPECT_NEAR(judged->progress_m, 4.6, 0.1) << "all three parts of the drive";
    EXPECT_LT(judged->heading_rmse_deg, 1);
  }
}

TEST(ReplayJudgement, AStandstillCountsOnce) {
  Trajectory replay = circle(2, 0.1, 0.4);  // ends at (-2, 0)
  for (int i = 0; i < 5000; ++i) replay.push_back({at(100 + i), lift(SE2(-2.2, 0, -kPi / 2))});
  const auto judged = judge_replay(replay, circle(2, 0, 1.1), {}, kHull);
  EXPECT_LT(judged->cross_track_rmse_m, 0.02);
  EXPECT_NEAR(judged->cross_track_max_m, 0.2, 1e-3);
}

TEST(ReplayJudgement, ClearanceIsFromHullToTrueTag) {
  TagMap tags;
  // An upright tag 0.5 m outside the circle, with its edge facing the robot; half its side is 0.08 m.
  const Eigen::Matrix3d upright = (Eigen::Matrix3d() << -1, 0, 0, 0, 0, 1, 0, -1, 0).finished();
  tags.tags[TagId{}] = {.map_T_tag = SE3(SO3::from_matrix(upright), {2.5, 0, 0.2}), .size_m = 0.16};
  const auto judged = judge_replay(circle(2, -0.2, 0.5), circle(2, -0.3, 1.1), tags, kHull);
  EXPECT_NEAR(judged->min_clearance_m, 0.5 - 0.08 - 0.1, 0.01);
}

TEST(ReplayJudgement, RejectsAShortLap) {
  EXPECT_FALSE(judge_replay({}, circle(2, 0, 1), {}, kHull));
  const auto judged = judge_replay(circle(2, 0, 1), circle(2, 0, 0.01), {}, kHull);
  ASSERT_FALSE(judged);
  EXPECT_THAT(judged.error().message, ::testing::HasSubstr("0.12 m"));
  testing::expect_on_page("evaluate", judged.error());
}

}  // namespace
}  // namespace waymark
