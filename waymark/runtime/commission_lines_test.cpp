// Tests first drives with a simulated robot in which each sign, axis and unit is wrong in turn and must be
// reported.
#include "waymark/runtime/commission_lines.hpp"

#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/first_drive_robot.hpp"
#include "tests/support/golden_page.hpp"

namespace waymark {
namespace {

using test::commissioned;
using test::failures;
using test::FewLines;
using test::kDegrees;
using test::model;
using test::Wrong;

TEST(Commission, ACorrectRobotPasses) {
  for (const double yaw_rad : {0.0, 1.0, -2.5}) EXPECT_EQ(failures(commissioned({}, yaw_rad)), "");
  EXPECT_EQ(failures(commissioned({.only_odometry = true})), "");
  EXPECT_EQ(failures(commissioned({.turns_by = 0.3})), "")
      << "a skid-steer robot turns less than its wheels indicate";
}

struct Case {
  const char* name;
  Wrong wrong;
  const char* message;  ///< expected in the failing lines
  const char* not_words = "@";
};

std::vector<Case> cases() {
  const auto yaw = [](Odometry& o, double factor) {
    o.odom_T_base = {o.odom_T_base.x(), o.odom_T_base.y(), factor * o.odom_T_base.yaw()};
  };
  const auto place = [](Odometry& o, double x, double y) { o.odom_T_base = {x, y, o.odom_T_base.yaw()}; };
  return {
      {"forward is backward",
       {.obeys =
            [](auto c) {
              return VelocityCommand{-c.speed_m_s, c.yaw_rate_rad_s};
            }},
       "command.speed_m_s is reversed",
       "odometry."},
      {"left is right",
       {.obeys =
            [](auto c) {
              return VelocityCommand{c.speed_m_s, -c.yaw_rate_rad_s};
            }},
       "command.yaw_rate_rad_s is reversed",
       "imu"},
      {"swapped",
       {.obeys =
            [](auto c) {
              return VelocityCommand{c.yaw_rate_rad_s, c.speed_m_s};
            }},
       "command.speed_m_s and command.yaw_rate_rad_s are swapped"},
      {"obeys degrees",
       {.obeys =
            [](auto c) {
              return VelocityCommand{c.speed_m_s, c.yaw_rate_rad_s / kDegrees};
            },
        .turns_by = 1},
       "radians taken for degrees"},
      {"does not move", {.obeys = [](auto) { return VelocityCommand{}; }}, "command.speed_m_s does not move"},
      {"odometry reversed",
       {.odometry =
            [=](Odometry& o) {
              o.speed_m_s *= -1;
              place(o, -o.odom_T_base.x(), -o.odom_T_base.y());
            }},
       "odometry.speed_m_s is reversed",
       "command."},
      {"twist reversed",
       {.odometry = [](Odometry& o) { o.speed_m_s *= -1; }},
       "odometry.speed_m_s is reversed",
       "command."},
      {"twist in mm",
       {.odometry = [](Odometry& o) { o.speed_m_s *= 1000; }},
       "odometry.speed_m_s is in millimetres"},
      {"place in mm",
       {.odometry = [=](Odometry& o) { place(o, 1000 * o.odom_T_base.x(), 1000 * o.odom_T_base.y()); }},
       "odometry.position is in millimetres"},
      {"place in cm",
       {.odometry = [=](Odometry& o) { place(o, 100 * o.odom_T_base.x(), 100 * o.odom_T_base.y()); }},
       "odometry.position is in centimetres"},
      {"x reversed",
       {.odometry = [=](Odometry& o) { place(o, -o.odom_T_base.x(), o.odom_T_base.y()); }},
       "odometry.x_m is reversed"},
      {"y reversed",
       {.odometry = [=](Odometry& o) { place(o, o.odom_T_base.x(), -o.odom_T_base.y()); }},
       "odometry.y_m is reversed"},
      {"x and y swapped",
       {.odometry = [=](Odometry& o) { place(o, o.odom_T_base.y(), o.odom_T_base.x()); }},
       "odometry.x_m and odometry.y_m are swapped"},
      {"twist swapped",
       {.odometry = [](Odometry& o) { std::swap(o.speed_m_s, o.yaw_rate_rad_s); }},
       "it and odometry.yaw_rate_rad_s are swapped",
       "command."},
      {"yaw reversed",
       {.odometry = [=](Odometry& o) { yaw(o, -1); }},
       "odometry.yaw_rad is reversed",
       "command."},
      {"yaw in degrees",
       {.odometry = [=](Odometry& o) { yaw(o, kDegrees); }},
       "odometry.yaw_rad is in degrees"},
      {"yaw rate in degrees",
       {.odometry = [](Odometry& o) { o.yaw_rate_rad_s *= kDegrees; }},
       "odometry.yaw_rate_rad_s is in degrees"},
      {"gyro reversed",
       {.imu = [](ImuSample& i) { i.angular_velocity_rad_s *= -1; }},
       "imu.angular_velocity_rad_s is reversed",
       "command."},
      {"gyro in degrees",
       {.imu = [](ImuSample& i) { i.angular_velocity_rad_s *= kDegrees; }},
       "imu.angular_velocity_rad_s is in degrees"},
      {"gyro about x",
       {.imu = [](ImuSample& i) { std::swap(i.angular_velocity_rad_s.x(), i.angular_velocity_rad_s.z()); }},
       "about x"},
      {"acceleration in g",
       {.imu = [](ImuSample& i) { i.linear_acceleration_m_s2 /= 9.81; }},
       "in g instead of"},
      {"imu upside down",
       {.imu = [](ImuSample& i) { i.linear_acceleration_m_s2 *= -1; }},
       "does not point up"},
      {"wheels swapped",
       {.wheels = [](WheelTicks& w) { std::swap(w.left_rad, w.right_rad); }},
       "left and right are swapped",
       "command."},
      {"left wheel reversed",
       {.wheels = [](WheelTicks& w) { w.left_rad *= -1; }},
       "wheels.left_rad is reversed"},
      {"right wheel reversed",
       {.wheels = [](WheelTicks& w) { w.right_rad *= -1; }},
       "wheels.right_rad is reversed"},
      {"wheels in degrees",
       {.wheels =
            [](WheelTicks& w) {
              w.left_rad *= kDegrees;
              w.right_rad *= kDegrees;
            }},
       "wheels is in degrees"},
      {"slow to stop", {.lag_s = 2}, "stop.zero:"},
      {"odometry alone, reversed",
       {.obeys =
            [](auto c) {
              return VelocityCommand{-c.speed_m_s, c.yaw_rate_rad_s};
            },
        .only_odometry = true},
       "or command.speed_m_s is wrong"},
  };
}

TEST(Commission, ReportsEachWrongSignAxisAndUnit) {
  for (const Case& one : cases()) {
    const std::string found = failures(commissioned(one.wrong));
    EXPECT_NE(found.find(one.message), std::string::npos) << one.name << ": " << found;
    EXPECT_EQ(found.find(one.not_words), std::string::npos) << one.name << " reports another key: " << found;
  }
}

TEST(Commission, ReportsACommandExecutedWithAnotherSize) {
  const auto command = [](double turns_by) {
    FewLines robot({.turns_by = turns_by});
    return judge_turn(robot.turn(), model(), Ground::Floor).front();
  };
  for (const double turns_by : {0.85, 1.15}) {
    const CommissionLine line = command(turns_by);
    EXPECT_EQ(line.key, "command.yaw_rate_rad_s");
    EXPECT_EQ(line.verdict, CommissionVerdict::Warn) << turns_by;
    EXPECT_NE(line.message.find(turns_by < 1 ? "turns left by 0.8" : "turns left by 1.1"), std::string::npos)
        << line.message;
    testing::expect_on_page("commission", line.message + "\n" + line.remedy);
  }
  EXPECT_EQ(command(0.95).verdict, CommissionVerdict::Ok);
}

TEST(Commission, LiftedWheelsAreEvaluatedWithoutGyroAndTags) {
  const Wrong still_gyro{.odometry =
                             [](Odometry& o) {
                               o.odom_T_base = {o.odom_T_base.x(), 0, 0};
                               o.yaw_rate_rad_s = 0;
                             },
                         .imu = [](ImuSample& i) { i.angular_velocity_rad_s.setZero(); }};
  FewLines robot(still_gyro);
  const auto lines = judge_turn(robot.turn(), model(), Ground::Lifted);
  EXPECT_EQ(failures(lines), "") << "the wheels turn, but the body does not";
  EXPECT_TRUE(
      std::ranges::any_of(lines, [](const auto& line) { return line.verdict == CommissionVerdict::Warn; }));
  FewLines swapped({.obeys =
                        [](auto c) {
                          return VelocityCommand{c.speed_m_s, -c.yaw_rate_rad_s};
                        },
                    .odometry = still_gyro.odometry});
  EXPECT_NE(failures(judge_turn(swapped.turn(), model(), Ground::Lifted)).find("wheels is reversed"),
            std::string::npos);
}

TEST(Commission, AnObserverDecidesBetweenCommandAndOdometry) {
  FewLines robot({.obeys =
                      [](auto c) {
                        return VelocityCommand{-c.speed_m_s, c.yaw_rate_rad_s};
                      },
                  .only_odometry = true});
  const MotionTrace trace = robot.forward();
  EXPECT_NE(failures(judge_forward(trace, model(), Ground::Lifted, false)).find("a person saw"),
            std::string::npos);
  const std::string other = failures(judge_forward(trace, model(), Ground::Lifted, true));
  EXPECT_NE(other.find("odometry.speed_m_s is reversed"), std::string::npos);
  EXPECT_EQ(other.find("command."), std::string::npos) << other;
}

TEST(Commission, TagsAreAnIndependentSource) {
  FewLines robot({.odometry = [](Odometry& o) { o.speed_m_s *= -1; }});
  MotionTrace trace = robot.forward();
  for (const Odometry& odometry : trace.odometry)
    trace.tags.push_back({odometry.stamp, {}, {2 - odometry.odom_T_base.x(), 0.3}});
  const auto lines = judge_forward(trace, model(), Ground::Floor);
  EXPECT_TRUE(std::ranges::none_of(lines, [](const auto& line) { return line.key == "tags"; }))
      << "tags were in view";
  EXPECT_NE(failures(lines).find("odometry.speed_m_s is reversed"), std::string::npos);
  for (TagPlace& place : trace.tags)
    place.base_p_tag_m *= -1;  // the camera points backwards, although it is configured to point forwards
  EXPECT_NE(failures(judge_forward(trace, model(), Ground::Floor)).find("camera_mounting is reversed"),
            std::string::npos);
}

TEST(Commission, AnInterruptAtAnyDecisionStopsTheRobot) {
  bool moved = false;
  for (int decision = 0; decision < 120; ++decision) {
    FewLines robot({});
    robot.stop_after = decision;
    (void)robot.forward();
    ASSERT_TRUE(robot.interrupted) << decision;
    ASSERT_EQ(robot.commands.last, VelocityCommand{}) << decision;
    moved = moved || robot.commands.moved;
  }
  EXPECT_TRUE(moved);
}

TEST(Commission, StopsWhenOdometryEnds) {
  test::TinyRobot robot;
  robot.wheels_silent = {.from = std::chrono::seconds(2)};
  RobotLoop loop(robot, robot, robot.pacing());
  CommissionMotion motion({.command = {.speed_m_s = 0.1}, .most_s = 10}, {});
  RobotListener listener;
  listener.on_sample = [&](const Sample& sample) {
    motion.receive(sample);
    return Status();
  };
  listener.decide = [&](Duration uptime, SensorTime now) { return motion.decide(uptime, now); };
  const auto end = loop.drive(listener);
  ASSERT_FALSE(end);
  EXPECT_EQ(end.error().code, ErrorCode::Unreadable);
  testing::expect_on_page("commission", end.error());
  EXPECT_EQ(robot.last(), VelocityCommand{});
  EXPECT_LT(robot.clock, std::chrono::milliseconds(2700));
}

}  // namespace
}  // namespace waymark
