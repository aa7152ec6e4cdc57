#include "waymark/evaluation/trajectory_scores.hpp"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "waymark/base/angles.hpp"
#include "waymark/base/random.hpp"
#include "waymark/geometry/planar.hpp"

namespace waymark {
namespace {

SensorTime at_s(double seconds) { return SensorTime(Duration(std::llround(seconds * 1e9))); }

/// A circle with a 1 m radius, driven once in 10 s, with varying height.
SE3 on_circle(double t_s) {
  const double a = 2 * std::numbers::pi * t_s / 10;
  return {SO3::exp({0, 0, a + std::numbers::pi / 2}), {std::cos(a), std::sin(a), 0.1 * std::sin(3 * a)}};
}

Trajectory circle(double step_s = 0.05) {
  Trajectory trajectory;
  for (int i = 0; i * step_s <= 10; ++i) trajectory.push_back({at_s(i * step_s), on_circle(i * step_s)});
  return trajectory;
}

EstimatedTrajectory estimates(const Trajectory& trajectory, const SE3& moved, double scale = 1) {
  EstimatedTrajectory poses;
  for (const StampedPose& pose : trajectory) {
    const SE3 there = moved * pose.map_T_base;
    poses.push_back({pose.stamp, SE3(there.rotation(), scale * there.translation()), {}});
  }
  return poses;
}

TEST(Alignment, RecoversTheTransformation) {
  const Trajectory truth = circle();
  const SE3 level(SO3::exp({0, 0, 0.7}), {1, -2, 0});
  const SE3 leaning(SO3::exp({0.2, -0.1, 0.7}), {1, -2, 3});
  const auto rmse = [&](const SE3& moved, double scale, AlignmentKind kind) {
    const auto pairs = pair_by_time(estimates(truth, moved, scale), truth, std::chrono::seconds(1));
    return score_trajectory(pairs, kind)->ate_m.rmse;
  };
  EXPECT_LT(rmse(level, 1, AlignmentKind::Se2), 1e-12);
  EXPECT_LT(rmse(leaning, 1, AlignmentKind::Se3), 1e-12);
  EXPECT_LT(rmse(leaning, 1.3, AlignmentKind::Sim3), 1e-12);
  EXPECT_GT(rmse(leaning, 1, AlignmentKind::Se2), 0.05);
  EXPECT_GT(rmse(leaning, 1.3, AlignmentKind::Se3), 0.05);
  EXPECT_GT(rmse(level, 1, AlignmentKind::None), 1);
}

TEST(Alignment, RejectsDegenerateInput) {
  Trajectory line;
  for (int i = 0; i < 10; ++i) line.push_back({at_s(i), SE3(SO3(), {0.1 * i, 0, 0})});
  const auto pairs = pair_by_time(estimates(line, SE3()), line, std::chrono::seconds(2));
  EXPECT_TRUE(align(pairs, AlignmentKind::Se2).has_value());
  EXPECT_FALSE(align(pairs, AlignmentKind::Se3).has_value());
  EXPECT_FALSE(align({pairs.begin(), pairs.begin() + 2}, AlignmentKind::Se2).has_value());
  EXPECT_FALSE(score_trajectory({}, AlignmentKind::None).has_value());
}

TEST(Scores, MeasureDriftAndCountJumps) {
  const Trajectory truth = circle();
  EstimatedTrajectory drifting = estimates(truth, SE3());
  for (EstimatedPose& pose : drifting) {  // 1 cm/s upwards
    const double t_s = to_seconds(pose.stamp.time_since_epoch());
    pose.map_T_base = SE3(SO3(), {0, 0, 0.01 * t_s}) * pose.map_T_base;
  }
  auto scores = score_trajectory(pair_by_time(drifting, truth, std::chrono::seconds(1)), AlignmentKind::None);
  EXPECT_NEAR(scores->relative.translation_m.rmse, 0.01, 1e-9);
  EXPECT_NEAR(scores->end_error_m, 0.1, 1e-9);
  EXPECT_EQ(scores->jumps, 0U);
  for (std::size_t i = 100; i < drifting.size(); ++i)
    drifting[i].map_T_base = SE3(SO3(), {0.2, 0, 0}) * drifting[i].map_T_base;
  scores = score_trajectory(pair_by_time(drifting, truth, std::chrono::seconds(1)), AlignmentKind::None);
  EXPECT_EQ(scores->jumps, 1U);
}

TEST(Scores, ConsistentCovariancesStayConsistentAfterAlignment) {
  constexpr std::uint64_t kSeed = 11;
  Random random(kSeed);
  Trajectory truth;
  for (int i = 0; i < 20000; ++i)
    truth.push_back({at_s(i), lift(SE2(0.01 * i, 3 * std::sin(0.01 * i), 0.3))});
  Eigen::Matrix3d covariance;
  covariance << 4e-4, 1e-4, 2e-4, 1e-4, 1e-4, -5e-5, 2e-4, -5e-5, 9e-4;
  const Eigen::Matrix3d root = covariance.llt().matrixL();
  const SE3 moved = lift(SE2(1, 2, 1.2));
  EstimatedTrajectory estimated;
  for (const StampedPose& pose : truth) {
    const SE2 p = project_to_plane(pose.map_T_base);
    const Eigen::Vector3d e = root * Eigen::Vector3d(random.normal(), random.normal(), random.normal());
    estimated.push_back({pose.stamp, lift(SE2(p.x() + e.x(), p.y() + e.y(), p.yaw() + e.z())), covariance});
  }
  const auto pairs = pair_by_time(estimated, truth, std::chrono::seconds(2));
  const auto scores = score_trajectory(pairs, AlignmentKind::None);
  const double sigma = std::sqrt(6.0 / static_cast<double>(truth.size()));
  EXPECT_NEAR(scores->consistency->nees_mean, 3, 4 * sigma);
  EXPECT_NEAR(scores->consistency->inside_95, 0.95, 0.006);
  for (EstimatedPose& estimate : estimated) {  // the same trajectory in a rotated frame
    const Eigen::Matrix3d turn = moved.rotation().matrix();
    Eigen::Matrix3d J = Eigen::Matrix3d::Identity();
    J.topLeftCorner<2, 2>() = turn.topLeftCorner<2, 2>();
    estimate = {estimate.stamp, moved * estimate.map_T_base, J * covariance * J.transpose()};
  }
  const auto turned =
      score_trajectory(pair_by_time(estimated, truth, std::chrono::seconds(2)), AlignmentKind::Se2);
  EXPECT_NEAR(turned->consistency->nees_mean, scores->consistency->nees_mean, 0.02);
}

TEST(Scores, CountAnInvalidCovariance) {
  const Trajectory truth = circle();
  EstimatedTrajectory estimated = estimates(truth, SE3());
  for (EstimatedPose& estimate : estimated) estimate.covariance = -Eigen::Matrix3d::Identity();
  const auto scores =
      score_trajectory(pair_by_time(estimated, truth, std::chrono::seconds(1)), AlignmentKind::None);
  EXPECT_EQ(scores->consistency->count, 0U);
  EXPECT_EQ(scores->consistency->refused, estimated.size());
}

TEST(Scores, CoveredShareIsTheTimeBetweenNearEstimates) {
  const EstimatedTrajectory poses = {
      {at_s(1), SE3(), {}}, {at_s(2), SE3(), {}}, {at_s(6), SE3(), {}}, {at_s(7), SE3(), {}}};
  EXPECT_NEAR(covered_share(poses, at_s(0), at_s(10), std::chrono::seconds(1)), 0.2, 1e-12);
  EXPECT_NEAR(covered_share(poses, at_s(1.5), at_s(6.5), std::chrono::seconds(1)), 0.2, 1e-12);
}

const FloorPath kRectangle{{{0, 0}, {1.32, 0}, {1.32, 1.04}, {0, 1.04}}, true};

EstimatedPose standing(double x_m, double y_m, double yaw_deg) {
  return {{}, lift(SE2(x_m, y_m, to_radians(yaw_deg))), {}};
}

TEST(Path, MeasuresDistanceToThePathAndToTheDrivenSide) {
  const auto scores = score_path({standing(0.5, 0.1, 5), standing(1.4, 0.5, 90)}, kRectangle);
  ASSERT_TRUE(scores);
  EXPECT_NEAR(scores->distance_m.rmse, std::sqrt((0.01 + 0.0064) / 2), 1e-12);
  EXPECT_NEAR(scores->side_mean_m, (0.1 - 0.08) / 2, 1e-12);
  // Beyond the corner, but still heading along the first side: close to the second side, away from the first
  // one.
  const auto beyond = score_path({standing(1.5, 0.2, 0)}, kRectangle);
  EXPECT_NEAR(beyond->distance_m.max, 0.18, 1e-12);
  EXPECT_NEAR(beyond->side_mean_m, 0.2, 1e-12);
  // The side back to the first corner only exists in a closed path.
  const FloorPath open{kRectangle.corners, false};
  EXPECT_NEAR(score_path({standing(0, 0.5, -90)}, open)->distance_m.max, 0.5, 1e-12);
  EXPECT_NEAR(score_path({standing(0, 0.5, -90)}, kRectangle)->distance_m.max, 0, 1e-12);
  EXPECT_FALSE(score_path({standing(0, 0, 0)}, {{{1, 1}}, false}));
  EXPECT_FALSE(score_path({}, kRectangle));
}

}  // namespace
}  // namespace waymark
