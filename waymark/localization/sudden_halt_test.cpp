#include "waymark/localization/sudden_halt.hpp"

#include <gtest/gtest.h>
#include <cmath>

namespace waymark {
namespace {

constexpr double kPeriod_s = 0.02;

MotionStep step_at(double speed_m_s, double yaw_rate_rad_s = 0) {
  return {.twist = {speed_m_s * kPeriod_s, 0, yaw_rate_rad_s * kPeriod_s},
          .dt_s = kPeriod_s,
          .standing = speed_m_s == 0};
}

TEST(SuddenHalt, WheelsThatStopAtOnceAreDoubtedByTheWayThatTheyWouldHaveGone) {
  SuddenHalt halt;
  EXPECT_EQ(halt.advance(step_at(0.3)).extra_m2, 0);
  double variance_m2 = 0;
  for (int i = 0; i < 10; ++i) {
    const MotionStep doubted = halt.advance(step_at(0));
    EXPECT_FALSE(doubted.standing);
    variance_m2 += doubted.extra_m2;
  }
  EXPECT_NEAR(std::sqrt(variance_m2), 0.3 * 10 * kPeriod_s, 1e-9);
}

TEST(SuddenHalt, TheHeadingIsDoubtedOnlyWhereNoGyroTellsOfIt) {
  for (const double gyro_rad_s : {0.0, 0.28}) {
    SuddenHalt halt;
    (void)halt.advance(step_at(0.3, 0.3));
    const double doubt_rad2 = halt.advance(step_at(0, gyro_rad_s)).extra_rad2;
    EXPECT_NEAR(doubt_rad2, gyro_rad_s == 0 ? std::pow(0.3 * kPeriod_s, 2) : 0, 1e-12);
  }
}

TEST(SuddenHalt, ARobotThatBrakesIsBelieved) {
  SuddenHalt halt;
  for (double speed_m_s = 0.8; speed_m_s > 0; speed_m_s -= 5 * kPeriod_s)
    (void)halt.advance(step_at(speed_m_s));
  const MotionStep stood = halt.advance(step_at(0));
  EXPECT_FALSE(halt.doubted());
  EXPECT_EQ(stood.extra_m2, 0);
  EXPECT_TRUE(stood.standing);
}

TEST(SuddenHalt, OdometryOfFewMessagesASecondIsBelieved) {
  SuddenHalt halt;
  (void)halt.advance({.twist = {0.03, 0, 0}, .dt_s = 0.1});
  EXPECT_EQ(halt.advance({.dt_s = 0.1}).extra_m2, 0) << "from 0.3 m/s in 0.1 s";
  SuddenHalt divided;
  (void)divided.advance({.twist = {0.003, 0, 0}, .dt_s = 0.01, .share = 0.1});
  EXPECT_EQ(divided.advance({.dt_s = 0.01, .share = 0.1}).extra_m2, 0) << "a tenth of such a message";
}

TEST(SuddenHalt, TagsDecide) {
  SuddenHalt stands;
  SuddenHalt moves;
  (void)stands.advance(step_at(0.3));
  (void)moves.advance(step_at(0.3));
  for (int i = 0; i < 4; ++i) {
    (void)stands.advance(step_at(0));
    (void)moves.advance(step_at(0));
  }
  stands.observe_correction(0.002);
  moves.observe_correction(0.024);
  EXPECT_FALSE(stands.doubted());
  EXPECT_TRUE(moves.doubted());
  EXPECT_NEAR(moves.advance(step_at(0)).extra_m2, std::pow(0.3 * kPeriod_s, 2), 1e-12) << "from the tags on";
  EXPECT_EQ(moves.advance(step_at(0.3)).extra_m2, 0) << "the encoders go on";
}

}  // namespace
}  // namespace waymark
