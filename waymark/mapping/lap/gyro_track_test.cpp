#include "waymark/mapping/lap/gyro_track.hpp"

#include <cmath>

#include <gtest/gtest.h>

namespace waymark::internal {
namespace {

SensorTime at(double s) { return SensorTime(Duration(std::llround(1e9 * s))); }

/// A hundred samples a second of a rate, but between two moments.
std::vector<ImuSample> samples(double gap_from_s, double gap_to_s) {
  std::vector<ImuSample> all;
  for (int i = 0; i <= 500; ++i) {
    const double t = 0.01 * i;
    if (t > gap_from_s && t < gap_to_s) continue;
    all.push_back({.stamp = at(t), .angular_velocity_rad_s = {0, 0, std::sin(t)}});
  }
  return all;
}

TEST(GyroTrack, IsTheIntegralOfTheRate) {
  const GyroTrack track(samples(9, 9));
  ASSERT_TRUE(track.turn(at(0.5), at(4.003)));
  EXPECT_NEAR(*track.turn(at(0.5), at(4.003)), std::cos(0.5) - std::cos(4.003), 1e-4);
  EXPECT_FALSE(track.turn(at(4), at(5.1))) << "after the last sample";
  EXPECT_FALSE(track.turn(at(-0.1), at(1))) << "before the first";
}

TEST(GyroTrack, SaysNothingOfATimeThatHoldsAGap) {
  const GyroTrack track(samples(2, 3));
  EXPECT_TRUE(track.turn(at(0.5), at(1.9)));
  EXPECT_TRUE(track.turn(at(3.1), at(4.5)));
  EXPECT_FALSE(track.turn(at(1.5), at(2.5))) << "ends in it";
  EXPECT_FALSE(track.turn(at(2.5), at(3.5))) << "begins in it";
  EXPECT_FALSE(track.turn(at(1.5), at(3.5))) << "both ends are known, what lies between is not";
  EXPECT_TRUE(GyroTrack(samples(2, 2.15)).turn(at(1.5), at(3.5))) << "a few samples";
}

}  // namespace
}  // namespace waymark::internal
