#include "waymark/mapping/lap/turn_noise.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "waymark/base/random.hpp"
#include "waymark/geometry/planar.hpp"

namespace waymark {
namespace {

/// A minute of bends: the wheels tell turns `1 / scale` times too large, with a random walk of the true
/// heading beside them.
struct Drive {
  Trajectory trajectory{};
  std::vector<Matrix6> covariance{};
  std::vector<Odometry> odometry{};
};

Drive drive_noisily(double scale, double noise_rad_sqrt_m, std::uint64_t seed) {
  constexpr double kDt_s = 0.02;
  constexpr double kSpeed_m_s = 0.3;
  Drive made;
  Random random(seed);
  SE2 truth;
  SE2 odom;
  for (int i = 0; i <= 6000; ++i) {
    const SensorTime stamp(std::chrono::milliseconds(20 * i));
    made.odometry.push_back({.stamp = stamp, .odom_T_base = odom});
    if (i % 4 == 2) {
      made.trajectory.push_back({stamp, lift(truth)});
      made.covariance.emplace_back(1e-6 * Matrix6::Identity());
    }
    const double turn = kDt_s * 0.4 * std::sin(0.02 * i);
    const double slip = noise_rad_sqrt_m * std::sqrt(kSpeed_m_s * kDt_s) * random.normal();
    odom = odom * SE2::exp({kDt_s * kSpeed_m_s, 0, turn / scale});
    truth = truth * SE2::exp({kDt_s * kSpeed_m_s, 0, turn + slip});
  }
  return made;
}

TEST(TurnNoise, IsWhatWheelsAndTrajectoryDifferInAfterTheScale) {
  for (const double noise : {0.01, 0.13}) {
    for (const double scale : {0.2, 1.2}) {
      const Drive made = drive_noisily(scale, noise, 7);
      const auto found = turn_noise(made.trajectory, made.covariance, made.odometry, scale);
      ASSERT_TRUE(found);
      EXPECT_GT(found->stretches, 100);
      EXPECT_NEAR(found->rad_sqrt_m, noise, 0.2 * noise) << scale;
      EXPECT_GT(found->scale_sigma, 0);
      EXPECT_LT(found->scale_sigma, 0.2 * scale);
    }
  }
}

TEST(TurnNoise, TheScaleOfTheTurnsIsFoundAsWellAsItsNoiseSays) {
  for (const double scale : {0.2, 1.0, 1.2}) {
    double squares = 0;
    constexpr int kDrives = 12;
    for (std::uint64_t seed = 1; seed <= kDrives; ++seed) {
      const Drive made = drive_noisily(scale, 0.02, seed);
      const auto found = turn_scale(made.trajectory, made.covariance, made.odometry);
      ASSERT_TRUE(found);
      const auto noise = turn_noise(made.trajectory, made.covariance, made.odometry, *found);
      ASSERT_TRUE(noise);
      squares += std::pow((*found - scale) / noise->scale_sigma, 2);
    }
    EXPECT_GT(squares / kDrives, 0.3) << scale;
    EXPECT_LT(squares / kDrives, 2.2) << scale;
  }
}

/// Bends to the left only, the faster the larger `share`; the odometry's rate has an error that wanders.
Drive one_sided(double share, std::uint64_t seed) {
  constexpr double kDt_s = 0.02;
  Drive made;
  Random random(seed);
  SE2 truth;
  SE2 odom;
  double bias_rad_s = 0.003;
  for (int i = 0; i <= 3000; ++i) {
    const SensorTime stamp(std::chrono::milliseconds(20 * i));
    made.odometry.push_back({.stamp = stamp, .odom_T_base = odom});
    if (i % 4 == 2) {
      made.trajectory.push_back({stamp, lift(truth)});
      made.covariance.emplace_back(1e-6 * Matrix6::Identity());
    }
    bias_rad_s += 0.0006 * std::sqrt(kDt_s) * random.normal();
    const double rate = 0.13 * (1 + share * std::sin(0.005 * i));
    odom = odom * SE2::exp({kDt_s * 0.3, 0, kDt_s * (rate + bias_rad_s + 0.02 * random.normal())});
    truth = truth * SE2::exp({kDt_s * 0.3, 0, kDt_s * rate});
  }
  return made;
}

TEST(TurnNoise, OneSidedBendsAtOneRateDoNotTellTheScale) {
  const auto sigma = [](double share) {
    const Drive made = one_sided(share, 3);
    return turn_scale_sigma(made.trajectory, made.covariance, made.odometry).value();
  };
  EXPECT_GT(sigma(0.02), 0.05) << "a wrong scale and an error of the rate are the same thing";
  EXPECT_LT(sigma(0.6), 0.01);
  EXPECT_LT(sigma(0.6), sigma(0.2));
  const Drive both_sides = drive_noisily(1, 0.02, 3);
  EXPECT_FALSE(turn_scale_sigma(both_sides.trajectory, both_sides.covariance, both_sides.odometry));
}

TEST(TurnNoise, SaysNothingWhereTheHeadingsAreNotKnown) {
  Drive made = drive_noisily(1, 0.01, 7);
  for (Matrix6& P : made.covariance) P(5, 5) = 0.1;
  EXPECT_FALSE(turn_noise(made.trajectory, made.covariance, made.odometry, 1));
  EXPECT_FALSE(turn_noise({}, {}, {}, 1));
}

}  // namespace
}  // namespace waymark
