#include "waymark/localization/sensor_explanation.hpp"

#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>

#include <gtest/gtest.h>

#include "tests/support/synthetic_motion.hpp"

namespace waymark {
namespace {

using test::motion_sources;
using test::SyntheticMotion;

constexpr int kSeeds = 3;

SyntheticMotion healthy(int seed) { return {.seed = static_cast<std::uint64_t>(seed)}; }

/// The most likely explanation, which must exist.
SensorExplanation best_of(const SensorExplanations& found) {
  return found.likely.empty() ? SensorExplanation{.value = std::nan("")} : found.likely.front();
}

TEST(SensorExplanation, NamesNothingIfTheSensorsAreHealthy) {
  for (int seed = 0; seed < 60; ++seed) {
    const auto found = explain_sensors(motion_sources(healthy(seed)));
    EXPECT_GT(found.intervals, 20U);
    EXPECT_TRUE(found.likely.empty())
        << "seed " << seed << " " << to_string(best_of(found).fault) << " " << best_of(found).value;
  }
}

/// Neither loose wheels, coarse tags nor a noisy gyro is a fault of another kind.
TEST(SensorExplanation, NamesNothingIfASourceIsOnlyNoisy) {
  for (int seed = 0; seed < 20; ++seed) {
    for (int which = 0; which < 3; ++which) {
      SyntheticMotion motion = healthy(seed);
      if (which == 0) motion.wheel_noise = 6;
      if (which == 1) motion.gyro_noise_rad_s *= 6;
      if (which == 2) motion.observed_noise = 6;
      const auto found = explain_sensors(motion_sources(motion));
      EXPECT_TRUE(found.likely.empty()) << "seed " << seed << " source " << which << " "
                                        << to_string(best_of(found).fault) << " " << best_of(found).value;
    }
  }
}

TEST(SensorExplanation, RecognisesTheUnitOfTheGyro) {
  for (int seed = 0; seed < kSeeds; ++seed) {
    for (const bool tags : {true, false}) {
      SyntheticMotion motion = healthy(seed);
      motion.gyro_from_base *= 180 / std::numbers::pi;
      motion.tags = tags;
      const auto found = explain_sensors(motion_sources(motion));
      ASSERT_FALSE(found.likely.empty()) << seed;
      EXPECT_EQ(best_of(found).fault, SensorFault::GyroUnit) << to_string(best_of(found).fault);
      EXPECT_NEAR(best_of(found).value, 57.3, 2);
      EXPECT_LT(std::abs(best_of(found).value - 57.3), 4 * best_of(found).sigma);
      EXPECT_TRUE(found.decided) << "tags " << tags << " rival " << to_string(found.rival->fault);
    }
  }
}

TEST(SensorExplanation, RecognisesTheAxisOfTheGyro) {
  for (int seed = 0; seed < kSeeds; ++seed) {
    for (const Eigen::Vector3d& up :
         {Eigen::Vector3d(0, 0, -1), Eigen::Vector3d(0, -1, 0), Eigen::Vector3d(0, 1, 0),
          Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(-1, 0, 0)}) {
      for (const double factor : {1.0, 180 / std::numbers::pi}) {
        SyntheticMotion motion = healthy(seed);
        motion.gyro_from_base =
            factor * Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), up).toRotationMatrix();
        const auto found = explain_sensors(motion_sources(motion));
        ASSERT_FALSE(found.likely.empty());
        EXPECT_EQ(best_of(found).fault, SensorFault::GyroAxis) << to_string(best_of(found).fault);
        EXPECT_EQ(best_of(found).gyro_up, up);
        EXPECT_NEAR(best_of(found).value, factor, 0.04 * factor);
        EXPECT_TRUE(found.decided);
      }
    }
  }
}

/// Wheels and gyro alone do not determine which of the two has the wrong sign.
TEST(SensorExplanation, LeavesTheSignOpenBetweenTwoSources) {
  for (int seed = 0; seed < kSeeds; ++seed) {
    SyntheticMotion motion = healthy(seed);
    motion.gyro_from_base.row(2) *= -1;
    motion.tags = false;
    const auto found = explain_sensors(motion_sources(motion));
    ASSERT_FALSE(found.likely.empty());
    EXPECT_EQ(best_of(found).fault, SensorFault::GyroAxis);
    ASSERT_TRUE(found.rival);
    EXPECT_EQ(found.rival->fault, SensorFault::OdometryYawSign);
  }
}

TEST(SensorExplanation, RecognisesADeadGyro) {
  for (int seed = 0; seed < kSeeds; ++seed) {
    SyntheticMotion motion = healthy(seed);
    motion.gyro_from_base.setZero();
    motion.gyro_noise_rad_s = 0;
    const auto found = explain_sensors(motion_sources(motion));
    ASSERT_FALSE(found.likely.empty());
    EXPECT_EQ(best_of(found).fault, SensorFault::GyroUnrelated) << to_string(best_of(found).fault);
    EXPECT_TRUE(found.decided);
  }
}

