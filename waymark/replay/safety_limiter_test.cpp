// Tests the limiter in isolation: every reason causes a stop, no command exceeds a limit, and a NaN never
// gets through.
#include "waymark/replay/safety_limiter.hpp"

#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"
#include "waymark/base/random.hpp"

namespace waymark {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr double kPi = std::numbers::pi;

TEST(LidarZone, MeasuresTheFreeDistanceAlongACurve) {
  const Hull hull{.front_m = 0.16, .rear_m = 0.16, .width_m = 0.22, .height_m = 0.25};
  LaserScan scan{
      .angle_min_rad = -kPi, .angle_increment_rad = kPi / 180, .range_min_m = 0.1, .range_max_m = 8};
  scan.ranges_m.assign(360, std::numeric_limits<float>::infinity());
  scan.ranges_m[180] = 1.0F;  // straight ahead
  EXPECT_NEAR(free_way_m(scan, SE2(), hull, 0, false), 0.84, 1e-6);
  EXPECT_TRUE(std::isinf(free_way_m(scan, SE2(), hull, 1.5, false))) << "the obstacle is not on the curve";
  EXPECT_TRUE(std::isinf(free_way_m(scan, SE2(), hull, 0, true))) << "there is no obstacle behind the robot";
  scan.ranges_m[0] = 0.5F;  // behind
  EXPECT_NEAR(free_way_m(scan, SE2(), hull, 0, true), 0.34, 1e-6);
  scan.ranges_m.assign(360, std::nanf(""));
  EXPECT_TRUE(std::isinf(free_way_m(scan, SE2(), hull, 0, false)));
}

constexpr SafetyOptions kOptions;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

SafetyInputs all_well() {
  SafetyInputs inputs{.odometry_age_s = 0.02, .gyro_age_s = 0.01};
  inputs.localized = true;
  inputs.position_sigma_m = 0.01;
  inputs.cross_track_m = 0.02;
  inputs.clearance_m = 0.5;
  inputs.dt_s = 0.05;
  inputs.last = {.speed_m_s = 0.3, .yaw_rate_rad_s = 0.1};
  return inputs;
}

TEST(SafetyLimiter, PassesACommandWithinTheLimits) {
  const SafetyVerdict verdict = limit({0.3, 0.1}, all_well(), kOptions);
  EXPECT_FALSE(verdict.stopped);
  EXPECT_EQ(verdict.command, (VelocityCommand{0.3, 0.1}));
}

TEST(SafetyLimiter, EveryReasonStopsAndIsReported) {
  /// The reason contains the measured value and its limit.
  const auto expect_stop = [](auto change, const std::vector<std::string>& values) {
    SafetyInputs inputs = all_well();
    change(inputs);
    SafetyVerdict verdict = limit({0.3, 0.1}, inputs, kOptions);
    EXPECT_LT(verdict.command.speed_m_s, inputs.last.speed_m_s);
    inputs.dt_s = 0.2;
    verdict = limit({0.3, 0.1}, inputs, kOptions);
    EXPECT_EQ(verdict.command, VelocityCommand{});
    const std::string reason = verdict.stopped.value_or("");
    for (const std::string& value : values) EXPECT_THAT(reason, ::testing::HasSubstr(value));
    testing::expect_on_page("replay", reason);
  };
  expect_stop([](auto& in) { in.odometry_age_s = 0.31; }, {"odometry", "0.31 s", "0.30 s"});
  expect_stop([](auto& in) { in.odometry_age_s = kInfinity; }, {"odometry"});
  expect_stop([](auto& in) { in.odometry_age_s = -0.5; }, {"odometry", "0.50 s"});
  expect_stop([](auto& in) { in.gyro_age_s = 0.4; }, {"gyro", "0.40 s", "0.30 s"});
  expect_stop([](auto& in) { in.scan_age_s = 0.6; }, {"lidar", "0.60 s", "0.50 s"});
  expect_stop([](auto& in) { in.image_age_s = 1.1; }, {"image", "1.10 s", "1.00 s"});
  expect_stop([](auto& in) { in.blind_m = 0.6; }, {"0.60 m", "limit 0.50 m", "0.50 m more"});
  expect_stop(
      [](auto& in) {
        in.taught_blind_m = 0.8;
        in.blind_m = 1.4;
      },
      {"1.40 m", "limit 1.30 m", "0.50 m more"});
  expect_stop(
      [](auto& in) {
        in.blind_m = 0.6;
        in.missed = "1 expected tag was not found (1 too faint)";
      },
      {"0.60 m", "1 expected tag was not found (1 too faint)"});
  expect_stop([](auto& in) { in.localized = false; }, {});
  expect_stop([](auto& in) { in.position_sigma_m = 0.2; }, {"0.20 m", "0.10 m"});
  expect_stop([](auto& in) { in.contradicting_frames = 2; }, {});
  expect_stop([](auto& in) { in.cross_track_m = -0.4; }, {"0.40 m", "0.30 m"});
  expect_stop([](auto& in) { in.clearance_m = 0.1; }, {"0.10 m", "0.15 m"});
  expect_stop([](auto& in) { in.obstacle_m = 0.1; }, {"0.10 m", "0.20 m"});
  expect_stop([](auto& in) { in.alarm = "alarm of another check"; }, {"alarm of another check"});
}

TEST(SafetyLimiter, NaNStops) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(limit({nan, 0}, all_well(), kOptions).stopped);
  EXPECT_TRUE(limit({0, nan}, all_well(), kOptions).stopped);
  for (double SafetyInputs::*field :
       {&SafetyInputs::odometry_age_s, &SafetyInputs::gyro_age_s, &SafetyInputs::scan_age_s,
        &SafetyInputs::position_sigma_m, &SafetyInputs::cross_track_m, &SafetyInputs::clearance_m,
        &SafetyInputs::obstacle_m}) {
    SafetyInputs inputs = all_well();
    inputs.*field = nan;
    EXPECT_TRUE(limit({0.3, 0.1}, inputs, kOptions).stopped);
  }
  SafetyInputs inputs = all_well();
  inputs.last.speed_m_s = nan;
  EXPECT_TRUE(limit({0.3, 0.1}, inputs, kOptions).stopped);
  EXPECT_EQ(limit({0.3, 0.1}, inputs, kOptions).command, VelocityCommand{});
  inputs = all_well();
  inputs.dt_s = nan;
  EXPECT_TRUE(std::isfinite(limit({0.4, 0.1}, inputs, kOptions).command.speed_m_s));
}

