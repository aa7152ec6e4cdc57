#include "waymark/replay/picture_delay.hpp"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "waymark/base/random.hpp"

namespace waymark {
namespace {

/// A robot that goes round bends to both sides: heading [rad] after a time.
double heading(double time_s) { return 0.6 * std::sin(0.9 * time_s) + 0.2 * time_s; }

struct Drive {
  std::vector<HeadingAt> pictures;
  std::vector<HeadingAt> odometry;
};

Drive drive(double delay_s, double gain, std::uint64_t seed) {
  Drive made;
  Random random(seed);
  for (int i = 0; i < 450; ++i) made.odometry.push_back({0.02 * i, heading(0.02 * i) / gain});
  for (int i = 10; i < 130; ++i) {
    const double t = i / 15.0;
    made.pictures.push_back({t, heading(t - delay_s) + random.normal(0, 0.006)});
  }
  return made;
}

TEST(PictureDelay, IsFoundWhateverShareOfItsTurnsTheRobotTurns) {
  for (const double gain : {0.3, 1.0}) {
    for (const double delay_s : {0.2, 0.3, 0.45}) {
      const Drive d = drive(delay_s, gain, 7);
      const auto found = find_delay(d.pictures, d.odometry, 0.8);
      ASSERT_TRUE(found) << delay_s;
      EXPECT_NEAR(found->delay_s, delay_s, 0.04);
      EXPECT_LT(found->rms_rad, 0.015);
    }
  }
}

TEST(PictureDelay, NothingWherePicturesAreInTimeOrTheRobotDrivesStraight) {
  const Drive in_time = drive(0, 0.6, 8);
  EXPECT_FALSE(find_delay(in_time.pictures, in_time.odometry, 0.8));
  Drive even = drive(0.3, 1, 9);
  for (auto* headings : {&even.pictures, &even.odometry})
    for (HeadingAt& at : *headings) at.yaw_rad = 0.4 * at.time_s;  // a circle tells no delay
  EXPECT_FALSE(find_delay(even.pictures, even.odometry, 0.8));
  Drive stuck = drive(0.3, 1, 10);
  for (HeadingAt& at : stuck.pictures) at.yaw_rad = 0.3;
  EXPECT_FALSE(find_delay(stuck.pictures, stuck.odometry, 0.8)) << "that is no delay";
}

}  // namespace
}  // namespace waymark
