#include "waymark/replay/motion_consistency.hpp"

#include <chrono>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"
#include "waymark/base/random.hpp"

namespace waymark {
namespace {

/// Heading [rad] over time for a robot that drives bends in both directions.
double heading(double time_s) { return 0.6 * std::sin(0.9 * time_s) + 0.2 * time_s; }

struct Drive {
  std::vector<HeadingAt> images;
  std::vector<HeadingAt> odometry;
};

Drive drive(double camera_latency_s, double gain, std::uint64_t seed) {
  Drive made;
  Random random(seed);
  for (int i = 0; i < 450; ++i) made.odometry.push_back({0.02 * i, heading(0.02 * i) / gain});
  for (int i = 10; i < 130; ++i) {
    const double t = i / 15.0;
    made.images.push_back({t, heading(t - camera_latency_s) + random.normal(0, 0.006)});
  }
  return made;
}

TEST(FindCameraLatency, DoesNotDependOnTheScaleOfTheTurns) {
  for (const double gain : {0.3, 1.0}) {
    for (const double camera_latency_s : {0.2, 0.3, 0.45}) {
      const Drive d = drive(camera_latency_s, gain, 7);
      const auto found = find_camera_latency(d.images, d.odometry, 0.8);
      ASSERT_TRUE(found) << camera_latency_s;
      EXPECT_NEAR(found->camera_latency_s, camera_latency_s, 0.04);
      EXPECT_LT(found->rms_rad, 0.015);
    }
  }
}

TEST(FindCameraLatency, NoneForImagesInTimeOrWithoutTurns) {
  const Drive in_time = drive(0, 0.6, 8);
  EXPECT_FALSE(find_camera_latency(in_time.images, in_time.odometry, 0.8));
  Drive even = drive(0.3, 1, 9);
  for (auto* headings : {&even.images, &even.odometry})
    for (HeadingAt& at : *headings) at.yaw_rad = 0.4 * at.time_s;  // the latency is unobservable on a circle
  EXPECT_FALSE(find_camera_latency(even.images, even.odometry, 0.8));
  Drive stuck = drive(0.3, 1, 10);
  for (HeadingAt& at : stuck.images) at.yaw_rad = 0.3;
  EXPECT_FALSE(find_camera_latency(stuck.images, stuck.odometry, 0.8)) << "a frozen camera is not a latency";
}

/// Velocities reported by each source for a robot turning left.
struct Motion {
  double commanded_m_s = 0.3;
  double commanded_rad_s = 0.3;
  double wheels_m_s = 0.3;
  double wheels_rad_s = 0.3;
  double gyro_rad_s = 0.3;
  Eigen::Vector3d tags{0.3, 0, 0.3};  ///< velocities in x, y [m/s] and yaw [rad/s]
  bool sees_tags = true;
};

/// One second of motion, as twenty samples.
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

TEST(MotionConsistency, ConsistentSourcesAreNoContradiction) { EXPECT_FALSE(found_in({})); }

TEST(MotionConsistency, ReportsThePairAndACulpritOnlyWithAThirdSource) {
  const auto blocked = found_in({.wheels_m_s = 0});
  ASSERT_TRUE(blocked);
  EXPECT_EQ(blocked->one, MotionSource::Commands);
  EXPECT_EQ(blocked->other, MotionSource::Wheels);
  EXPECT_FALSE(blocked->culprit);

  const auto stuck = found_in({.tags = {0, 0, 0}});
  ASSERT_TRUE(stuck);
  EXPECT_EQ(stuck->other, MotionSource::Tags);
  EXPECT_FALSE(stuck->culprit) << "odometry may use the gyro, so it is not a third source";

  const auto straight =
      found_in({.commanded_rad_s = 0, .wheels_rad_s = 0, .gyro_rad_s = 0, .tags = {0, 0, 0}});
  ASSERT_TRUE(straight);
  EXPECT_EQ(straight->one, MotionSource::Wheels);
  EXPECT_EQ(straight->other, MotionSource::Tags);
  EXPECT_FALSE(straight->culprit) << "no third source measures the distance";

  const auto spinning = found_in({.tags = {0.05, 0, 0.3}});
  ASSERT_TRUE(spinning);
  EXPECT_EQ(spinning->culprit, MotionSource::Wheels) << "the tags confirm the turn measured by the gyro";

  const auto gyro = found_in({.gyro_rad_s = -0.2});
  ASSERT_TRUE(gyro);
  EXPECT_EQ(gyro->other, MotionSource::Gyro);
  EXPECT_EQ(gyro->culprit, MotionSource::Gyro);
}

TEST(MotionConsistency, ShortDifferencesDoNotCount) {
  const Motion slips{.tags = {0.05, 0, 0.3}};
  EXPECT_TRUE(find_contradiction(second_of(slips), kLearnt, kLimits));
  EXPECT_FALSE(find_contradiction(second_of(slips, 0.25, 0.75), kLearnt, kLimits))
      << "slip for half a second";
  EXPECT_FALSE(find_contradiction(second_of(slips, 0.7), kLearnt, kLimits)) << "it has only just begun";
}

// The robot is held while slowing down, so the difference between wheels and tags is proportional to
// distance, not to time.
TEST(MotionConsistency, DifferencesThatPersistOverTheDistanceCount) {
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

TEST(MotionConsistency, DifferencesWithinTheUncertaintyDoNotCount) {
  EXPECT_FALSE(found_in({.commanded_m_s = 0.36})) << "the battery voltage is 15 % low";
  EXPECT_FALSE(found_in({.wheels_rad_s = 0.43})) << "a floor on which the robot turns 30 % less";
  Motion blind{.tags = {0, 0, 0}, .sees_tags = false};
  EXPECT_FALSE(found_in(blind)) << "poses without tags are not compared";
  std::vector<MotionSample> uncertain = second_of({.tags = {0.2, 0, 0.3}});
  EXPECT_TRUE(find_contradiction(uncertain, kLearnt, kLimits));
  for (MotionSample& sample : uncertain) sample.covariance.diagonal().head<2>().setConstant(0.05 * 0.05);
  EXPECT_FALSE(find_contradiction(uncertain, kLearnt, kLimits));
}

// Without a gyro, turns are measured by slipping wheels; their noise is taken from the calibration.
TEST(MotionConsistency, TurnsByWheelsHaveTheNoiseOfTheCalibration) {
  const std::vector<MotionSample> window =
      second_of({.commanded_rad_s = 0.05, .wheels_rad_s = 0.05, .gyro_rad_s = 0.05, .tags = {0.3, 0, 0.25}});
  const MotionScales exact{.turn_share = 0.35};
  MotionScales noisy = exact;
  noisy.turn_noise_sqrt_m = 0.13;
  ASSERT_TRUE(find_contradiction(window, exact, kLimits));
  EXPECT_FALSE(find_contradiction(window, noisy, kLimits));
  const std::vector<MotionSample> stuck = second_of({.wheels_rad_s = 0.3, .tags = {0, 0, 0}});
  EXPECT_TRUE(find_contradiction(stuck, noisy, kLimits)) << "a missing translation is still found";
}

TEST(MotionConsistency, TheCalibrationOfTheMapIsThePrior) {
  Calibration found;
  found.values["odometry_scale"] = {.value = 0.97, .sigma = 0.001};
  found.values["yaw_scale"] = {.value = 0.3, .sigma = 0.006};
  found.values["yaw_noise_rad_sqrt_m"] = {.value = 0.03, .sigma = 0.002};
  const OdometryPrior prior = odometry_prior(found);
  EXPECT_DOUBLE_EQ(prior.distance_scale, 0.97);
  EXPECT_DOUBLE_EQ(prior.turn_scale, 0.3);
  EXPECT_NEAR(prior.turn_share, 0.06, 1e-12);
  EXPECT_DOUBLE_EQ(prior.turn_noise_sqrt_m, 0.03);
  found.values["yaw_scale"].verdict = CalibrationVerdict::Unobservable;
  EXPECT_DOUBLE_EQ(odometry_prior(found).turn_scale, 1);
}

TEST(MotionConsistency, APushIsAMotionThatWheelSlipCannotExplain) {
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
  EXPECT_TRUE(held && !held->carried) << "held in place, or slipping for too long";
  EXPECT_FALSE(push(with({0.15, 0, 0}))) << "slipping";
  for (const Eigen::Vector3d& tags :
       {Eigen::Vector3d(0.3, 0.16, 0), Eigen::Vector3d(-0.16, 0, 0), Eigen::Vector3d(0.46, 0, 0)}) {
    const auto found = push(with(tags));
    ASSERT_TRUE(found) << tags.transpose();
    EXPECT_TRUE(found->carried);
    testing::expect_on_page("replay", describe(*found));
  }
  const auto turned = push(with({0.3, 0, 0.35}));
  ASSERT_TRUE(turned) << "the turn was not commanded";
  EXPECT_TRUE(turned->carried && turned->turning);
  EXPECT_FALSE(push({.commanded_rad_s = 0.5, .tags = {0.3, 0, 0.3}})) << "the robot is skidding";
}

// A robot driving at 0.5 m/s is carried back for half a second by as much as it drives, which looks like
// wheel slip.
TEST(MotionConsistency, BeingCarriedBackIsFoundIfLongerThanAShortSlip) {
  const auto push = [](double back_m) {
    Motion m{.commanded_m_s = 0.5, .wheels_m_s = 0.5, .tags = {0.5 - back_m, 0, 0.3}};
    std::vector<MotionSample> window = second_of(m);
    return find_push(window.front(), window.back(), kLearnt, kLimits);
  };
  EXPECT_FALSE(push(0.12)) << "a slip";
  const auto found = push(0.25);
  ASSERT_TRUE(found);
  EXPECT_FALSE(found->carried) << "indistinguishable from spinning wheels";
  testing::expect_on_page("replay", describe(*found));
}

TEST(MotionConsistency, ARobotThatDoesNotTurnAsCommandedIsAContradiction) {
  const auto found =
      found_in({.commanded_rad_s = 0.6, .wheels_rad_s = 0, .gyro_rad_s = 0, .tags = {0.3, 0, 0}});
  ASSERT_TRUE(found);
  EXPECT_EQ(found->one, MotionSource::Commands);
  EXPECT_TRUE(found->turning && !found->carried);
  EXPECT_FALSE(found_in({.commanded_rad_s = 0.45})) << "a floor that reduces turns by a third";
}

TEST(MotionConsistency, ReportsLateImages) {
  const auto text = describe({.one = MotionSource::Gyro, .turning = true, .camera_latency_s = 0.3});
  EXPECT_THAT(text, ::testing::HasSubstr("0.30 s"));
  testing::expect_on_page("replay", text);
}

TEST(MotionConsistency, ReportsThePairWithTheirMotions) {
  const std::string text = describe({.one_moved = 0.3, .other_moved = 0.02, .apart = 0.28, .over_s = 1});
  for (const char* part : {"wheels", "tags", "0.30 m", "0.02 m", "1.0 s", "0.28 m"})
    EXPECT_THAT(text, ::testing::HasSubstr(part));
  testing::expect_on_page("replay", text);
}

// Tests MotionConsistency over whole drives.

/// Five seconds of driving a bend with wheels that measure `measured_share` of each true turn, and one image
/// every 0.1 s.
std::optional<Contradiction> bend_by_wheels(double measured_share, const OdometryPrior& prior) {
  MotionConsistency consistency({}, {}, prior);
  SE2 odom;
  SE2 truth;
  std::optional<Contradiction> found;
  constexpr double kDt_s = 0.05;
  const Eigen::Matrix3d P = Eigen::Vector3d(4e-6, 4e-6, 4e-6).asDiagonal();
  for (int i = 0; i < 100; ++i) {
    const SensorTime stamp(std::chrono::milliseconds(50 * i));
    consistency.add(Odometry{.stamp = stamp, .odom_T_base = odom});
    consistency.command({0.3, 0.5 * measured_share}, kDt_s);
    consistency.observe(truth, P, true);
    if (i % 2 == 0) consistency.observe_image(stamp, truth, P, true);
    if (!found) found = consistency.contradiction();
    odom = odom * SE2::exp({0.3 * kDt_s, 0, 0.5 * measured_share * kDt_s});
    truth = truth * SE2::exp({0.3 * kDt_s, 0, 0.5 * kDt_s});
  }
  return found;
}

TEST(MotionConsistency, StartsWithTheCalibratedTurnScale) {
  for (const double gain : {0.2, 0.6, 1.2}) {
    const OdometryPrior right{.distance_share = 0.02, .turn_scale = gain, .turn_share = 0.05};
    const OdometryPrior wrong{.distance_share = 0.02, .turn_scale = 4 * gain, .turn_share = 0.05};
    EXPECT_FALSE(bend_by_wheels(1 / gain, right)) << gain;
    EXPECT_TRUE(bend_by_wheels(1 / gain, wrong)) << gain;
  }
}

/// Whether driving straight ahead at 0.3 m/s is reported as a contradiction after `before_s` at another
/// speed, during which the robot is steadily turned by hand by `turned_rad`. The tags observe every turn, and
/// the gyro has a bias.
std::optional<Contradiction> drive_with_slow_part(double slow_s, double speed_m_s, double bias_rad_s) {
  constexpr double kDt_s = 0.05;
  MotionConsistency consistency({}, {}, {.distance_share = 0.02});
  SE2 odom;
  SE2 truth;
  const Eigen::Matrix3d P = Eigen::Vector3d(1e-5, 1e-5, 9e-6).asDiagonal();
  for (int i = 0; kDt_s * i < slow_s + 6; ++i) {
    const double time_s = kDt_s * i;
    const bool slow = time_s >= 3 && time_s < 3 + slow_s;
    const double speed = slow ? speed_m_s : 0.3;
    const SensorTime stamp(std::chrono::milliseconds(50 * i));
    consistency.add(Odometry{.stamp = stamp, .odom_T_base = odom});
    consistency.add(ImuSample{.stamp = stamp, .angular_velocity_rad_s = {0, 0, bias_rad_s + 1e-6 * (i % 7)}});
    consistency.command({speed, 0}, kDt_s);
    consistency.observe(truth, P, true);
    consistency.observe_image(stamp, truth, P, true);
    if (auto found = consistency.contradiction()) return found;
    odom = odom * SE2::exp({speed * kDt_s, 0, 0});
    truth = truth * SE2::exp({speed * kDt_s, 0, 0});
  }
  return std::nullopt;
}

TEST(MotionConsistency, AGyroBiasIsNoContradictionForASlowRobot) {
  for (const double bias : {-0.008, 0.0, 0.004, 0.008}) {
    EXPECT_FALSE(drive_with_slow_part(60, 0, bias)) << bias;
    EXPECT_FALSE(drive_with_slow_part(120, 0.001, bias)) << bias;
    EXPECT_FALSE(drive_with_slow_part(60, 0.004, bias)) << bias;
  }
}

/// Time until a contradiction is found if the robot drives straight ahead and is pushed sideways by hand from
/// the third second on. There are 15 images per second with noise of 6 mm and 0.5 degrees.
std::optional<double> seconds_until_found(double aside_m_s, std::uint64_t seed) {
  constexpr double kDt_s = 0.05;
  constexpr double kFrom_s = 3;
  MotionConsistency consistency({}, {}, {.distance_share = 0.02});
  Random random(seed);
  SE2 odom;
  SE2 truth;
  const Eigen::Vector3d sigma(0.006, 0.006, 0.009);
  const Eigen::Matrix3d of_image = sigma.cwiseAbs2().asDiagonal();
  const Eigen::Matrix3d of_estimate = Eigen::Vector3d(1e-5, 1e-5, 9e-6).asDiagonal();
  for (int i = 0; i < 160; ++i) {
    const SensorTime stamp(std::chrono::milliseconds(50 * i));
    consistency.add(Odometry{.stamp = stamp, .odom_T_base = odom});
    consistency.add(ImuSample{.stamp = stamp, .angular_velocity_rad_s = {0, 0, 1e-4 * random.normal()}});
    consistency.command({0.3, 0}, kDt_s);
    consistency.observe(truth, of_estimate, true);
    const Eigen::Vector3d noise(random.normal(), random.normal(), random.normal());
    consistency.observe_image(stamp,
                              SE2(truth.x() + sigma.x() * noise.x(), truth.y() + sigma.y() * noise.y(),
                                  truth.yaw() + sigma.z() * noise.z()),
                              of_image, true);
    if (consistency.contradiction()) return kDt_s * i - kFrom_s;
    odom = odom * SE2::exp({0.3 * kDt_s, 0, 0});
    truth = truth * SE2::exp({0.3 * kDt_s, 0, 0});
    if (kDt_s * i >= kFrom_s) truth = SE2(truth.x(), truth.y() + kDt_s * aside_m_s, truth.yaw());
  }
  return std::nullopt;
}

// The sideways motion reaches its limit of 5 cm after 1.67 s and is found within another 0.9 s.
TEST(MotionConsistency, AMotionByHandOf3CentimetresPerSecondIsFoundInTime) {
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    for (const double aside : {0.03, -0.03}) {
      const auto found = seconds_until_found(aside, seed);
      ASSERT_TRUE(found);
      EXPECT_GT(*found, 1) << seed;
      EXPECT_LT(*found, 0.05 / 0.03 + 0.9) << seed;
    }
    EXPECT_FALSE(seconds_until_found(0, seed)) << seed;
  }
}

/// Two seconds of driving a bend as commanded; `gyro_rad_s` returns the gyro reading for each step.
template <class Gyro>
std::optional<Contradiction> bend_by_gyro(double commanded_change_rad_s, const Gyro& gyro_rad_s) {
  MotionConsistency consistency({}, {});
  std::optional<Contradiction> found;
  for (int i = 0; i < 40; ++i) {
    const SensorTime stamp(std::chrono::milliseconds(50 * i));
    consistency.add(Odometry{.stamp = stamp, .odom_T_base = SE2(0.015 * i, 0, 0)});
    consistency.add(ImuSample{.stamp = stamp, .angular_velocity_rad_s = {0, 0, gyro_rad_s(i)}});
    consistency.command({0.3, 0.01 + commanded_change_rad_s * i}, 0.05);
    consistency.observe(SE2(0.015 * i, 0, 0), 1e-4 * Eigen::Matrix3d::Identity(), false);
    if (!found) found = consistency.contradiction();
  }
  return found;
}

TEST(MotionConsistency, ReportsAGyroThatRepeatsItsValue) {
  const auto stuck = [](int) { return 0.02; };
  const auto noisy = [](int i) { return 0.02 + 1e-4 * (i % 2); };
  const auto found = bend_by_gyro(0.005, stuck);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->culprit, MotionSource::Gyro);
  EXPECT_NEAR(found->repeats_s, 1, 0.1);
  EXPECT_THAT(describe(*found), ::testing::HasSubstr("1.0 s"));
  testing::expect_on_page("replay", describe(*found));
  EXPECT_FALSE(bend_by_gyro(0.005, noisy));
  EXPECT_FALSE(bend_by_gyro(0, stuck)) << "no other yaw rate was commanded";
}

}  // namespace
}  // namespace waymark
