#include "waymark/runtime/step_robot.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/tiny_robot.hpp"
#include "waymark/runtime/replay_session.hpp"

namespace waymark {
namespace {

using ::testing::ElementsAre;

/// Kinematics on the floor, with odometry and one tag at the end of each period.
class Kinematics {
 public:
  Result<std::vector<Sample>> operator()(const VelocityCommand& command, SensorTime now) {
    commands.push_back(command.speed_m_s);
    const double dt_s = to_seconds(now - last_);
    last_ = now;
    map_T_base = map_T_base * SE2::exp({dt_s * command.speed_m_s, 0, dt_s * command.yaw_rate_rad_s});
    TagFrame frame{.stamp = now, .detections = std::vector<TagDetection>(2)};
    frame.detections[0].corners_px[0].x() = to_seconds(now.time_since_epoch());
    return std::vector<Sample>{Odometry{now, map_T_base, command.speed_m_s, command.yaw_rate_rad_s}, frame};
  }
  SE2 map_T_base{};
  std::vector<double> commands{};

 private:
  SensorTime last_{};
};

TEST(StepRobot, AReplayOfAStraightRouteEndsAtItsGoal) {
  Kinematics kinematics;
  StepRobot robot([&](const VelocityCommand& command, SensorTime now) { return kinematics(command, now); });
  Replayer replayer = test::tiny_replayer();
  ReplaySession session(replayer, {});
  const auto driven = RobotLoop(robot, robot, robot.pacing()).drive(session.listener());
  ASSERT_TRUE(driven) << to_string(driven.error());
  const ReplayEnd end = session.end(*driven);
  EXPECT_TRUE(end.finished) << end.reason;
  EXPECT_NEAR(kinematics.map_T_base.x(), 2, 0.1);
  EXPECT_EQ(kinematics.commands.front(), 0) << "zero before the first command";
}

TEST(StepRobot, ExecutesEachCommandForOnePeriod) {
  Kinematics kinematics;
  StepRobot robot([&](const VelocityCommand& command, SensorTime now) { return kinematics(command, now); },
                  std::chrono::milliseconds(100));
  RobotListener listener;
  double asked_m_s = 0;
  listener.decide = [&](Duration, SensorTime) -> Result<DriverDecision> {
    asked_m_s += 0.1;
    return DriverDecision{.command = {asked_m_s, 0}, .done = asked_m_s > 0.35};
  };
  const auto driven = RobotLoop(robot, robot, robot.pacing()).drive(listener);
  ASSERT_TRUE(driven);
  EXPECT_THAT(kinematics.commands, ElementsAre(0, 0.1, ::testing::DoubleEq(0.2), ::testing::DoubleEq(0.3), 0))
      << "zero is sent at the end";
  EXPECT_NEAR(kinematics.map_T_base.x(), 0.06, 1e-12);
  EXPECT_NEAR(to_seconds(driven->uptime), 0.4, 1e-9);
}

TEST(StepRobot, TheLastCommandIsZeroForEveryEnd) {
  enum class Ending { Finished, Interrupted, TimedOut, FunctionFails, DecisionFails };
  for (const Ending ending : {Ending::Finished, Ending::Interrupted, Ending::TimedOut, Ending::FunctionFails,
                              Ending::DecisionFails}) {
    std::vector<double> commands;
    StepRobot robot([&](const VelocityCommand& command, SensorTime) -> Result<std::vector<Sample>> {
      commands.push_back(command.speed_m_s);
      if (commands.size() == 4 && ending == Ending::FunctionFails)
        return fail(ErrorCode::Unreadable, "the wheels do not answer");
      return std::vector<Sample>{};
    });
    RobotListener listener;
    listener.should_stop = [&] { return commands.size() == 4 && ending == Ending::Interrupted; };
    listener.decide = [&](Duration, SensorTime) -> Result<DriverDecision> {
      if (commands.size() == 4 && ending == Ending::DecisionFails)
        return fail(ErrorCode::InvalidArgument, "no decision");
      return DriverDecision{.command = {commands.size() == 4 ? 0 : 0.2, 0},
                            .done = commands.size() == 4 && ending == Ending::Finished};
    };
    const double timeout_s = ending == Ending::TimedOut ? 0.2 : 60;
    (void)RobotLoop(robot, robot, robot.pacing(), {}, {.timeout_s = timeout_s}).drive(listener);
    EXPECT_THAT(commands, ElementsAre(0, 0.2, 0.2, 0.2, 0)) << static_cast<int>(ending);
  }
}

TEST(StepRobot, AnErrorOfTheFunctionEndsTheDrive) {
  int calls = 0;
  StepRobot robot([&](const VelocityCommand&, SensorTime) -> Result<std::vector<Sample>> {
    if (++calls == 3) return fail(ErrorCode::Unreadable, "the wheels do not answer");
    return std::vector<Sample>{};
  });
  RobotListener listener;
  listener.decide = [](Duration, SensorTime) -> Result<DriverDecision> { return DriverDecision{}; };
  const auto driven = RobotLoop(robot, robot, robot.pacing()).drive(listener);
  ASSERT_FALSE(driven);
  EXPECT_EQ(driven.error().message, "the wheels do not answer");
  EXPECT_EQ(calls, 3);
}

}  // namespace
}  // namespace waymark
