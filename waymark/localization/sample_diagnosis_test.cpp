#include "waymark/localization/sample_diagnosis.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numbers>
#include <variant>
#include <vector>

#include <gtest/gtest.h>

#include "waymark/base/random.hpp"
#include "waymark/geometry/planar.hpp"
#include "waymark/localization/observed_motions.hpp"
#include "waymark/samples/mounted_camera.hpp"
#include "waymark/samples/visibility.hpp"

namespace waymark {
namespace {

/// A robot that drives an ellipse in a room with tags on its walls.
struct RoomDrive {
  PinholeRadtan lens{.fx = 520, .fy = 520, .cx = 320, .cy = 240, .k = {}, .coefficients = 0};
  MountedSensor sensor{CameraModel::make(lens, 640, 480).value(), SE3(body_R_optical(), {0.1, 0, 0.22})};
  TagMap map{};
  Landmarks landmarks{};
  RiekfOptions options{};
  std::vector<Sample> samples{};
  std::vector<std::pair<SensorTime, SE2>> truth{};

  explicit RoomDrive(double gyro_factor = 1) {
    for (int i = 0; i < 24; ++i) add_tag(i);
    landmarks = Landmarks(map);
    drive(gyro_factor);
  }

  /// Tags on a circle of 4 m, facing its centre.
  void add_tag(int number) {
    const double angle = 2 * std::numbers::pi * number / 24;
    const SE3 map_T_wall(SO3::exp({0, 0, angle}), {4 * std::cos(angle), 4 * std::sin(angle), 0.3});
    map.tags[{.number = number}] = {.map_T_tag = map_T_wall * SE3(body_R_optical(), {0, 0, 0}),
                                    .size_m = 0.2};
  }

  void drive(double gyro_factor) {
    constexpr double kStep_s = 0.01;
    Random random(5);
    SE2 map_T_base(0, -1.5, 0);
    SE2 odom_T_base;
    for (int i = 0; i < 4000; ++i) {
      const double t = kStep_s * i;
      const SensorTime stamp(Duration(std::llround((100 + t) * 1e9)));
      const double yaw_rate = 0.25 + 0.15 * std::sin(0.5 * t);
      ImuSample imu{.stamp = stamp};
      imu.angular_velocity_rad_s.z() = gyro_factor * (yaw_rate + 0.003 * random.normal());
      samples.emplace_back(imu);
      if (i % 2 == 0) samples.emplace_back(Odometry{.stamp = stamp, .odom_T_base = odom_T_base});
      if (i % 10 == 0) samples.emplace_back(seen_from(map_T_base, stamp, random));
      truth.emplace_back(stamp, map_T_base);
      const Eigen::Vector3d step(0.3 * kStep_s, 0, yaw_rate * kStep_s);
      map_T_base = map_T_base * SE2::exp(step);
      const double slip = 2e-4 * random.normal();
      odom_T_base = odom_T_base * SE2::exp({step.x(), 0, step.z() + slip});
    }
  }

  [[nodiscard]] TagFrame seen_from(const SE2& map_T_base, SensorTime stamp, Random& random) const {
    TagFrame frame{.stamp = stamp};
    const SE3 map_T_cam = lift(map_T_base) * sensor.base_T_sensor;
    for (const auto& [id, tag] : map.tags) {
      auto corners = visible_corners(*sensor.camera, map_T_cam.inverse() * tag.map_T_tag, tag.size_m);
      if (!corners) continue;
      for (Eigen::Vector2d& corner : *corners) {
        corner.x() += 0.2 * random.normal();
        corner.y() += 0.2 * random.normal();
      }
      frame.detections.push_back({.tag = id, .corners_px = *corners});
    }
    return frame;
  }