TEST(SensorExplanation, NamesTheSourceWithAnotherClock) {
  for (int seed = 0; seed < kSeeds; ++seed) {
    for (const double late_s : {0.12, -0.3, 0.5}) {
      for (const SensorFault fault :
           {SensorFault::GyroTime, SensorFault::OdometryTime, SensorFault::ObservationTime}) {
        SyntheticMotion motion = healthy(seed);
        if (fault == SensorFault::GyroTime) motion.gyro_late_s = late_s;
        if (fault == SensorFault::OdometryTime) motion.odometry_late_s = late_s;
        if (fault == SensorFault::ObservationTime) motion.observed_late_s = late_s;
        const auto found = explain_sensors(motion_sources(motion));
        ASSERT_FALSE(found.likely.empty()) << to_string(fault) << " " << late_s;
        EXPECT_EQ(best_of(found).fault, fault) << to_string(best_of(found).fault) << " " << late_s;
        EXPECT_NEAR(best_of(found).value, late_s, 0.05);
        EXPECT_LT(std::abs(best_of(found).value - late_s), 4 * best_of(found).sigma);
        EXPECT_LT(best_of(found).sigma, 0.02);
      }
    }
  }
}

TEST(SensorExplanation, EstimatesScalesOfTheWheels) {
  for (int seed = 0; seed < kSeeds; ++seed) {
    for (const double scale : {0.65, 0.92, 1.4}) {
      SyntheticMotion motion = healthy(seed);
      motion.measured_turn = 1 / scale;
      auto found = explain_sensors(motion_sources(motion));
      ASSERT_FALSE(found.likely.empty()) << scale;
      EXPECT_EQ(best_of(found).fault, SensorFault::OdometryYawScale) << to_string(best_of(found).fault);
      EXPECT_NEAR(best_of(found).value, scale, 0.03 * scale);
      EXPECT_TRUE(found.decided);
      motion.measured_turn = 1;
      motion.measured_distance = 1 / scale;
      found = explain_sensors(motion_sources(motion));
      ASSERT_FALSE(found.likely.empty()) << scale;
      EXPECT_EQ(best_of(found).fault, SensorFault::OdometryDistanceScale) << to_string(best_of(found).fault);
      EXPECT_NEAR(best_of(found).value, scale, 0.03 * scale);
    }
  }
}

TEST(SensorExplanation, RecognisesTheUnitAndTheSignOfDistances) {
  for (int seed = 0; seed < kSeeds; ++seed) {
    SyntheticMotion motion = healthy(seed);
    motion.measured_distance = 100;
    auto found = explain_sensors(motion_sources(motion));
    ASSERT_FALSE(found.likely.empty());
    EXPECT_EQ(best_of(found).fault, SensorFault::OdometryDistanceUnit) << to_string(best_of(found).fault);
    EXPECT_TRUE(found.decided) << to_string(found.rival->fault);
    motion.measured_distance = -1;
    found = explain_sensors(motion_sources(motion));
    ASSERT_FALSE(found.likely.empty());
    EXPECT_EQ(best_of(found).fault, SensorFault::OdometryReversed) << to_string(best_of(found).fault);
    EXPECT_FALSE(found.decided);
    ASSERT_TRUE(found.rival);
    EXPECT_EQ(found.rival->fault, SensorFault::MountingReversed);
  }
}

/// Rotations are measured only while the robot turns.
TEST(SensorExplanation, NamesNothingThatTheDriveDoesNotShow) {
  for (int seed = 0; seed < kSeeds; ++seed) {
    SyntheticMotion motion = healthy(seed);
    motion.turning = 0;
    motion.gyro_from_base.row(2) *= -1;
    EXPECT_TRUE(explain_sensors(motion_sources(motion)).likely.empty());
  }
}

/// Without tag sizes, tags show only turns.
TEST(SensorExplanation, DoesWithoutObservedDistances) {
  for (int seed = 0; seed < kSeeds; ++seed) {
    for (const double factor : {1.0, 180 / std::numbers::pi}) {
      SyntheticMotion motion = healthy(seed);
      motion.gyro_from_base *= factor;
      MotionSources sources = motion_sources(motion);
      for (ObservedMotion& observed : sources.observed) {
        observed.twist.x() *= 1.7;
        observed.sigma_m = std::numeric_limits<double>::infinity();
      }
      const auto found = explain_sensors(sources);
      ASSERT_EQ(found.likely.empty(), factor == 1) << to_string(best_of(found).fault);
      if (factor != 1) EXPECT_EQ(best_of(found).fault, SensorFault::GyroUnit);
    }
  }
}

TEST(SensorExplanation, RequiresTwoSourcesAndEnoughIntervals) {
  MotionSources sources = motion_sources(healthy(1));
  EXPECT_TRUE(explain_sensors({}).likely.empty());
  EXPECT_TRUE(explain_sensors({.odometry = sources.odometry}).likely.empty());
  EXPECT_TRUE(explain_sensors({.imu = sources.imu}).likely.empty());
  EXPECT_TRUE(explain_sensors({.observed = sources.observed}).likely.empty());
  sources.observed.resize(5);
  sources.observed.front().twist.x() = std::nan("");
  const auto found = explain_sensors(sources);
  EXPECT_LT(found.intervals, 8U);
  EXPECT_TRUE(found.likely.empty());
}

/// Without odometry, the gyro is compared with the tags, and without a gyro, the odometry is.
TEST(SensorExplanation, ComparesAnyTwoSources) {
  for (int seed = 0; seed < kSeeds; ++seed) {
    SyntheticMotion motion = healthy(seed);
    motion.gyro_from_base *= 180 / std::numbers::pi;
    motion.measured_turn = 2;
    MotionSources sources = motion_sources(motion);
    sources.imu.clear();
    EXPECT_EQ(best_of(explain_sensors(sources)).fault, SensorFault::OdometryYawScale);
    sources = motion_sources(motion);
    sources.odometry.clear();
    EXPECT_EQ(best_of(explain_sensors(sources)).fault, SensorFault::GyroUnit);
  }
}

}  // namespace
}  // namespace waymark
