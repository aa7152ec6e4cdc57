// The limiter alone: every reason stops, nothing it lets through breaks a limit, and a NaN never passes.
#include "waymark/replay/safety_limiter.hpp"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "waymark/base/random.hpp"

namespace waymark {
namespace {

constexpr SafetyOptions kOptions;

SafetyInputs all_well() {
  return {.odometry_age_s = 0.02,
          .localized = true,
          .position_sigma_m = 0.01,
          .cross_track_m = 0.02,
          .clearance_m = 0.5,
          .dt_s = 0.05,
          .last = {.speed_m_s = 0.3, .yaw_rate_rad_s = 0.1}};
}

TEST(SafetyLimiter, LetsAGoodCommandThrough) {
  const SafetyVerdict verdict = limit({0.3, 0.1}, all_well(), kOptions);
  EXPECT_FALSE(verdict.stopped);
  EXPECT_EQ(verdict.command, (VelocityCommand{0.3, 0.1}));
}

TEST(SafetyLimiter, EveryReasonStopsWithItsWords) {
  const auto words = [](auto change) {
    SafetyInputs inputs = all_well();
    change(inputs);
    const SafetyVerdict verdict = limit({0.3, 0.1}, inputs, kOptions);
    EXPECT_EQ(verdict.command, VelocityCommand{});
    return verdict.stopped.value_or("");
  };
  EXPECT_EQ(words([](auto& in) { in.odometry_age_s = 0.31; }), "odometry is 0.31 s old (limit 0.30 s)");
  EXPECT_EQ(words([](auto& in) { in.odometry_age_s = std::numeric_limits<double>::infinity(); }),
            "no odometry arrived yet");
  EXPECT_EQ(words([](auto& in) { in.localized = false; }),
            "the position is not known: no mapped tag was seen yet");
  EXPECT_EQ(words([](auto& in) { in.position_sigma_m = 0.2; }),
            "the position is known only to 0.20 m (limit 0.10 m)");
  EXPECT_EQ(words([](auto& in) { in.cross_track_m = -0.4; }), "0.40 m from the route (limit 0.30 m)");
  EXPECT_EQ(words([](auto& in) { in.clearance_m = 0.1; }), "a tag is 0.10 m from the hull (limit 0.15 m)");
}

TEST(SafetyLimiter, NaNIsAStop) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(limit({nan, 0}, all_well(), kOptions).stopped);
  EXPECT_TRUE(limit({0, nan}, all_well(), kOptions).stopped);
  for (double SafetyInputs::*field : {&SafetyInputs::odometry_age_s, &SafetyInputs::position_sigma_m,
                                      &SafetyInputs::cross_track_m, &SafetyInputs::clearance_m}) {
    SafetyInputs inputs = all_well();
    inputs.*field = nan;
    EXPECT_TRUE(limit({0.3, 0.1}, inputs, kOptions).stopped);
  }
}

TEST(SafetyLimiter, WhateverIsWantedLimitsHold) {
  Random random(1);
  for (int i = 0; i < 20000; ++i) {
    SafetyInputs inputs = all_well();
    inputs.last = {random.uniform(-0.5, 0.5), random.uniform(-1.5, 1.5)};
    inputs.position_sigma_m = random.uniform(0, 0.1);
    inputs.dt_s = random.uniform(0, 0.1);
    const VelocityCommand wanted{random.uniform(-3, 3), random.uniform(-9, 9)};
    const SafetyVerdict verdict = limit(wanted, inputs, kOptions);
    ASSERT_FALSE(verdict.stopped);
    EXPECT_LE(std::abs(verdict.command.speed_m_s), kOptions.max_speed_m_s + 1e-12);
    EXPECT_LE(std::abs(verdict.command.yaw_rate_rad_s), kOptions.max_yaw_rate_rad_s + 1e-12);
    const double faster = std::abs(verdict.command.speed_m_s) - std::abs(inputs.last.speed_m_s);
    EXPECT_LE(faster, kOptions.max_acceleration_m_s2 * inputs.dt_s + 1e-12);
    EXPECT_LE(std::abs(verdict.command.yaw_rate_rad_s - inputs.last.yaw_rate_rad_s),
              kOptions.max_yaw_acceleration_rad_s2 * inputs.dt_s + 1e-12);
  }
}

TEST(SafetyLimiter, SlowsWhileThePositionIsPoorlyKnown) {
  SafetyInputs inputs = all_well();
  inputs.position_sigma_m = 0.075;
  const SafetyVerdict verdict = limit({0.3, 0.1}, inputs, kOptions);
  EXPECT_TRUE(verdict.slowed);
  EXPECT_NEAR(verdict.command.speed_m_s, 0.15, 1e-9);
}

TEST(SafetyLimiter, RefusesABadStartAndSaysWhereToPutTheRobot) {
  EXPECT_FALSE(start_refusal(0.3, 0.2, kOptions));
  EXPECT_EQ(start_refusal(-0.8, 0, kOptions),
            "the robot is 0.80 m to the right of the route: put it within 0.50 m");
  EXPECT_EQ(start_refusal(0.1, 1.5708, kOptions),
            "the robot points 90 degrees to the left of the route: turn it along the route");
  EXPECT_TRUE(start_refusal(std::nan(""), 0, kOptions));
}

}  // namespace
}  // namespace waymark
