#include "waymark/localization/sensor_diagnosis.hpp"

#include <chrono>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <set>

#include <gtest/gtest.h>

#include "tests/support/synthetic_motion.hpp"

namespace waymark {
namespace {

using test::motion_sources;
using test::SyntheticMotion;

constexpr double kDegrees = 180 / std::numbers::pi;
constexpr int kSeeds = 3;

std::set<SensorFault> faults_of(const SensorDiagnosis& diagnosis) {
  std::set<SensorFault> faults;
  for (const SensorFinding& finding : diagnosis.findings) faults.insert(finding.found.likely.front().fault);
  return faults;
}

SyntheticMotion motion_with(int seed) { return {.seed = static_cast<std::uint64_t>(seed)}; }

TEST(SensorDiagnosis, LeavesHealthySensorsAsTheyAre) {
  const SensorDiagnosis diagnosis = diagnose_sensors(motion_sources(motion_with(1)));
  EXPECT_TRUE(diagnosis.findings.empty());
  EXPECT_FALSE(diagnosis.correction.changes_imu());
  EXPECT_FALSE(diagnosis.correction.changes_odometry());
  EXPECT_TRUE(diagnosis.correction.gyro_usable);
}

/// Corrected samples are those of a healthy gyro.
TEST(SensorDiagnosis, CorrectsTheUnitAndTheAxisOfTheGyro) {
  for (int seed = 0; seed < kSeeds; ++seed) {
    for (const Eigen::Vector3d& up : {Eigen::Vector3d(0, 0, 1), Eigen::Vector3d(0, 0, -1),
                                      Eigen::Vector3d(0, -1, 0), Eigen::Vector3d(1, 0, 0)}) {
      SyntheticMotion motion = motion_with(seed);
      const auto healthy = motion_sources(motion).imu;
      motion.gyro_from_base =
          kDegrees * Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), up).toRotationMatrix();
      const auto sources = motion_sources(motion);
      const SensorDiagnosis diagnosis = diagnose_sensors(sources);
      ASSERT_EQ(diagnosis.findings.size(), 1U);
      EXPECT_EQ(diagnosis.findings.front().measure, SensorMeasure::Corrected);
      EXPECT_FALSE(describe(diagnosis.findings.front()).empty());
      ASSERT_TRUE(diagnosis.correction.changes_imu());
      for (std::size_t i = 0; i < healthy.size(); i += 100) {
        const ImuSample corrected = diagnosis.correction.corrected(sources.imu[i]);
        EXPECT_NEAR(corrected.angular_velocity_rad_s.z(), healthy[i].angular_velocity_rad_s.z(), 1e-9);
        EXPECT_EQ(corrected.stamp, healthy[i].stamp);
      }
    }
  }
}

TEST(SensorDiagnosis, FindsTwoFaults) {
  for (int seed = 0; seed < kSeeds; ++seed) {
    SyntheticMotion motion = motion_with(seed);
    motion.gyro_from_base *= kDegrees;
    motion.observed_late_s = 0.25;
    const SensorDiagnosis diagnosis = diagnose_sensors(motion_sources(motion));
    EXPECT_EQ(faults_of(diagnosis), (std::set{SensorFault::GyroUnit, SensorFault::ObservationTime}));
    EXPECT_NEAR(diagnosis.correction.observations_late_s, 0.25, 0.03);
    motion.observed_late_s = 0;
    motion.measured_turn = 1.5;
    EXPECT_EQ(faults_of(diagnose_sensors(motion_sources(motion))),
              (std::set{SensorFault::GyroUnit, SensorFault::OdometryYawScale}));
  }
}

TEST(SensorDiagnosis, CorrectsStampsOfTheOdometry) {
  for (int seed = 0; seed < kSeeds; ++seed) {
    SyntheticMotion motion = motion_with(seed);
    motion.odometry_late_s = 0.22;
    const auto sources = motion_sources(motion);
    const SensorDiagnosis diagnosis = diagnose_sensors(sources);
    ASSERT_EQ(faults_of(diagnosis), std::set{SensorFault::OdometryTime});
    const Odometry corrected = diagnosis.correction.corrected(sources.odometry.front());
    EXPECT_NEAR(to_seconds(sources.odometry.front().stamp - corrected.stamp), 0.22, 0.03);
    EXPECT_TRUE(diagnosis.correction.changes_odometry());
  }
}

/// A clock that differs by seconds leaves fewer intervals, but is found as well.
TEST(SensorDiagnosis, FindsLargeTimeOffsets) {
  for (int seed = 0; seed < kSeeds; ++seed) {
    SyntheticMotion motion = motion_with(seed);
    motion.observed_late_s = 2.3;
    const SensorDiagnosis diagnosis = diagnose_sensors(motion_sources(motion));
    EXPECT_EQ(faults_of(diagnosis), std::set{SensorFault::ObservationTime});
    EXPECT_NEAR(diagnosis.correction.observations_late_s, 2.3, 0.05);
  }
}

/// If two sources contradict each other, the gyro is used only if it is right.
TEST(SensorDiagnosis, DoesNotUseAGyroThatMayBeWrong) {
  for (int seed = 0; seed < kSeeds; ++seed) {
    SyntheticMotion motion = motion_with(seed);
    motion.gyro_from_base.setZero();
    motion.gyro_noise_rad_s = 0;
    const SensorDiagnosis dead = diagnose_sensors(motion_sources(motion));
    EXPECT_FALSE(dead.correction.gyro_usable);
    ASSERT_FALSE(dead.findings.empty());
    EXPECT_EQ(dead.findings.front().measure, SensorMeasure::GyroNotUsed);
  }
}

/// Decided or not, wheels that measure too much distance are scaled: a map that is too large requires it,
/// too.
TEST(SensorDiagnosis, ScalesTheOdometryToTheMap) {
  for (int seed = 0; seed < kSeeds; ++seed) {
    SyntheticMotion motion = motion_with(seed);
    motion.measured_distance = 1.2;
    SensorDiagnosis diagnosis = diagnose_sensors(motion_sources(motion));
    EXPECT_NEAR(diagnosis.correction.odometry_scale, 1 / 1.2, 0.02);
    motion.measured_distance = 100;
    diagnosis = diagnose_sensors(motion_sources(motion));
    EXPECT_EQ(diagnosis.correction.distance_unit, 0.01);
    EXPECT_EQ(diagnosis.correction.odometry_scale, 1);
    EXPECT_EQ(faults_of(diagnosis), std::set{SensorFault::OdometryDistanceUnit});
  }
}

/// A reversed odometry and a reversed camera look the same. Nothing is corrected.
TEST(SensorDiagnosis, ReportsWhatItCannotCorrect) {
  SyntheticMotion motion = motion_with(1);
  motion.measured_distance = -1;
  const SensorDiagnosis diagnosis = diagnose_sensors(motion_sources(motion));
  ASSERT_EQ(diagnosis.findings.size(), 1U);
  EXPECT_EQ(diagnosis.findings.front().measure, SensorMeasure::None);
  EXPECT_EQ(diagnosis.correction.odometry_scale, 1);
}

}  // namespace
}  // namespace waymark
