// Tests that the simulated robot applies scripted faults at the right time.
#include "waymark/robots/simulated/simulated_robot.hpp"

#include <cmath>
#include <functional>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

namespace waymark {
namespace {

/// Two tags straight ahead of the robot.
World some_world() {
  World world{.name = "two"};
  for (const int i : {0, 1})
    world.tags.tags[{FamilyId::Tag36h11, i}] = {
        .map_T_tag = upright_tag({3, 0.3 - 0.6 * i, 0.3}, std::numbers::pi), .size_m = 0.16};
  return world;
}

struct Received {
  std::vector<TagFrame> frames;
  std::vector<Odometry> odometry;
  std::vector<WheelTicks> wheels;
  std::vector<ImuSample> imu;
  std::vector<TruthPose> truth;
};

Received drive(std::vector<Fault> faults, double seconds = 4) {
  const Eigen::Matrix3d optical = (Eigen::Matrix3d() << 0, 0, 1, -1, 0, 0, 0, -1, 0).finished();
  const RobotModel model{
      .limits = {.speed_m_s = 1, .yaw_rate_rad_s = 2, .acceleration_m_s2 = 2, .yaw_acceleration_rad_s2 = 8},
      .wheel_radius_m = 0.05,
      .track_m = 0.2,
      .base_T_cam = SE3(SO3::from_matrix(optical), {0.1, 0, 0.2})};
  SimulatedRobotOptions options;
  options.tag_camera.miss_probability = 0;
  options.tag_camera.corner_sigma_px = 0.1;
  options.faults = std::move(faults);
  SimulatedRobot robot(
      some_world(), model,
      CameraModel::make(PinholeRadtan{.fx = 440, .fy = 440, .cx = 320, .cy = 240}, 640, 480).value(), SE2(),
      options);
  Received received;
  while (to_seconds(robot.uptime()) < seconds) {
    (void)robot.command({0.2, 0});
    const Sample sample = robot.next();
    if (const auto* frame = std::get_if<TagFrame>(&sample)) received.frames.push_back(*frame);
    if (const auto* odometry = std::get_if<Odometry>(&sample)) received.odometry.push_back(*odometry);
    if (const auto* wheels = std::get_if<WheelTicks>(&sample)) received.wheels.push_back(*wheels);
    if (const auto* imu = std::get_if<ImuSample>(&sample)) received.imu.push_back(*imu);
    if (const auto* truth = std::get_if<TruthPose>(&sample)) received.truth.push_back(*truth);
  }
  return received;
}

double seconds_of(SensorTime stamp) { return to_seconds(stamp.time_since_epoch()); }
bool within(SensorTime stamp, double from_s, double until_s) {
  return seconds_of(stamp) >= from_s && seconds_of(stamp) < until_s;
}

TEST(SimulatedFaults, ABlackoutHasNoDetectionsAndALostCameraNoFrames) {
  for (const TagFrame& frame : drive({{.kind = FaultKind::CameraBlackout, .at_s = 1, .for_s = 1}}).frames)
    EXPECT_EQ(frame.detections.size(), within(frame.stamp, 1, 2) ? 0U : 2U) << seconds_of(frame.stamp);
  const Received silent = drive({{.kind = FaultKind::CameraLost, .at_s = 1, .for_s = 1}});
  EXPECT_NEAR(static_cast<double>(silent.frames.size()), 15 * 3, 2);
  for (const TagFrame& frame : silent.frames) EXPECT_FALSE(within(frame.stamp, 1, 2));
}

TEST(SimulatedFaults, AFrozenCameraRepeatsTheLastImageWithNewStamps) {
  const Received received = drive({{.kind = FaultKind::CameraFrozen, .at_s = 1, .for_s = 1}});
  const TagFrame* before = nullptr;
  int frozen = 0;
  for (const TagFrame& frame : received.frames) {
    const bool same = before != nullptr &&
                      frame.detections.at(0).corners_px.at(0) == before->detections.at(0).corners_px.at(0);
    EXPECT_EQ(same, within(frame.stamp, 1, 2)) << seconds_of(frame.stamp);
    EXPECT_TRUE(before == nullptr || frame.stamp > before->stamp);
    frozen += same ? 1 : 0;
    before = &frame;
  }
  EXPECT_NEAR(frozen, 15, 1);
}

TEST(SimulatedFaults, LostOdometryLeavesTheImu) {
  const Received received = drive({{.kind = FaultKind::OdometryLost, .at_s = 1, .for_s = 1}});
  for (const Odometry& odometry : received.odometry) EXPECT_FALSE(within(odometry.stamp, 1, 2));
  for (const WheelTicks& wheels : received.wheels) EXPECT_FALSE(within(wheels.stamp, 1, 2));
  EXPECT_NEAR(static_cast<double>(received.imu.size()), 400, 3);
  EXPECT_NEAR(static_cast<double>(received.odometry.size()), 150, 3);
}

TEST(SimulatedFaults, ARemovedTagIsNotDetectedAndADuplicateIsDetectedTwice) {
  const TagId tag{FamilyId::Tag36h11, 0};
  for (const TagFrame& frame :
       drive({{.kind = FaultKind::TagRemoved, .at_s = 1, .for_s = 1, .tag = tag}}).frames)
    EXPECT_EQ(frame.detections.size(), within(frame.stamp, 1, 2) ? 1U : 2U);
  const Fault copy{.kind = FaultKind::TagDuplicated,
                   .at_s = 2,
                   .tag = tag,
                   .map_T_copy = upright_tag({3, 0, 0.3}, std::numbers::pi)};
  for (const TagFrame& frame : drive({copy}).frames) {
    const auto same = std::ranges::count(frame.detections, tag, &TagDetection::tag);
    EXPECT_EQ(same, seconds_of(frame.stamp) < 2 ? 1 : 2);
  }
}

TEST(SimulatedFaults, AKidnappedRobotMovesWithoutOdometry) {
  const Received received =
      drive({{.kind = FaultKind::Kidnapped, .at_s = 2, .base_T_put = SE2(0, 1, std::numbers::pi / 2)}});
  for (const TruthPose& truth : received.truth) {
    const double y = truth.map_T_base.translation().y();
    EXPECT_TRUE(seconds_of(truth.stamp) >= 2 || std::abs(y) < 0.05) << y;
    EXPECT_TRUE(seconds_of(truth.stamp) <= 2.01 || y > 0.95) << y;
  }
  EXPECT_LT(std::abs(received.odometry.back().odom_T_base.y()), 0.05);
}

TEST(SimulatedFaults, AClockJumpShiftsAllLaterStampsAndNothingElse) {
  for (const double jump : {0.5, -0.5}) {
    const Received received = drive({{.kind = FaultKind::ClockJump, .at_s = 2, .jump_s = jump}});
    const Received whole = drive({});
    ASSERT_EQ(received.imu.size(), whole.imu.size()) << "nothing is lost";
    for (std::size_t i = 0; i < received.imu.size(); ++i) {
      const double shift = to_seconds(received.imu[i].stamp - whole.imu[i].stamp);
      EXPECT_DOUBLE_EQ(shift, seconds_of(whole.imu[i].stamp) < 2.0 ? 0 : jump) << i;
    }
    EXPECT_EQ(received.truth.back().map_T_base.translation(), whole.truth.back().map_T_base.translation());
  }
}

TEST(SimulatedFaults, InASlipBurstTheWheelsCountMoreThanTheTravelledDistance) {
  const Received received =
      drive({{.kind = FaultKind::SlipBurst, .at_s = 1, .for_s = 2, .speed_share = 0.5}});
  const double travelled_m = received.truth.back().map_T_base.translation().x();
  const double counted_m = received.odometry.back().odom_T_base.x() / 1.02;  // the default scale error
  EXPECT_NEAR(counted_m - travelled_m, 0.5 * 0.2 * 2, 0.01);
}

TEST(SimulatedFaults, WithoutFaultsNothingChanges) {
  const Received with = drive({{.kind = FaultKind::CameraBlackout, .at_s = 100, .for_s = 1}});
  const Received without = drive({});
  ASSERT_EQ(with.frames.size(), without.frames.size());
  EXPECT_EQ(with.frames.back().detections.at(0).corners_px,
            without.frames.back().detections.at(0).corners_px);
}

}  // namespace
}  // namespace waymark
