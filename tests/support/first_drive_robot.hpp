#pragma once

#include <cmath>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/tiny_robot.hpp"
#include "waymark/runtime/commission_lines.hpp"
#include "waymark/runtime/commission_motion.hpp"
#include "waymark/runtime/step_robot.hpp"

/// A minimal robot that may be wired or programmed wrongly, and its first drive.
namespace waymark::test {

inline constexpr double kRadius_m = 0.045;
inline constexpr double kTrack_m = 0.172;
inline constexpr double kDegrees = 180 / M_PI;

/// Faults of a robot: changes of the commands that it obeys and of the samples that it sends.
struct Wrong {
  std::function<VelocityCommand(VelocityCommand)> obeys = [](VelocityCommand c) { return c; };
  std::function<void(Odometry&)> odometry = [](Odometry&) {};
  std::function<void(WheelTicks&)> wheels = [](WheelTicks&) {};
  std::function<void(ImuSample&)> imu = [](ImuSample&) {};
  double turns_by = 0.6;  ///< fraction of the commanded yaw rate, because of skidding
  double lag_s = 0.12;
  bool only_odometry = false;
};

inline RobotModel model() {
  RobotModel made = tiny_model();
  made.wheel_radius_m = kRadius_m;
  made.track_m = kTrack_m;
  return made;
}

/// Two wheels with a lag, a gyro, and odometry with the turns of the gyro.
class FewLines {
 public:
  explicit FewLines(Wrong wrong, double yaw_rad = 0)
      : wrong_(std::move(wrong)),
        odom_T_base_(0, 0, yaw_rad),
        robot_([this](const auto& c, auto now) { return step(c, now); }) {}

  MotionTrace drive(const MotionOptions& options) {
    RobotLoop loop(robot_, commands, robot_.pacing());
    CommissionMotion motion(options, {});
    RobotListener listener;
    listener.on_sample = [&](const Sample& sample) {
      motion.receive(sample);
      return Status();
    };
    listener.decide = [&](Duration uptime, SensorTime now) { return motion.decide(uptime, now); };
    listener.should_stop = [&] { return stop_after && decisions_++ >= *stop_after; };
    const auto end = loop.drive(listener);
    EXPECT_TRUE(end) << to_string(end.error());
    interrupted = end && end->interrupted;
    return motion.trace();
  }
  MotionTrace forward() { return drive({.command = {.speed_m_s = 0.1}}); }
  MotionTrace turn() { return drive({.command = {.yaw_rate_rad_s = 0.4}, .most_s = 8, .way = M_PI / 2}); }

  std::optional<int> stop_after{};
  bool interrupted = false;

  /// The commands received by the robot.
  class Commands final : public Robot {
   public:
    explicit Commands(Robot& robot) : robot_(robot) {}
    Status command(const VelocityCommand& command) override {
      last = command;
      moved = moved || !(command == VelocityCommand{});
      return robot_.command(command);
    }
    VelocityCommand last{.speed_m_s = 1};
    bool moved = false;

   private:
    Robot& robot_;
  };

 private:
  Result<std::vector<Sample>> step(const VelocityCommand& command, SensorTime now) {
    constexpr double kStep_s = 0.05;
    const VelocityCommand asked = wrong_.obeys(command);
    const double share = 1 - std::exp(-kStep_s / wrong_.lag_s);
    speed_ += share * (asked.speed_m_s - speed_);
    turning_ += share * (asked.yaw_rate_rad_s - turning_);
    const double yaw_rate = wrong_.turns_by * turning_;
    odom_T_base_ = odom_T_base_ * SE2::exp({kStep_s * speed_, 0, kStep_s * yaw_rate});
    left_rad_ += kStep_s * (speed_ - turning_ * kTrack_m / 2) / kRadius_m;
    right_rad_ += kStep_s * (speed_ + turning_ * kTrack_m / 2) / kRadius_m;
    Odometry odometry{now, odom_T_base_, speed_, yaw_rate};
    WheelTicks wheels{now, left_rad_, right_rad_};
    ImuSample imu{now, {0, 0, yaw_rate + 0.01}, {0, 0, 9.81}};
    wrong_.odometry(odometry);
    wrong_.wheels(wheels);
    wrong_.imu(imu);
    if (wrong_.only_odometry) return std::vector<Sample>{odometry};
    return std::vector<Sample>{odometry, wheels, imu};
  }

  Wrong wrong_;
  SE2 odom_T_base_;
  double speed_ = 0;
  double turning_ = 0;
  double left_rad_ = 0;
  double right_rad_ = 0;
  int decisions_ = 0;
  StepRobot robot_;

 public:
  Commands commands{robot_};
};

/// The whole drive over the floor.
inline std::vector<CommissionLine> commissioned(const Wrong& wrong, double yaw_rad = 0) {
  FewLines robot(wrong, yaw_rad);
  const MotionTrace forward = robot.forward();
  const MotionTrace turn = robot.turn();
  const MotionTrace second = robot.forward();
  std::vector<CommissionLine> lines = judge_forward(forward, model(), Ground::Floor);
  const auto add = [&](const std::vector<CommissionLine>& more) {
    lines.insert(lines.end(), more.begin(), more.end());
  };
  add(judge_turn(turn, model(), Ground::Floor));
  add(judge_standing(standing_part(forward)));
  std::vector<OdometryLeg> legs;
  for (const MotionTrace* trace : {&forward, &second})
    if (const auto leg = odometry_leg(steady_part(*trace, 0.6))) legs.push_back(*leg);
  add(judge_axes(legs));
  add({judge_response(timing_of(forward)), judge_stop("stop.zero", timing_of(forward), 0)});
  return lines;
}

/// "key: words" of all lines that failed.
inline std::string failures(const std::vector<CommissionLine>& lines) {
  std::string all;
  for (const CommissionLine& line : lines) {
    if (line.verdict != CommissionVerdict::Fail) continue;
    all += line.key + ": " + line.message + "\n";
    EXPECT_FALSE(line.remedy.empty()) << line.key;
  }
  return all;
}

}  // namespace waymark::test