TEST(SafetyLimiter, OneContradictingFrameSlowsDown) {
  SafetyInputs inputs = all_well();
  inputs.contradicting_frames = 1;
  const SafetyVerdict verdict = limit({0.3, 0.1}, inputs, kOptions);
  EXPECT_FALSE(verdict.stopped);
  EXPECT_TRUE(verdict.slowed);
  EXPECT_NEAR(verdict.command.speed_m_s, 0.3 - kOptions.max_deceleration_m_s2 * inputs.dt_s, 1e-9);
  inputs.dt_s = 0.2;
  EXPECT_NEAR(limit({0.3, 0.1}, inputs, kOptions).command.speed_m_s, 0.06, 1e-9);
}

TEST(SafetyLimiter, DoesNotCreepAfterAStopForPositionUncertainty) {
  SafetyInputs inputs = all_well();
  inputs.position_sigma_m = 0.101;
  SafetyVerdict verdict = limit({0.3, 0.1}, inputs, kOptions);
  EXPECT_TRUE(verdict.stopped && verdict.unsure);
  inputs.unsure = verdict.unsure;
  inputs.position_sigma_m = 0.099;
  verdict = limit({0.3, 0.1}, inputs, kOptions);
  EXPECT_THAT(verdict.stopped.value_or(""),
              ::testing::AllOf(::testing::HasSubstr("0.10 m"), ::testing::HasSubstr("0.05 m")));
  testing::expect_on_page("replay", verdict.stopped.value_or(""));
  EXPECT_TRUE(verdict.unsure);
  inputs.position_sigma_m = 0.049;
  verdict = limit({0.3, 0.1}, inputs, kOptions);
  EXPECT_FALSE(verdict.stopped || verdict.unsure);
}

/// Arbitrary inputs ranging from far below to far above the limits, sometimes NaN.
SafetyInputs any_inputs(Random& random) {
  SafetyInputs inputs = all_well();
  inputs.last = {random.uniform(-0.5, 0.5), random.uniform(-1.5, 1.5)};
  inputs.position_sigma_m = random.uniform(0, 0.12);
  inputs.obstacle_m = random.uniform(0.1, 2);
  inputs.odometry_age_s = random.uniform(0, 0.32);
  inputs.dt_s = random.uniform(0, 0.1);
  return inputs;
}

