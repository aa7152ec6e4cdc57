#include "waymark/evaluation/pose_pairs.hpp"

#include <chrono>
#include <cmath>

#include <gtest/gtest.h>

#include "waymark/geometry/planar.hpp"

namespace waymark {
namespace {

SensorTime at_s(double seconds) { return SensorTime(Duration(std::llround(seconds * 1e9))); }

TEST(Pairs, InterpolateButNotAcrossGaps) {
  Trajectory truth = {{at_s(0), SE3()}, {at_s(1), SE3(SO3::exp({0, 0, 1}), {2, 0, 0})}, {at_s(9), SE3()}};
  const auto half = pose_at(truth, at_s(0.5), std::chrono::seconds(2));
  ASSERT_TRUE(half);
  EXPECT_NEAR(half->translation().x(), 1, 1e-12);
  EXPECT_NEAR(project_to_plane(*half).yaw(), 0.5, 1e-12);
  EXPECT_FALSE(pose_at(truth, at_s(5), std::chrono::seconds(2)));
  EXPECT_FALSE(pose_at(truth, at_s(-0.1), std::chrono::seconds(2)));
  EXPECT_FALSE(pose_at(truth, at_s(9.1), std::chrono::seconds(2)));
  EXPECT_TRUE(pose_at(truth, at_s(9), std::chrono::seconds(2)));
}

}  // namespace
}  // namespace waymark
