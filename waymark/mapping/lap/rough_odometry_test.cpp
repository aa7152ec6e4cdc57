// Tests the scales of odometry and gyro estimated from motions past tags, without a map.
#include "waymark/mapping/lap/rough_odometry.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "tests/support/ring_drive.hpp"

namespace waymark::internal {
namespace {

using test::drive_ring;
using test::observed_frames;
using test::RingDrive;

RoughOdometry rough(const RingDrive& drive) { return rough_odometry(drive.lap, observed_frames(drive.lap)); }

/// Adds a gyro at 50 Hz that measures the true rate times a scale, plus a bias.
void add_gyro(RingDrive& drive, double scale, double bias_rad_s) {
  constexpr double kRate_rad_s = 0.5;  // 0.5 m/s on a circle with a radius of 1 m
  const SensorTime end = drive.lap.frames.back().stamp;
  for (SensorTime at = drive.lap.frames.front().stamp; at <= end; at += std::chrono::milliseconds(20))
    drive.lap.imu.push_back(
        {.stamp = at, .angular_velocity_rad_s = {0, 0, kRate_rad_s / scale + bias_rad_s}});
}

/// The total motion according to odometry.
SE2 motion_of(const std::vector<Odometry>& odometry) {
  return odometry.front().odom_T_base.inverse() * odometry.back().odom_T_base;
}

TEST(RoughOdometry, NearlyCorrectOdometryIsNotChanged) {
  for (const double scale : {0.9, 1.0, 1.15}) {
    const RingDrive drive = drive_ring({.odometry_distance = scale, .odometry_yaw = 2 - scale});
    const RoughOdometry found = rough(drive);
    EXPECT_EQ(found.distance, 1) << scale;
    EXPECT_EQ(found.yaw, 1) << scale;
    EXPECT_FALSE(found.turns_by_gyro);
    ASSERT_EQ(found.odometry.size(), drive.lap.odometry.size());
    for (std::size_t i = 0; i < found.odometry.size(); ++i)
      EXPECT_EQ(found.odometry[i].odom_T_base.matrix(), drive.lap.odometry[i].odom_T_base.matrix());
  }
}

TEST(RoughOdometry, LargeScaleErrorsAreCorrected) {
  for (const double odometry_distance : {0.5, 1.0, 3.0}) {
    for (const double odometry_yaw : {0.4, 1.0, 1.5}) {
      const RingDrive drive =
          drive_ring({.odometry_distance = odometry_distance, .odometry_yaw = odometry_yaw});
      const RoughOdometry found = rough(drive);
      EXPECT_NEAR(found.distance * odometry_distance, 1, 0.02) << odometry_distance << " " << odometry_yaw;
      EXPECT_NEAR(found.yaw * odometry_yaw, 1, 0.02) << odometry_distance << " " << odometry_yaw;
      ASSERT_EQ(found.odometry.size(), drive.lap.odometry.size());
      // Each step equals the true motion.
      for (std::size_t i = 1; i < found.odometry.size(); i += 17) {
        const SE2 step = found.odometry[i - 1].odom_T_base.inverse() * found.odometry[i].odom_T_base;
        EXPECT_LT((step.log() - SE2::Tangent(0.05, 0, 0.05)).norm(), 0.02 * 0.05 * 2) << i;
        EXPECT_EQ(found.odometry[i].stamp, drive.lap.odometry[i].stamp);
      }
    }
  }
}

TEST(RoughOdometry, AMovingTagHasLittleEffect) {
  RingDrive drive = drive_ring({.odometry_distance = 0.5, .odometry_yaw = 0.5});
  auto observed = observed_frames(drive.lap);
  Random random(4);
  for (ObservedFrame& frame : observed) {
    for (TagPoseObservation& seen : frame.tags) {
      if (seen.tag.number % 4 != 0) continue;
      const Eigen::Vector3d aside(random.normal(0, 0.5), random.normal(0, 0.1), random.normal(0, 0.5));
      seen.cam_T_tag = SE3(seen.cam_T_tag.rotation(), seen.cam_T_tag.translation() + aside);
    }
  }
  const RoughOdometry found = rough_odometry(drive.lap, observed);
  EXPECT_NEAR(found.distance, 2, 0.1);
  EXPECT_NEAR(found.yaw, 2, 0.1);
}

TEST(RoughOdometry, AGyroReplacesTurnsOfSkiddingWheels) {
  RingDrive drive = drive_ring({.loops = 2, .odometry_sigma_rad = 0.05});
  add_gyro(drive, 1.02, 0.01);
  const RoughOdometry found = rough(drive);
  EXPECT_TRUE(found.turns_by_gyro);
  const SE2 truth = drive.way.front().inverse() * drive.way.back();
  const double off = (truth.inverse() * motion_of(found.odometry)).yaw();
  const double before = (truth.inverse() * motion_of(drive.lap.odometry)).yaw();
  EXPECT_LT(std::abs(off), 0.15) << "the total turn is 12.6 rad";
  EXPECT_LT(std::abs(off), std::abs(before) + 0.05);
  // The steps are smooth, unlike those of the odometry.
  double rough_steps = 0;
  double wheel_steps = 0;
  for (std::size_t i = 1; i < found.odometry.size(); ++i) {
    const auto turn = [i](const std::vector<Odometry>& o) {
      return (o[i - 1].odom_T_base.inverse() * o[i].odom_T_base).yaw() - 0.05;
    };
    rough_steps += std::pow(turn(found.odometry), 2);
    wheel_steps += std::pow(turn(drive.lap.odometry), 2);
  }
  EXPECT_LT(rough_steps, 0.01 * wheel_steps);
}

TEST(RoughOdometry, AGyroThatAgreesWithGoodOdometryIsNotUsed) {
  RingDrive drive = drive_ring();
  add_gyro(drive, 1, 0);
  EXPECT_FALSE(rough(drive).turns_by_gyro);
}

TEST(RoughOdometry, AGyroOfAnotherDriveIsNotUsed) {
  RingDrive drive = drive_ring({.odometry_sigma_rad = 0.05});
  Random random(5);
  for (int i = 0; i < 1000; ++i)
    drive.lap.imu.push_back({.stamp = SensorTime(std::chrono::milliseconds(20 * i)),
                             .angular_velocity_rad_s = {0, 0, random.normal()}});
  EXPECT_FALSE(rough(drive).turns_by_gyro);
}

TEST(RoughOdometry, IsUnchangedWithTooLittleData) {
  RingDrive drive = drive_ring({.loops = 0.1, .odometry_distance = 0.3, .odometry_yaw = 0.3});
  EXPECT_EQ(rough(drive).distance, 1) << "half a metre";
  drive = drive_ring({.odometry_distance = 0.3});
  for (TagFrame& frame : drive.lap.frames) frame.detections.clear();
  EXPECT_EQ(rough(drive).distance, 1) << "no tags";
  drive.lap.odometry.clear();
  EXPECT_TRUE(rough(drive).odometry.empty());
  const RoughOdometry none = rough_odometry({.camera = test::ring_camera()}, {});
  EXPECT_EQ(none.yaw, 1);
}

TEST(RoughOdometry, TwoCamerasGiveTheSameResultAsOne) {
  const RingDrive drive = drive_ring({.odometry_distance = 0.5, .odometry_yaw = 0.4, .rear = true});
  const RoughOdometry found = rough(drive);
  EXPECT_NEAR(found.distance, 2, 0.05);
  EXPECT_NEAR(found.yaw, 2.5, 0.06);
}

}  // namespace
}  // namespace waymark::internal
