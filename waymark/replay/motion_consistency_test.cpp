#include "waymark/replay/motion_consistency.hpp"

#include <cmath>
#include <optional>

#include <gtest/gtest.h>

namespace waymark {
namespace {

/// Speeds by each source, as the robot turns to the left.
struct Motion {
  double commanded_m_s = 0.3;
  double commanded_rad_s = 0.3;
  double wheels_m_s = 0.3;
  double wheels_rad_s = 0.3;
  double gyro_rad_s = 0.3;
  Eigen::Vector3d tags{0.3, 0, 0.3};  ///< x, y [m/s] and yaw [rad/s]
  bool sees_tags = true;
};

/// A second of motion, twenty samples.
std::vector<MotionSample> second_of(const Motion& m, double from_s = 0, double until_s = 2) {
  std::vector<MotionSample> window;
  MotionSample now;
  for (int i = 0; i <= 20; ++i) {
    now.tags = m.sees_tags;
    now.covariance = Eigen::Vector3d(0.005 * 0.005, 0.005 * 0.005, 0.003 * 0.003).asDiagonal();
    window.push_back(now);
    const bool differs = now.moving_s >= from_s && now.moving_s < until_s;
    const Motion at = differs ? m : Motion{};
    constexpr double kDt = 0.05;
    now.moving_s += kDt;
    now.commanded_m += kDt * at.commanded_m_s;
    now.commanded_rad += kDt * at.commanded_rad_s;
    now.wheels_m += kDt * at.wheels_m_s;
    now.wheels_rad += kDt * at.wheels_rad_s;
    now.gyro_rad += kDt * at.gyro_rad_s;
    now.path_m += kDt * std::abs(at.wheels_m_s);
    now.turned_rad += kDt * std::abs(at.wheels_rad_s);
    now.odom_T_base =
        now.odom_T_base * SE2::exp(Eigen::Vector3d(kDt * at.wheels_m_s, 0, kDt * at.gyro_rad_s));
    now.map_T_base = now.map_T_base * SE2::exp(kDt * at.tags);
  }
  return window;
}

constexpr MotionScales kLearnt{.gyro = true};
constexpr ConsistencyOptions kLimits;

std::optional<Contradiction> found_in(const Motion& m) {
  return find_contradiction(second_of(m), kLearnt, kLimits);
}

TEST(MotionConsistency, SourcesThatAgreeAreNoContradiction) { EXPECT_FALSE(found_in({})); }

TEST(MotionConsistency, NamesThePairAndTheCulpritOnlyWhereAThirdSourceDecides) {
  const auto blocked = found_in({.wheels_m_s = 0});
  ASSERT_TRUE(blocked);
  EXPECT_EQ(blocked->one, MotionSource::Commands);
  EXPECT_EQ(blocked->other, MotionSource::Wheels);
  EXPECT_FALSE(blocked->culprit);

  const auto stuck = found_in({.tags = {0, 0, 0}});
  ASSERT_TRUE(stuck);
  EXPECT_EQ(stuck->other, MotionSource::Tags);
  EXPECT_FALSE(stuck->culprit) << "odometry may be made of the gyro: it is no third source";

  const auto straight =
      found_in({.commanded_rad_s = 0, .wheels_rad_s = 0, .gyro_rad_s = 0, .tags = {0, 0, 0}});
  ASSERT_TRUE(straight);
  EXPECT_EQ(straight->one, MotionSource::Wheels);
  EXPECT_EQ(straight->other, MotionSource::Tags);
  EXPECT_FALSE(straight->culprit) << "nothing else tells the way";

  const auto spinning = found_in({.tags = {0.05, 0, 0.3}});
  ASSERT_TRUE(spinning);
  EXPECT_EQ(spinning->culprit, MotionSource::Wheels) << "tags that see the turn of the gyro are alive";

  const auto gyro = found_in({.gyro_rad_s = -0.2});
  ASSERT_TRUE(gyro);
  EXPECT_EQ(gyro->other, MotionSource::Gyro);
  EXPECT_EQ(gyro->culprit, MotionSource::Gyro);
}

TEST(MotionConsistency, WhatDoesNotLastDoesNotCount) {
  const Motion slips{.tags = {0.05, 0, 0.3}};
  EXPECT_TRUE(find_contradiction(second_of(slips), kLearnt, kLimits));
  EXPECT_FALSE(find_contradiction(second_of(slips, 0.25, 0.75), kLearnt, kLimits)) << "half a second of slip";
  EXPECT_FALSE(find_contradiction(second_of(slips, 0.7), kLearnt, kLimits)) << "it has only begun";
}

// Held while it slows down: wheels and tags differ by a share of the way, not of the time.
TEST(MotionConsistency, ADifferenceThatLastsOverTheWayCounts) {
  std::vector<MotionSample> window;
  MotionSample now;
  for (int i = 0; i <= 20; ++i) {
    now.tags = true;
    now.covariance = Eigen::Vector3d(1e-5, 1e-5, 1e-5).asDiagonal();
    window.push_back(now);
    constexpr double kDt = 0.05;
    const double speed_m_s = i < 5 ? 0.3 : 0.06;
    now.moving_s += kDt;
    now.commanded_m += kDt * speed_m_s;
    now.wheels_m += kDt * speed_m_s;
    now.path_m += kDt * speed_m_s;
    now.odom_T_base = now.odom_T_base * SE2(kDt * speed_m_s, 0, 0);
  }
  const auto held = find_contradiction(window, kLearnt, kLimits);
  ASSERT_TRUE(held);
  EXPECT_EQ(held->other, MotionSource::Tags);
}

TEST(MotionConsistency, WhatIsUncertainIsAllowedFor) {
  EXPECT_FALSE(found_in({.commanded_m_s = 0.36})) << "a battery that sags by 15 %";
  EXPECT_FALSE(found_in({.wheels_rad_s = 0.43})) << "a floor that turns the robot by 30 % less";
  Motion blind{.tags = {0, 0, 0}, .sees_tags = false};
  EXPECT_FALSE(found_in(blind)) << "without tags nothing is said about them";
  std::vector<MotionSample> doubtful = second_of({.tags = {0.2, 0, 0.3}});
  EXPECT_TRUE(find_contradiction(doubtful, kLearnt, kLimits));
  for (MotionSample& sample : doubtful) sample.covariance.diagonal().head<2>().setConstant(0.05 * 0.05);
  EXPECT_FALSE(find_contradiction(doubtful, kLearnt, kLimits));
}

// Without a gyro turns are those of wheels that slip, and what a calibration says of them counts.
TEST(MotionConsistency, TurnsByWheelsAreAllowedTheNoiseOfTheirCalibration) {
  const std::vector<MotionSample> window =
      second_of({.commanded_rad_s = 0.05, .wheels_rad_s = 0.05, .gyro_rad_s = 0.05, .tags = {0.3, 0, 0.25}});
  const MotionScales exact{.turn_share = 0.35};
  MotionScales noisy = exact;
  noisy.turn_noise_sqrt_m = 0.13;
  ASSERT_TRUE(find_contradiction(window, exact, kLimits));
  EXPECT_FALSE(find_contradiction(window, noisy, kLimits));
  const std::vector<MotionSample> stuck = second_of({.wheels_rad_s = 0.3, .tags = {0, 0, 0}});
  EXPECT_TRUE(find_contradiction(stuck, noisy, kLimits)) << "a way that is not driven shows all the same";
}

TEST(MotionConsistency, TheCalibrationOfAMapBecomesItsPrior) {
  Calibration found;
  found.values["odometry_scale"] = {.value = 0.97, .sigma = 0.001};
  found.values["yaw_gain"] = {.value = 0.3, .sigma = 0.006};
  found.values["yaw_noise_rad_sqrt_m"] = {.value = 0.03, .sigma = 0.002};
  const OdometryPrior prior = odometry_prior(found);
  EXPECT_DOUBLE_EQ(prior.distance_scale, 0.97);
  EXPECT_DOUBLE_EQ(prior.turn_scale, 0.3);
  EXPECT_NEAR(prior.turn_share, 0.06, 1e-12);
  EXPECT_DOUBLE_EQ(prior.turn_noise_sqrt_m, 0.03);
  found.values["yaw_gain"].verdict = CalibrationVerdict::Unobservable;
  EXPECT_DOUBLE_EQ(odometry_prior(found).turn_scale, 1);
}

TEST(MotionConsistency, APushIsWhatSlippingWheelsCannotExplain) {
  const auto push = [](const Motion& m) {
    const std::vector<MotionSample> window = second_of(m);
    return find_push(window.front(), window.back(), kLearnt, kLimits);
  };
  const Motion straight{.commanded_rad_s = 0, .wheels_rad_s = 0, .gyro_rad_s = 0, .tags = {0.3, 0, 0}};
  const auto with = [&](const Eigen::Vector3d& tags) {
    Motion m = straight;
    m.tags = tags;
    m.gyro_rad_s = tags.z();
    return m;
  };
  EXPECT_FALSE(push(straight));
  const auto held = push(with({0, 0, 0}));
  EXPECT_TRUE(held && !held->carried) << "held, or slipping farther than wheels do for a moment";
  EXPECT_FALSE(push(with({0.15, 0, 0}))) << "slipping";
  for (const Eigen::Vector3d& tags :
       {Eigen::Vector3d(0.3, 0.16, 0), Eigen::Vector3d(-0.16, 0, 0), Eigen::Vector3d(0.46, 0, 0)}) {
    const auto found = push(with(tags));
    ASSERT_TRUE(found) << tags.transpose();
    EXPECT_TRUE(found->carried);
    EXPECT_NE(to_words(*found).find("was the robot carried"), std::string::npos);
  }
  const auto turned = push(with({0.3, 0, 0.35}));
  ASSERT_TRUE(turned) << "nobody asked it to turn";
  EXPECT_TRUE(turned->carried && turned->turning);
  EXPECT_FALSE(push({.commanded_rad_s = 0.5, .tags = {0.3, 0, 0.3}})) << "it skids";
}

// Half a second in which a robot of 0.5 m/s is carried back by as much as it drives: its wheels seem to slip.
TEST(MotionConsistency, ACarryBackIsFoundWhereItIsFartherThanAShortSlip) {
  const auto push = [](double back_m) {
    Motion m{.commanded_m_s = 0.5, .wheels_m_s = 0.5, .tags = {0.5 - back_m, 0, 0.3}};
    std::vector<MotionSample> window = second_of(m);
    return find_push(window.front(), window.back(), kLearnt, kLimits);
  };
  EXPECT_FALSE(push(0.12)) << "a slip";
  const auto found = push(0.25);
  ASSERT_TRUE(found);
  EXPECT_FALSE(found->carried) << "nobody can tell it from wheels that spin";
  EXPECT_NE(to_words(*found).find("is the robot held or was it carried"), std::string::npos);
}

TEST(MotionConsistency, ARobotThatDoesNotTurnAsItIsAskedContradicts) {
  const auto found =
      found_in({.commanded_rad_s = 0.6, .wheels_rad_s = 0, .gyro_rad_s = 0, .tags = {0.3, 0, 0}});
  ASSERT_TRUE(found);
  EXPECT_EQ(found->one, MotionSource::Commands);
  EXPECT_TRUE(found->turning && !found->carried);
  EXPECT_FALSE(found_in({.commanded_rad_s = 0.45})) << "a floor that turns it by a third less";
}

TEST(MotionConsistency, LatePicturesAreNamed) {
  const auto words = to_words({.one = MotionSource::Gyro, .turning = true, .late_s = 0.3});
  EXPECT_NE(words.find("turns seen by tags follow those of the gyro by 0.30 s"), std::string::npos) << words;
}

TEST(MotionConsistency, TheWordsNameThePair) {
  EXPECT_EQ(
      to_words({.one_moved = 0.3, .other_moved = 0.02, .apart = 0.28, .over_s = 1}),
      "wheels and tags disagree: 0.30 m against 0.02 m in 1.0 s, 0.28 m apart. Do the wheels spin, is the "
      "robot "
      "held or was it carried, or does the camera repeat an old picture? Look at the robot, then resume");
}

}  // namespace
}  // namespace waymark