TEST(SafetyLimiter, LimitsHoldForArbitraryInputs) {
  Random random(1);
  int stops = 0;
  for (int i = 0; i < 50000; ++i) {
    const SafetyInputs inputs = any_inputs(random);
    SafetyOptions options;
    options.max_curvature_1_m = i % 2 == 0 ? 2.5 : 0;
    const VelocityCommand wanted{random.uniform(-3, 3), random.uniform(-9, 9)};
    const SafetyVerdict verdict = limit(wanted, inputs, options);
    const VelocityCommand& out = verdict.command;
    stops += verdict.stopped ? 1 : 0;
    ASSERT_LE(std::abs(out.speed_m_s), options.max_speed_m_s + 1e-12);
    ASSERT_LE(std::abs(out.yaw_rate_rad_s), options.max_yaw_rate_rad_s + 1e-12);
    const double faster = std::abs(out.speed_m_s) - std::abs(inputs.last.speed_m_s);
    ASSERT_LE(faster, options.max_acceleration_m_s2 * inputs.dt_s + 1e-12);
    ASSERT_GE(faster, -options.max_deceleration_m_s2 * inputs.dt_s - 1e-12) << "also for a stop";
    ASSERT_GE(out.speed_m_s * inputs.last.speed_m_s, 0) << "never crosses zero in one step";
    if (options.max_curvature_1_m > 0 && !verdict.stopped) {
      ASSERT_LE(std::abs(out.yaw_rate_rad_s), options.max_curvature_1_m * std::abs(out.speed_m_s) + 1e-12);
    }
    const double turning = std::abs(out.yaw_rate_rad_s) - std::abs(inputs.last.yaw_rate_rad_s);
    ASSERT_LE(turning, options.max_yaw_acceleration_rad_s2 * inputs.dt_s + 1e-12);
    if (verdict.stopped) {
      ASSERT_LE(faster, 0) << "a stop never increases the speed";
    }
  }
  EXPECT_GT(stops, 1000);
  EXPECT_LT(stops, 40000);
}

TEST(SafetyLimiter, AStopBrakesToZeroAlongTheCurve) {
  SafetyInputs inputs = all_well();
  inputs.alarm = "a reason";
  inputs.last = {0.5, 0.4};
  double way_m = 0;
  for (int i = 0; i < 20; ++i) {
    const VelocityCommand before = inputs.last;
    inputs.last = limit({0.5, 1.0}, inputs, kOptions).command;
    if (inputs.last.speed_m_s > 0) {
      EXPECT_NEAR(inputs.last.yaw_rate_rad_s / inputs.last.speed_m_s, 0.8, 1e-9);
    }
    EXPECT_LE(inputs.last.speed_m_s, before.speed_m_s);
    way_m += inputs.last.speed_m_s * inputs.dt_s;
  }
  EXPECT_EQ(inputs.last, VelocityCommand{});
  EXPECT_LE(way_m, 0.5 * 0.5 / (2 * kOptions.max_deceleration_m_s2));
}

TEST(SafetyLimiter, SlowsForUncertaintyAndObstacles) {
  SafetyInputs inputs = all_well();
  inputs.position_sigma_m = 0.075;
  inputs.dt_s = 0.2;
  const SafetyVerdict verdict = limit({0.3, 0.1}, inputs, kOptions);
  EXPECT_TRUE(verdict.slowed);
  EXPECT_NEAR(verdict.command.speed_m_s, 0.15, 1e-9);
  inputs = all_well();
  inputs.obstacle_m = 0.4;
  inputs.dt_s = 0.2;
  EXPECT_NEAR(limit({0.3, 0.1}, inputs, kOptions).command.speed_m_s, 0.15, 1e-9);
}

TEST(SafetyLimiter, RefusesABadStartAndReportsTheCorrection) {
  EXPECT_FALSE(start_refusal(0.3, 0.2, kOptions));
  const std::string aside = start_refusal(-0.8, 0, kOptions).value_or("");
  EXPECT_THAT(aside, AllOf(HasSubstr("0.80 m"), HasSubstr("right"), HasSubstr("0.50 m")));
  testing::expect_on_page("replay", aside);
  const std::string askew = start_refusal(0.1, 1.5708, kOptions).value_or("");
  EXPECT_THAT(askew, AllOf(HasSubstr("90 degrees"), HasSubstr("left")));
  testing::expect_on_page("replay", askew);
  EXPECT_TRUE(start_refusal(std::nan(""), 0, kOptions));
}

}  // namespace
}  // namespace waymark
