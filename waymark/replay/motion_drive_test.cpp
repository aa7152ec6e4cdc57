// MotionConsistency over whole drives.
#include <chrono>
#include <cmath>
#include <cstdint>
#include <optional>

#include <gtest/gtest.h>

#include "waymark/base/random.hpp"
#include "waymark/replay/motion_consistency.hpp"

namespace waymark {
namespace {

/// Five seconds of a bend, wheels that tell `told` of each true turn, and a picture every tenth of a second.
std::optional<Contradiction> bend_by_wheels(double told, const OdometryPrior& prior) {
  MotionConsistency consistency({}, {}, prior);
  SE2 odom;
  SE2 truth;
  std::optional<Contradiction> found;
  constexpr double kDt_s = 0.05;
  const Eigen::Matrix3d P = Eigen::Vector3d(4e-6, 4e-6, 4e-6).asDiagonal();
  for (int i = 0; i < 100; ++i) {
    const SensorTime stamp(std::chrono::milliseconds(50 * i));
    consistency.add(Odometry{.stamp = stamp, .odom_T_base = odom});
    consistency.command({0.3, 0.5 * told}, kDt_s);
    consistency.observe(truth, P, true);
    if (i % 2 == 0) consistency.observe_picture(stamp, truth, P, true);
    if (!found) found = consistency.contradiction();
    odom = odom * SE2::exp({0.3 * kDt_s, 0, 0.5 * told * kDt_s});
    truth = truth * SE2::exp({0.3 * kDt_s, 0, 0.5 * kDt_s});
  }
  return found;
}

TEST(MotionConsistency, BeginsWithTheCalibratedScaleOfTurns) {
  for (const double gain : {0.2, 0.6, 1.2}) {
    const OdometryPrior right{.distance_share = 0.02, .turn_scale = gain, .turn_share = 0.05};
    const OdometryPrior wrong{.distance_share = 0.02, .turn_scale = 4 * gain, .turn_share = 0.05};
    EXPECT_FALSE(bend_by_wheels(1 / gain, right)) << gain;
    EXPECT_TRUE(bend_by_wheels(1 / gain, wrong)) << gain;
  }
}

/// Whether a drive straight on at 0.3 m/s is a contradiction after `before_s` at another speed, in which
/// somebody turns the robot evenly by `turned_rad`. Tags see every turn, and the gyro with its bias.
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
    consistency.observe_picture(stamp, truth, P, true);
    if (auto found = consistency.contradiction()) return found;
    odom = odom * SE2::exp({speed * kDt_s, 0, 0});
    truth = truth * SE2::exp({speed * kDt_s, 0, 0});
  }
  return std::nullopt;
}

TEST(MotionConsistency, ABiasOfTheGyroIsNoContradictionWhereTheRobotIsSlow) {
  for (const double bias : {-0.008, 0.0, 0.004, 0.008}) {
    EXPECT_FALSE(drive_with_slow_part(60, 0, bias)) << bias;
    EXPECT_FALSE(drive_with_slow_part(120, 0.001, bias)) << bias;
    EXPECT_FALSE(drive_with_slow_part(60, 0.004, bias)) << bias;
  }
}

/// How long a straight drive takes to be a contradiction when somebody moves the robot aside
/// from the third second on; pictures 15 times a second with noise of 6 mm and 0.5 degrees.
std::optional<double> seconds_until_found(double aside_m_s, std::uint64_t seed) {
  constexpr double kDt_s = 0.05;
  constexpr double kFrom_s = 3;
  MotionConsistency consistency({}, {}, {.distance_share = 0.02});
  Random random(seed);
  SE2 odom;
  SE2 truth;
  const Eigen::Vector3d sigma(0.006, 0.006, 0.009);
  const Eigen::Matrix3d of_picture = sigma.cwiseAbs2().asDiagonal();
  const Eigen::Matrix3d of_estimate = Eigen::Vector3d(1e-5, 1e-5, 9e-6).asDiagonal();
  for (int i = 0; i < 160; ++i) {
    const SensorTime stamp(std::chrono::milliseconds(50 * i));
    consistency.add(Odometry{.stamp = stamp, .odom_T_base = odom});
    consistency.add(ImuSample{.stamp = stamp, .angular_velocity_rad_s = {0, 0, 1e-4 * random.normal()}});
    consistency.command({0.3, 0}, kDt_s);
    consistency.observe(truth, of_estimate, true);
    const Eigen::Vector3d noise(random.normal(), random.normal(), random.normal());
    consistency.observe_picture(stamp,
                                SE2(truth.x() + sigma.x() * noise.x(), truth.y() + sigma.y() * noise.y(),
                                    truth.yaw() + sigma.z() * noise.z()),
                                of_picture, true);
    if (consistency.contradiction()) return kDt_s * i - kFrom_s;
    odom = odom * SE2::exp({0.3 * kDt_s, 0, 0});
    truth = truth * SE2::exp({0.3 * kDt_s, 0, 0});
    if (kDt_s * i >= kFrom_s) truth = SE2(truth.x(), truth.y() + kDt_s * aside_m_s, truth.yaw());
  }
  return std::nullopt;
}

// A contradiction when it has come to 5 cm: 1.67 s after it begins, and 0.9 s later it has been found.
TEST(MotionConsistency, ARobotThatIsCarriedAt3CentimetresASecondIsFoundInTime) {
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

/// Two seconds of a bend that is driven as the command says; the gyro by `gyro_rad_s` of the step.
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

TEST(MotionConsistency, AGyroThatRepeatsItselfToTheLastBitIsNamed) {
  const auto stuck = [](int) { return 0.02; };
  const auto noisy = [](int i) { return 0.02 + 1e-4 * (i % 2); };
  const auto found = bend_by_gyro(0.005, stuck);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->culprit, MotionSource::Gyro);
  EXPECT_NEAR(found->repeats_s, 1, 0.1);
  EXPECT_NE(to_words(*found).find("the gyro has repeated the same value for 1.0 s"), std::string::npos);
  EXPECT_FALSE(bend_by_gyro(0.005, noisy));
  EXPECT_FALSE(bend_by_gyro(0, stuck)) << "nothing asked it to turn otherwise";
}

}  // namespace
}  // namespace waymark
