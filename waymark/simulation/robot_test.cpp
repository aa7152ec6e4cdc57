// The simulated robot against what its options promise.
#include <chrono>
#include <cmath>
#include <numbers>

#include <gtest/gtest.h>
#include <Eigen/LU>

#include "waymark/simulation/motion_sensors.hpp"
#include "waymark/simulation/path.hpp"
#include "waymark/simulation/robot_dynamics.hpp"
#include "waymark/simulation/scripted_driver.hpp"
#include "waymark/simulation/tag_camera.hpp"

namespace waymark {
namespace {

constexpr Duration kStep = std::chrono::milliseconds(5);

RobotModel small_robot() {
  return {
      .name = "test",
      .hull = {.front_m = 0.16, .rear_m = 0.16, .width_m = 0.22, .height_m = 0.25},
      .limits = {.speed_m_s = 1, .yaw_rate_rad_s = 2, .acceleration_m_s2 = 2, .yaw_acceleration_rad_s2 = 6},
      .wheel_radius_m = 0.045,
      .track_m = 0.172,
      .base_T_cam = SE3()};
}

const DynamicsOptions kPerfect = {.speed_lag_s = 0,
                                  .yaw_rate_lag_s = 0,
                                  .command_delay_s = 0,
                                  .yaw_gain = 1,
                                  .lateral_slip_s = 0,
                                  .slip_noise_m_s = 0};

std::vector<Eigen::Vector2d> circle(double radius, int points) {
  std::vector<Eigen::Vector2d> result;
  for (int i = 0; i < points; ++i) {
    const double a = 2 * std::numbers::pi * i / points;
    result.emplace_back(radius * std::cos(a), radius * std::sin(a));
  }
  return result;
}

TEST(Path, OfPointsOnACircleIsNearlyTheCircle) {
  const auto path = sample_path(circle(2.0, 60), true, 0.02);
  ASSERT_FALSE(path.empty());
  const double length = path.back().arc_length_m + path[1].arc_length_m;
  EXPECT_NEAR(length, 4 * std::numbers::pi, 1e-3);
  for (const PathPoint& point : path) {
    EXPECT_NEAR(point.map_T_path.translation().norm(), 2.0, 1e-4);
    EXPECT_NEAR(point.curvature_1_m, 0.5, 0.01);
  }
  EXPECT_TRUE(sample_path({{0, 0}, {1, 1}}, true, 0.02).empty());
}

TEST(Dynamics, APerfectRobotDrivesACircle) {
  RobotDynamics robot(small_robot(), kPerfect, SE2(), Random(1));
  for (int i = 0; i < 400; ++i)
    robot.step({0.5, 0.5}, std::chrono::milliseconds(5));  // 2 s, less what limits take
  // Radius v / w = 1 about (0, 1), whatever the time it took to get going (both ramps are equally long in
  // share).
  const double v_loss = 0.5 * 0.5 / 2 / 2;  // ramp of 0.25 s at 2 m/s^2
  EXPECT_NEAR(robot.map_T_base().yaw(), 1.0 - 0.5 * 0.5 / 6 / 2, 5e-3);
  EXPECT_NEAR(robot.wheel_ticks().right_rad + robot.wheel_ticks().left_rad, 2 * (1.0 - v_loss) / 0.045, 0.2);
}

TEST(Dynamics, CommandsActAfterTheDelayAndTheYawGainHolds) {
  DynamicsOptions options = kPerfect;
  options.command_delay_s = 0.1;
  options.yaw_gain = 0.8;
  RobotDynamics robot(small_robot(), options, SE2(), Random(1));
  for (int i = 0; i < 20; ++i) robot.step({0, 1.0}, kStep);
  EXPECT_EQ(robot.yaw_rate_rad_s(), 0);
  for (int i = 0; i < 100; ++i) robot.step({0, 1.0}, kStep);
  EXPECT_NEAR(robot.yaw_rate_rad_s(), 0.8, 1e-9);
}

TEST(Dynamics, AStandingRobotStaysWhereItIs) {
  RobotDynamics robot(small_robot(), {}, SE2(1, 2, 3), Random(1));
  for (int i = 0; i < 1000; ++i) robot.step({}, kStep);
  EXPECT_EQ(robot.map_T_base(), SE2(1, 2, 3));
}

TEST(MotionSensors, WithoutErrorsOdometryIsTheTruth) {
  RobotDynamics robot(small_robot(), kPerfect, SE2(), Random(1));
  MotionSensors sensors(small_robot(),
                        {.left_wheel_scale = 1,
                         .right_wheel_scale = 1,
                         .ticks_per_turn = 1e6,
                         .gyro_noise_rad_s = 0,
                         .gyro_bias_rad_s = 0},
                        Random(2));
  Odometry odometry = sensors.read_odometry(robot);
  for (int i = 0; i < 2000; ++i) {
    robot.step({0.4, 0.3}, kStep);
    odometry = sensors.read_odometry(robot);
  }
  const SE2 difference = odometry.odom_T_base.inverse() * robot.map_T_base();
  EXPECT_LT(difference.log().norm(), 5e-3);
}

TEST(MotionSensors, WheelScaleStretchesOdometry) {
  RobotDynamics robot(small_robot(), kPerfect, SE2(), Random(1));
  MotionSensors sensors(
      small_robot(),
      {.left_wheel_scale = 1.05, .right_wheel_scale = 1.05, .gyro_noise_rad_s = 0, .gyro_bias_rad_s = 0},
      Random(2));
  (void)sensors.read_odometry(robot);
  for (int i = 0; i < 1000; ++i) robot.step({0.5, 0}, kStep);
  EXPECT_NEAR(sensors.read_odometry(robot).odom_T_base.x() / robot.map_T_base().x(), 1.05, 1e-3);
}

TEST(Driver, DrivesALapAndStopsLikeAPerson) {
  DriverOptions options;
  options.speed_m_s = 0.4;
  const auto path = sample_path(circle(2.0, 60), true, 0.02);
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    RobotDynamics robot(small_robot(), {}, path[0].map_T_path, Random(seed));
    ScriptedDriver driver(path, true, options, Random(seed + 100));
    double worst = 0;
    double driven = 0;
    for (int i = 0; i < 20000 && !driver.done(); ++i) {
      robot.step(driver.drive(robot.map_T_base(), robot.now()), kStep);
      worst = std::max(worst, std::abs(robot.map_T_base().translation().norm() - 2.0));
      driven += robot.speed_m_s() * to_seconds(kStep);
    }
    EXPECT_TRUE(driver.done());
    EXPECT_LT(worst, 0.15);
    EXPECT_GT(worst, 0.005) << "a person is not perfect";
    EXPECT_NEAR(driven, 4 * std::numbers::pi + options.overlap_m, 0.4);
  }
}

TEST(Driver, AClockThatGoesBackMakesNoCommandOfNoNumber) {
  const auto path = sample_path({{0, 0}, {1, 0.1}, {2, 0}}, false, 0.02);
  ScriptedDriver driver(path, false, {}, Random(1));
  for (const int ms : {1000, 1050, 900, 950, 1100}) {
    const VelocityCommand command = driver.drive(SE2(), SensorTime(std::chrono::milliseconds(ms)));
    EXPECT_TRUE(std::isfinite(command.speed_m_s)) << ms;
    EXPECT_TRUE(std::isfinite(command.yaw_rate_rad_s)) << ms;
  }
}

TEST(TagCamera, NoiseIsAsItsCovarianceSays) {
  World world;
  world.tags.tags[TagId{.number = 3}] = {.map_T_tag = SE3(SO3(), {0.1, 0, 1.5}), .size_m = 0.16};
  const CameraModel camera =
      CameraModel::make(PinholeRadtan{.fx = 442, .fy = 443, .cx = 320, .cy = 240}, 640, 480).value();
  const auto truth = visible_corners(camera, SE3(SO3(), {0.1, 0, 1.5}), 0.16);
  ASSERT_TRUE(truth);
  Random random(5);
  double normalized = 0;
  int seen = 0;
  constexpr int kFrames = 4000;
  for (int i = 0; i < kFrames; ++i) {
    const TagFrame frame = see_tags(world, camera, SE3(), SensorTime{}, {.miss_probability = 0.1}, random);
    if (frame.detections.empty()) continue;
    ++seen;
    const TagDetection& tag = frame.detections[0];
    Eigen::Matrix<double, 8, 1> error;
    for (std::size_t k = 0; k < 4; ++k)
      error.segment<2>(2 * static_cast<Eigen::Index>(k)) = tag.corners_px[k] - (*truth)[k];
    normalized += error.dot(tag.corner_covariance_px2->inverse() * error);
  }
  EXPECT_NEAR(seen, 0.9 * kFrames, 4 * std::sqrt(0.09 * kFrames));
  EXPECT_NEAR(normalized / seen, 8.0, 4 * std::sqrt(16.0 / seen));
}

TEST(UprightTag, FacesItsReader) {
  const SE3 map_T_tag = upright_tag({1, 2, 0.3}, std::numbers::pi / 2);
  EXPECT_TRUE((map_T_tag.rotation() * Eigen::Vector3d::UnitZ()).isApprox(Eigen::Vector3d(0, -1, 0), 1e-12))
      << "z into the tag";
  EXPECT_TRUE((map_T_tag.rotation() * Eigen::Vector3d::UnitY()).isApprox(Eigen::Vector3d(0, 0, -1), 1e-12))
      << "y down";
  EXPECT_TRUE((map_T_tag.rotation() * Eigen::Vector3d::UnitX()).isApprox(Eigen::Vector3d(-1, 0, 0), 1e-12))
      << "x right";
}

TEST(Simulation, TheSameSeedGivesTheSameRun) {
  const auto run = [] {
    RobotDynamics robot(small_robot(), {}, SE2(), Random(7));
    MotionSensors sensors(small_robot(), {}, Random(8));
    for (int i = 0; i < 500; ++i) robot.step({0.3, 0.2}, kStep);
    return std::pair(robot.map_T_base(), sensors.read_imu(robot).angular_velocity_rad_s.z());
  };
  EXPECT_EQ(run(), run());
}

}  // namespace
}  // namespace waymark
