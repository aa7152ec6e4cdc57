// Tests external faults that stop a replay: clock jumps, robots moved by hand, and frozen cameras.
#include "waymark/replay/replay_watch.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"

namespace waymark {
namespace {

TEST(ReplayWatch, ReportsClockJumpsMotionByHandAndFrozenCameras) {
  ReplayWatch watch({});
  watch.tick(SensorTime{});
  watch.tick(SensorTime{} + std::chrono::milliseconds(50));
  EXPECT_TRUE(watch.alarm().empty());
  watch.tick(SensorTime{} - std::chrono::seconds(1));
  EXPECT_THAT(watch.alarm(), ::testing::HasSubstr(" -1.05 s"));
  testing::expect_on_page("replay", watch.alarm());
  EXPECT_TRUE(watch.lasting());
  watch.forget();
  EXPECT_TRUE(watch.alarm().empty());

  watch.add(Odometry{.odom_T_base = SE2(0, 0, 0)});
  watch.check(SE2(5, 5, 1));
  watch.add(Odometry{.odom_T_base = SE2(0.1, 0, 0)});
  watch.check(SE2(5, 5, 1) * SE2(0.12, 0.01, 0));
  EXPECT_TRUE(watch.alarm().empty());
  watch.check(SE2(5, 5, 1) * SE2(1.1, 0, 0));
  EXPECT_THAT(watch.alarm(), ::testing::HasSubstr(" 0.98 m"));
  testing::expect_on_page("replay", watch.alarm());

  ReplayWatch frozen({});
  TagFrame frame{.detections = {TagDetection{}}};
  frame.detections[0].corners_px.fill({100, 100});
  for (int i = 0; i < 40; ++i) {
    frame.stamp += std::chrono::milliseconds(50);
    frozen.add(Odometry{.stamp = frame.stamp, .odom_T_base = SE2(0, 0, 0)});
    EXPECT_TRUE(frozen.add(frame)) << "the image does not change while the robot is stationary";
  }
  for (int i = 0; i < 40; ++i) {
    frame.stamp += std::chrono::milliseconds(50);
    frozen.add(Odometry{.stamp = frame.stamp, .odom_T_base = SE2(0.02 * (i + 1), 0, 0)});
    EXPECT_FALSE(frozen.add(frame)) << i;
  }
  testing::expect_on_page("replay", frozen.alarm());
  EXPECT_FALSE(frozen.lasting());
  frame.detections[0].corners_px[0].x() += 1e-9;
  EXPECT_TRUE(frozen.add(frame));
  EXPECT_TRUE(frozen.alarm().empty());
}

TEST(ReplayWatch, DetectsOneFrozenCameraOfSeveral) {
  ReplayWatch watch({});
  TagFrame front{.camera = "front", .detections = {TagDetection{}}};
  TagFrame rear{.camera = "rear", .detections = {TagDetection{}}};
  front.detections[0].corners_px.fill({100, 100});
  rear.detections[0].corners_px.fill({200, 100});
  for (int i = 0; i < 80; ++i) {
    front.stamp = rear.stamp += std::chrono::milliseconds(50);
    rear.detections[0].corners_px[0].x() += 0.5;
    watch.add(Odometry{.stamp = front.stamp, .odom_T_base = SE2(0.02 * (i + 1), 0, 0)});
    EXPECT_EQ(watch.add(front), i == 0) << i;
    EXPECT_TRUE(watch.add(rear)) << i;
  }
  EXPECT_FALSE(watch.alarm().empty()) << "although the rear camera is not frozen";
  watch.forget();
  EXPECT_TRUE(watch.alarm().empty());
}

TEST(ReplayWatch, RepeatedTagPosesAreAFrozenCamera) {
  ReplayWatch watch({});
  TagPoseFrame frame{.tags = {{.cam_T_tag = SE3(SO3(), Eigen::Vector3d(0, 0, 1))}}};
  for (int i = 0; i < 40; ++i) {
    frame.stamp += std::chrono::milliseconds(50);
    watch.add(Odometry{.stamp = frame.stamp, .odom_T_base = SE2(0.02 * (i + 1), 0, 0)});
    EXPECT_EQ(watch.add(frame), i == 0) << i;
  }
  EXPECT_FALSE(watch.alarm().empty());
  frame.tags[0].cam_T_tag = SE3(SO3::exp({0, 1e-9, 0}), Eigen::Vector3d(0, 0, 1));
  EXPECT_TRUE(watch.add(frame)) << "the smallest rotation produces a new image";
  EXPECT_TRUE(watch.alarm().empty());
}

/// Commands and odometry every 50 ms, with one second in which there are no commands.
class AfterASecond {
 public:
  AfterASecond() {
    for (int i = 0; i <= 10; ++i) receive(50 * i);
    watch.tick(at(500));
  }
  void receive(int ms) { watch.add(Odometry{.stamp = at(ms), .odom_T_base = SE2()}); }
  static SensorTime at(int ms) { return SensorTime(std::chrono::milliseconds(ms)); }
  ReplayWatch watch{{}};
};

TEST(ReplayWatch, ALateComputerIsNotAClockJump) {
  AfterASecond late;
  late.watch.tick(AfterASecond::at(1500));
  EXPECT_THAT(late.watch.alarm(), ::testing::HasSubstr(" 1.00 s"));
  testing::expect_on_page("replay", late.watch.alarm());
  for (int ms = 550; ms < 1200; ms += 50) late.receive(ms);
  late.watch.tick(AfterASecond::at(1520));
  EXPECT_FALSE(late.watch.alarm().empty()) << "odometry has not caught up yet";
  EXPECT_FALSE(late.watch.lasting());
  for (int ms = 1200; ms <= 1500; ms += 50) late.receive(ms);
  EXPECT_EQ(late.watch.alarm(), "");

  for (const bool odometry_first : {true, false}) {
    AfterASecond jump;
    if (odometry_first) jump.receive(1500);
    jump.watch.tick(AfterASecond::at(1500));
    if (!odometry_first) jump.receive(1500);
    EXPECT_THAT(jump.watch.alarm(), ::testing::HasSubstr(" +1.00 s"));
    EXPECT_TRUE(jump.watch.lasting());
    jump.watch.forget();
    jump.watch.tick(AfterASecond::at(1550));
    EXPECT_EQ(jump.watch.alarm(), "");
  }
}

}  // namespace
}  // namespace waymark
