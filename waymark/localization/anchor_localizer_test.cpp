// Tests the anchor method on a straight drive past mapped tags, with simulated corners.
#include "waymark/localization/anchor_localizer.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "waymark/base/random.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/samples/visibility.hpp"

namespace waymark {
namespace {

SensorTime at(double seconds) { return SensorTime(Duration(std::llround(seconds * 1e9))); }

CameraModel camera() {
  return CameraModel::make(
             PinholeRadtan{.fx = 440, .fy = 440, .cx = 320, .cy = 240, .k = {}, .coefficients = 0}, 640, 480)
      .value();
}

SE3 base_T_cam() {
  const Eigen::Matrix3d optical = (Eigen::Matrix3d() << 0, 0, 1, -1, 0, 0, 0, -1, 0).finished();
  return {SO3::from_matrix(optical), {0.08, 0, 0.18}};
}

/// Upright tags on both sides of the x axis, facing a robot that drives along it.
TagMap tags() {
  TagMap map;
  const Eigen::Matrix3d ahead = (Eigen::Matrix3d() << 0, 0, 1, -1, 0, 0, 0, -1, 0).finished();
  for (int i = 0; i < 8; ++i) {
    const double side = i % 2 == 0 ? 1 : -1;
    const SE3 place = lift(SE2(1.5 + 0.5 * i, 0.8 * side, 0.6 * side));
    map.tags[{.number = i}] = {.map_T_tag = place * SE3(SO3::from_matrix(ahead), {0, 0, 0.3}),
                               .size_m = 0.16};
  }
  return map;
}

TagFrame observe(const SE2& map_X_base, double seconds, Random* random) {
  TagFrame frame{.stamp = at(seconds)};
  const SE3 cam_T_map = (lift(map_X_base) * base_T_cam()).inverse();
  for (const auto& [id, tag] : tags().tags) {
    const auto corners = visible_corners(camera(), cam_T_map * tag.map_T_tag, tag.size_m);
    if (!corners) continue;
    TagDetection seen{.tag = id, .corners_px = *corners};
    for (auto& corner : seen.corners_px) {
      if (random != nullptr) corner += 0.15 * Eigen::Vector2d(random->normal(), random->normal());
    }
    seen.corner_covariance_px2 = CornerCovariance::Identity() * 0.15 * 0.15;
    frame.detections.push_back(seen);
  }
  return frame;
}

Odometry odometry(const SE2& odom_X_base, double seconds) {
  return {.stamp = at(seconds), .odom_T_base = odom_X_base};
}

double distance(const LocalizationEstimate& estimate, const SE2& truth) {
  return (estimate.map_T_base.translation() - truth.translation()).norm();
}

TEST(AnchorLocalizer, IsExactWithoutNoiseAfterFramesToStart) {
  AnchorLocalizer localizer(tags(), camera(), base_T_cam());
  const SE2 truth(0, 0.1, 0.05);
  localizer.add(odometry(SE2(7, 7, 2), 0.99));
  for (int i = 0; i < AnchorOptions{}.frames_to_start; ++i) {
    EXPECT_FALSE(localizer.estimate());
    localizer.add(odometry(SE2(7, 7, 2), 1 + 0.1 * i));
    localizer.add(observe(truth, 1 + 0.1 * i, nullptr));
  }
  ASSERT_TRUE(localizer.estimate());
  EXPECT_LT(distance(*localizer.estimate(), truth), 1e-6);
  EXPECT_NEAR(localizer.estimate()->map_T_base.yaw(), 0.05, 1e-6);
}

TEST(AnchorLocalizer, PlainAcceptsTheFirstFrameAndEveryLaterOne) {
  AnchorLocalizer localizer(tags(), camera(), base_T_cam(), {.plain = true});
  const SE2 truth(0, 0.1, 0.05);
  localizer.add(odometry(SE2(7, 7, 2), 1));
  EXPECT_FALSE(localizer.estimate());
  localizer.add(observe(truth, 1, nullptr));
  ASSERT_TRUE(localizer.estimate());
  EXPECT_LT(distance(*localizer.estimate(), truth), 1e-6);
  Random random(5);
  const double before = distance(*localizer.estimate(), truth);
  localizer.add(observe(truth, 1.1, &random));
  EXPECT_GT(distance(*localizer.estimate(), truth), before + 1e-5)
      << "the noisy fix must replace the better prediction";
  const SE2 elsewhere(0.4, 0.1, 0.05);
  for (int i = 1; i <= AnchorOptions{}.jumps_to_restart; ++i) {
    EXPECT_LT(distance(*localizer.estimate(), truth), 0.1) << "a jump from a far tag is rejected";
    localizer.add(observe(elsewhere, 1.1 + 0.1 * i, nullptr));
  }
  EXPECT_LT(distance(*localizer.estimate(), elsewhere), 1e-6);
}

TEST(AnchorLocalizer, ErrorAtStandstillIsWithinThreeSigma) {
  int within = 0;
  double sigma_m = 0;
  constexpr int kRuns = 100;
  for (int run = 0; run < kRuns; ++run) {
    Random random(static_cast<std::uint64_t>(run));
    AnchorLocalizer localizer(tags(), camera(), base_T_cam());
    const SE2 truth(0, 0.1, 0.05);
    for (int i = 0; i < 20; ++i) {
      localizer.add(odometry({}, 1 + 0.1 * i));
      localizer.add(observe(truth, 1 + 0.1 * i, &random));
    }
    ASSERT_TRUE(localizer.estimate());
    sigma_m = localizer.estimate()->position_sigma_m();
    within += distance(*localizer.estimate(), truth) < 3 * sigma_m ? 1 : 0;
    EXPECT_LT(sigma_m, 0.10) << "certain enough to start a replay";
  }
  EXPECT_GE(within, 97);
}

TEST(AnchorLocalizer, SigmaGrowsWithOdometryBetweenFixes) {
  AnchorLocalizer localizer(tags(), camera(), base_T_cam());
  for (int i = 0; i < 10; ++i) {
    localizer.add(odometry({}, 1 + 0.1 * i));
    localizer.add(observe(SE2(), 1 + 0.1 * i, nullptr));
  }
  const double before = localizer.estimate()->position_sigma_m();
  for (int i = 1; i <= 100; ++i) localizer.add(odometry(SE2(0.01 * i, 0, 0), 2 + 0.02 * i));
  EXPECT_LT(distance(*localizer.estimate(), SE2(1, 0, 0)), 1e-6);
  EXPECT_GT(localizer.estimate()->position_sigma_m(), before + 0.01);
}

TEST(AnchorLocalizer, RecoversARobotThatWasMovedByHand) {
  AnchorLocalizer localizer(tags(), camera(), base_T_cam());
  Random random(1);
  double seconds = 1;
  const auto observe_at = [&](const SE2& truth, int frames) {
    for (int i = 0; i < frames; ++i, seconds += 0.1) {
      localizer.add(odometry({}, seconds));
      localizer.add(observe(truth, seconds, &random));
    }
  };
  observe_at(SE2(0, 0, 0), 10);
  EXPECT_LT(distance(*localizer.estimate(), SE2(0, 0, 0)), 0.15);
  observe_at(SE2(1, 0.5, -0.2), 30);
  EXPECT_LT(distance(*localizer.estimate(), SE2(1, 0.5, -0.2)), 0.15);
}

TEST(AnchorLocalizer, HasNoEstimateWithoutTags) {
  AnchorLocalizer localizer(tags(), camera(), base_T_cam());
  localizer.add(TagFrame{.stamp = at(1)});
  EXPECT_FALSE(localizer.estimate());
  for (int i = 0; i < 20; ++i) {
    localizer.add(odometry({}, 1 + 0.1 * i));
    localizer.add(TagFrame{.stamp = at(1 + 0.1 * i)});
  }
  EXPECT_FALSE(localizer.estimate());
  EXPECT_EQ(localizer.fixes(), 0);
}

}  // namespace
}  // namespace waymark
