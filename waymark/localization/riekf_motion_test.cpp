// The laws of propagation: of time, of messages that are divided, of what is wrong and stays so.
#include <cmath>

#include <gtest/gtest.h>

#include "waymark/geometry/lie.hpp"
#include "waymark/localization/motion_input.hpp"
#include "waymark/localization/riekf.hpp"

namespace waymark {
namespace {

using Matrix6 = Eigen::Matrix<double, 6, 6>;

std::vector<Matrix6> zero(int count) {
  return std::vector<Matrix6>(static_cast<std::size_t>(count), Matrix6::Zero());
}

RiekfOptions exact_map() {
  RiekfOptions options;
  options.tag_sigma_m = options.tag_sigma_rad = options.mounting_sigma_m = options.mounting_sigma_rad = 0;
  return options;
}

MotionNoise noiseless() {
  return {.along_m_sqrt_m = 0,
          .across_m_sqrt_m = 0,
          .yaw_rad_sqrt_m = 0,
          .yaw_rad_sqrt_rad = 0,
          .yaw_rad_sqrt_s = 0,
          .drift_m_sqrt_s = 0,
          .slide_time_s = 0.05,
          .distance_scale_sigma = 0,
          .yaw_scale_sigma = 0,
          .yaw_bias_sigma_rad_s = 0,
          .slip_sigma_s = 0};
}

TEST(Riekf, GoesStraightThroughAYawRateOfExactlyZero) {
  Riekf straight(exact_map(), ErrorState::RightInvariant, zero(0));
  Riekf almost(exact_map(), ErrorState::RightInvariant, zero(0));
  straight.start({}, Eigen::Matrix3d::Identity() * 1e-4, false);
  almost.start({}, Eigen::Matrix3d::Identity() * 1e-4, false);
  for (int i = 0; i < 100; ++i) {
    straight.propagate({.twist = {0.01, 0, 0}, .dt_s = 0.02});
    almost.propagate({.twist = {0.01, 0, 1e-14}, .dt_s = 0.02});
  }
  EXPECT_NEAR(straight.state().map_T_base.x(), 1.0, 1e-12);
  EXPECT_NEAR(straight.state().map_T_base.y(), 0, 1e-15);
  EXPECT_LT(minus(straight.state().map_T_base, almost.state().map_T_base).norm(), 1e-11);
}

MotionStep part_of(const MotionStep& step, double begin, double end) {
  const MotionSegment whole{SensorTime(Duration(0)), SensorTime(Duration(1000)), step};
  return whole.part(SensorTime(Duration(std::llround(1000 * begin))),
                    SensorTime(Duration(std::llround(1000 * end))));
}

/// What is wrong with a message is one twist, into however many parts looks divide it.
TEST(Riekf, AMessageThatIsDividedIsWrongByTheSame) {
  RiekfOptions options = exact_map();
  options.motion.slide_m_s = 0.02;
  options.motion.crab_sigma_rad = 0.1;
  options.motion.crab_share = 1;
  options.motion.drift_m_sqrt_s = 0.01;
  const MotionStep step{.twist = {0.02, 0.001, 1e-4}, .dt_s = 0.05};
  Riekf whole(options, ErrorState::RightInvariant, zero(0));
  Riekf divided(options, ErrorState::RightInvariant, zero(0));
  for (Riekf* filter : {&whole, &divided})
    filter->start(SE2(0.3, -0.2, 0.4), Eigen::Matrix3d::Identity() * 1e-4, false);
  for (int i = 0; i < 20; ++i) {
    whole.propagate(step);
    divided.propagate(part_of(step, 0, 0.1));
    divided.propagate(part_of(step, 0.1, 0.7));
    divided.propagate(part_of(step, 0.7, 1));
  }
  EXPECT_LT(minus(whole.state().map_T_base, divided.state().map_T_base).norm(), 1e-6);
  EXPECT_LT((whole.state().P - divided.state().P).norm(), 1e-4 * whole.state().P.norm());
  // In the middle of a message the error is as large as the part, and not as its square root.
  Riekf middle(options, ErrorState::RightInvariant, zero(0));
  Riekf end(options, ErrorState::RightInvariant, zero(0));
  const MotionStep still{.twist = Eigen::Vector3d::Zero(), .dt_s = 0.05};
  middle.propagate(part_of(still, 0, 0.5));
  end.propagate(still);
  EXPECT_GT(end.state().P(2, 2), 10);
  EXPECT_NEAR(middle.state().P(2, 2) - 10, (end.state().P(2, 2) - 10) / 4, 1e-12);
}

/// Sliding is a Gauss-Markov speed: over long it scatters as 2 sigma^2 tau t, in steps of any length.
TEST(Riekf, SlidingScattersAsTheProcessThatItIs) {
  RiekfOptions options = exact_map();
  options.motion = noiseless();
  options.motion.slide_m_s = 0.1;
  const double tau = options.motion.slide_time_s;
  for (const int steps : {10, 100, 1000}) {
    Riekf filter(options, ErrorState::RightInvariant, zero(0));
    filter.start({}, Eigen::Matrix3d::Zero(), false);
    const double dt_s = 2.0 / steps;
    for (int i = 0; i < steps; ++i) filter.propagate({.twist = {0.1 * dt_s, 0, 0}, .dt_s = dt_s});
    const double expected = 2 * 0.01 * tau * (2 - tau * (1 - std::exp(-2 / tau)));
    EXPECT_NEAR(filter.state().P(1, 1), expected, 1e-9) << steps;
    EXPECT_LT(filter.state().P(0, 0), 1e-15);
  }
}

TEST(Riekf, WithoutNoiseTheErrorStaysWhatItIs) {
  RiekfOptions options = exact_map();
  options.motion = noiseless();
  Riekf filter(options, ErrorState::RightInvariant, zero(0));
  const Eigen::Matrix3d P = (Eigen::Matrix3d() << 4, 1, 0.3, 1, 5, -0.2, 0.3, -0.2, 0.5).finished();
  const SE2 start(1, 2, 0.5);
  const SE2 truth = SE2::exp({0.4, -0.3, 0.7}) * start;
  filter.start(start, P, false);
  SE2 true_now = truth;
  for (int i = 0; i < 500; ++i) {
    const Eigen::Vector3d u(0.05, 0.001, 0.02 * std::sin(0.1 * i));
    filter.propagate({.twist = u, .dt_s = 0.1});
    true_now = true_now * SE2::exp(u);
  }
  EXPECT_LT((filter.covariance() - P).norm(), 1e-12);
  const Eigen::Vector3d xi = minus(true_now, filter.state().map_T_base);
  EXPECT_LT((xi - Eigen::Vector3d(0.4, -0.3, 0.7)).norm(), 1e-10);
}

TEST(Riekf, NoiseIsPerTimeAndDistanceNotPerStep) {
  Riekf coarse(exact_map(), ErrorState::RightInvariant, zero(0));
  Riekf fine(exact_map(), ErrorState::RightInvariant, zero(0));
  coarse.start({}, Eigen::Matrix3d::Zero(), false);
  fine.start({}, Eigen::Matrix3d::Zero(), false);
  for (int i = 0; i < 100; ++i) coarse.propagate({.twist = {0.02, 0, 0.01}, .dt_s = 0.1});
  for (int i = 0; i < 1000; ++i) fine.propagate({.twist = {0.002, 0, 0.001}, .dt_s = 0.01});
  EXPECT_LT((coarse.covariance() - fine.covariance()).norm(), 0.01 * fine.covariance().norm());
}

/// Wheels that slip tell turns worse than ways; a gyro does not know of it.
TEST(MotionInput, TurnsByWheelsHaveNoiseOfTheirOwn) {
  RiekfOptions options;
  options.motion.wheel_yaw_rad_sqrt_m = 0.1;
  for (const bool gyro : {false, true}) {
    MotionInput input(options);
    std::optional<MotionSegment> segment;
    for (int i = 0; i < 3; ++i) {
      const SensorTime stamp(std::chrono::milliseconds(100 * i));
      if (gyro) input.add(ImuSample{.stamp = stamp});
      segment = input.add(Odometry{.stamp = stamp, .odom_T_base = SE2(0.04 * i, 0, 0)});
    }
    ASSERT_TRUE(segment);
    EXPECT_NEAR(segment->step.extra_rad2, gyro ? 0 : 0.01 * 0.04, 1e-12);
  }
}

}  // namespace
}  // namespace waymark
