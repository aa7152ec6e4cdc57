#include "waymark/samples/clock_check.hpp"

#include <cmath>

#include <gtest/gtest.h>

namespace waymark {
namespace {

SensorTime at_s(double seconds) { return SensorTime(Duration(std::llround(1e9 * seconds))); }

constexpr double kWallClock_s = 1'700'000'000;

/// 38 s of images by the wall clock; other samples begin at `from_s` and last as long.
ClockCheck drive(double from_s) {
  ClockCheck check;
  for (int i = 0; i <= 38; ++i) {
    check.add(TagFrame{.stamp = at_s(kWallClock_s + i)});
    check.add(Odometry{.stamp = at_s(from_s + i)});
  }
  return check;
}

TEST(ClockCheck, SamplesOfOneClockOverlap) {
  for (const double from_s : {kWallClock_s, kWallClock_s - 37, kWallClock_s + 37, kWallClock_s + 38.5}) {
    EXPECT_TRUE(drive(from_s).overlaps(StampedKind::Odometry)) << from_s;
    EXPECT_FALSE(drive(from_s).mismatch()) << from_s;
  }
}

TEST(ClockCheck, SimulatedTimeAndWallTimeAreTwoClocks) {
  ClockCheck check = drive(0);
  for (int i = 0; i <= 38; ++i) check.add(ImuSample{.stamp = at_s(i)});
  check.add(TruthPose{.stamp = at_s(kWallClock_s + 1)});
  EXPECT_FALSE(check.overlaps(StampedKind::Odometry));
  EXPECT_FALSE(check.overlaps(StampedKind::Imu));
  EXPECT_TRUE(check.overlaps(StampedKind::Truth));
  EXPECT_TRUE(check.overlaps(StampedKind::Observations));
  EXPECT_NEAR(check.apart_s(StampedKind::Odometry).value(), kWallClock_s, 1.5) << "a stamp of zero is unset";
  const auto mismatch = check.mismatch();
  ASSERT_TRUE(mismatch);
  EXPECT_EQ(mismatch->error.code, ErrorCode::InvalidArgument);
  EXPECT_EQ(mismatch->kinds, (std::set{StampedKind::Odometry, StampedKind::Imu}));
  EXPECT_TRUE(affects(mismatch, StampedKind::Imu));
  EXPECT_FALSE(affects(mismatch, StampedKind::Truth));
  EXPECT_FALSE(affects(std::nullopt, StampedKind::Odometry));
}

TEST(ClockCheck, EarlierAndLaterClocksAreFound) {
  for (const double from_s : {kWallClock_s - 3600, kWallClock_s + 3600, kWallClock_s + 40}) {
    const auto apart_s = drive(from_s).apart_s(StampedKind::Odometry);
    ASSERT_TRUE(apart_s) << from_s;
    EXPECT_NEAR(*apart_s, std::abs(from_s - kWallClock_s), 1e-6);
  }
}

TEST(ClockCheck, UnsetStampsDoNotCount) {
  ClockCheck check = drive(kWallClock_s);
  check.add(Odometry{.stamp = {}});
  check.add(ImuSample{.stamp = {}});
  EXPECT_FALSE(check.mismatch());
  ClockCheck unset_images = drive(kWallClock_s - 3600);
  unset_images.add(TagFrame{.stamp = {}});
  EXPECT_TRUE(unset_images.mismatch()) << "an image with stamp zero does not connect the clocks";
}

TEST(ClockCheck, WithoutObservationsThereIsNothingToCompare) {
  ClockCheck check;
  check.add(Odometry{.stamp = at_s(1)});
  check.add(ImuSample{.stamp = at_s(1e9)});
  check.add(StampedCommand{.stamp = at_s(5e9)});
  EXPECT_FALSE(check.mismatch());
  EXPECT_FALSE(stamped_kind(StampedCommand{}));
}

}  // namespace
}  // namespace waymark
