// Tests the interpolation of odometry and the gyro rotation between two times.
#include "waymark/mapping/lap/motion_tracks.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "waymark/geometry/lie.hpp"

namespace waymark {
namespace {

SensorTime at_ms(std::int64_t ms) { return SensorTime(std::chrono::milliseconds(ms)); }

/// A bend at 0.5 m/s and 0.4 rad/s, with a sample every 50 ms.
std::vector<Odometry> bend() {
  std::vector<Odometry> samples;
  SE2 at(1, 2, 3);
  for (int i = 0; i <= 40; ++i) {
    samples.push_back({at_ms(50 * i), at});
    at = at * SE2::exp({0.025, 0, 0.02});
  }
  return samples;
}

TEST(OdometryTrack, FollowsTheTwistBetweenSamples) {
  const auto samples = bend();
  const OdometryTrack track(samples);
  EXPECT_EQ(track.at(at_ms(500))->x(), samples[10].odom_T_base.x());
  const SE2 between = samples[10].odom_T_base * SE2::exp({0.0075, 0, 0.006});
  EXPECT_LT(minus(*track.at(at_ms(515)), between).norm(), 1e-9);
  const auto rate = track.rate_at(at_ms(700));
  ASSERT_TRUE(rate);
  EXPECT_LT((*rate - SE2::Tangent(0.5, 0, 0.4)).norm(), 1e-6);
}

TEST(OdometryTrack, IsEmptyOutsideAndInGaps) {
  auto samples = bend();
  samples.erase(samples.begin() + 10, samples.begin() + 30);
  const OdometryTrack track(samples);
  EXPECT_FALSE(track.at(at_ms(-1)));
  EXPECT_FALSE(track.at(at_ms(2001)));
  EXPECT_FALSE(track.at(at_ms(1000)));
  EXPECT_TRUE(track.at(at_ms(1000), std::chrono::seconds(2)));
  EXPECT_FALSE(track.rate_at(at_ms(0)));
  EXPECT_TRUE(OdometryTrack({}).empty());
}

TEST(OdometryTrack, SkipsNonFiniteAndLateSamples) {
  auto samples = bend();
  samples.insert(samples.begin() + 5, {at_ms(10), SE2(100, 100, 0)});
  samples.insert(samples.begin() + 20, {at_ms(931), SE2(0, std::nan(""), 0)});
  const OdometryTrack track(samples);
  EXPECT_EQ(track.left_out(), 2);
  EXPECT_LT(minus(*track.at(at_ms(931)), *OdometryTrack(bend()).at(at_ms(931))).norm(), 1e-9);
}

}  // namespace
}  // namespace waymark

namespace waymark::internal {
namespace {

SensorTime at(double s) { return SensorTime(Duration(std::llround(1e9 * s))); }

/// One hundred samples per second, with a gap between two times.
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

TEST(GyroTrack, IsEmptyForATimeWithAGap) {
  const GyroTrack track(samples(2, 3));
  EXPECT_TRUE(track.turn(at(0.5), at(1.9)));
  EXPECT_TRUE(track.turn(at(3.1), at(4.5)));
  EXPECT_FALSE(track.turn(at(1.5), at(2.5))) << "ends in the gap";
  EXPECT_FALSE(track.turn(at(2.5), at(3.5))) << "begins in the gap";
  EXPECT_FALSE(track.turn(at(1.5), at(3.5))) << "the gap is between the ends";
  EXPECT_TRUE(GyroTrack(samples(2, 2.15)).turn(at(1.5), at(3.5))) << "a short gap";
}

}  // namespace
}  // namespace waymark::internal