  [[nodiscard]] SE2 truth_at(SensorTime stamp) const {
    return std::ranges::find(truth, stamp, &std::pair<SensorTime, SE2>::first)->second;
  }
};

TEST(SampleDiagnosis, ObservedMotionsAreTrueWithinTheirDeviations) {
  const RoomDrive room;
  const auto motions = observed_motions(room.samples, room.landmarks, room.sensor, room.options);
  ASSERT_GT(motions.size(), 30U);
  double turn2 = 0;
  double distance2 = 0;
  for (const ObservedMotion& motion : motions) {
    const SE2::Tangent off =
        motion.twist - (room.truth_at(motion.from).inverse() * room.truth_at(motion.to)).log();
    turn2 += off.z() * off.z() / (motion.sigma_rad * motion.sigma_rad);
    distance2 += off.x() * off.x() / (motion.sigma_m * motion.sigma_m);
  }
  const auto n = static_cast<double>(motions.size());
  EXPECT_LT(turn2 / n, 2);
  EXPECT_LT(distance2 / n, 2);
}

TEST(SampleDiagnosis, LeavesAHealthyDriveAsItIs) {
  const RoomDrive room;
  const auto diagnosis =
      diagnose_sensors(motion_sources(room.samples, room.landmarks, room.sensor, room.options));
  EXPECT_TRUE(diagnosis.findings.empty());
}

TEST(SampleDiagnosis, CorrectsAGyroInDegreesPerSecond) {
  RoomDrive room(180 / std::numbers::pi);
  const RoomDrive healthy;
  const auto diagnosis =
      diagnose_sensors(motion_sources(room.samples, room.landmarks, room.sensor, room.options));
  ASSERT_EQ(diagnosis.findings.size(), 1U);
  EXPECT_EQ(diagnosis.findings.front().found.likely.front().fault, SensorFault::GyroUnit);
  apply(diagnosis.correction, room.samples, room.options);
  ASSERT_EQ(room.samples.size(), healthy.samples.size());
  for (std::size_t i = 0; i < room.samples.size(); ++i) {
    const auto* imu = std::get_if<ImuSample>(&room.samples[i]);
    if (imu == nullptr) continue;
    EXPECT_NEAR(imu->angular_velocity_rad_s.z(),
                std::get<ImuSample>(healthy.samples[i]).angular_velocity_rad_s.z(), 1e-9);
  }
}

TEST(SampleDiagnosis, AppliesTimesAndScales) {
  RoomDrive room;
  const SensorCorrection correction{.odometry_late_s = 0.2,
                                    .observations_late_s = 0.1,
                                    .yaw_scale = 1.1,
                                    .odometry_scale = 0.9,
                                    .gyro_usable = false};
  apply(correction, room.samples, room.options);
  EXPECT_EQ(room.options.camera_latency_s, 0.1);
  EXPECT_EQ(room.options.yaw_scale, 1.1);
  EXPECT_EQ(room.options.odometry_scale, 0.9);
  EXPECT_EQ(room.options.rotation, "odometry");
  EXPECT_TRUE(std::ranges::is_sorted(room.samples, {}, stamp_of));
  EXPECT_TRUE(std::holds_alternative<Odometry>(room.samples.front()));
}

TEST(SampleDiagnosis, KeepsScalesAndTimesThatTheCallerSets) {
  SensorDiagnosis diagnosis;
  diagnosis.correction = {.gyro_unit = 0.0175, .odometry_late_s = 0.2, .yaw_scale = 1.1};
  SensorExplanations late;
  late.likely.push_back({.fault = SensorFault::OdometryTime, .value = 0.2});
  diagnosis.findings.push_back({late, SensorMeasure::Corrected});
  diagnosis = without_scales_and_times(diagnosis);
  EXPECT_EQ(diagnosis.correction.gyro_unit, 0.0175);
  EXPECT_EQ(diagnosis.correction.odometry_late_s, 0);
  EXPECT_EQ(diagnosis.correction.yaw_scale, 1);
  EXPECT_EQ(diagnosis.findings.front().measure, SensorMeasure::None);
}

}  // namespace
}  // namespace waymark
