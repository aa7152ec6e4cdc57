// Each state of an operator's session left by each way out of it, and each fault in each state.
#include <memory>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/operator_drive.hpp"
#include "waymark/runtime/viewer_input.hpp"

namespace waymark {
namespace {

using test::Drive;
using test::E;
using test::FakeTasks;
using test::PlannedInput;
using test::S;
using test::operator+;
using std::chrono::milliseconds;
using std::chrono::seconds;
using test::kStates;
using test::name_of;
using test::way_to;

class InEachState : public ::testing::TestWithParam<S> {};
INSTANTIATE_TEST_SUITE_P(OperatorSession, InEachState, ::testing::ValuesIn(kStates), name_of);

TEST_P(InEachState, TheStopKeyStops) {
  Drive run(way_to(GetParam()));
  bool pressed = false;
  run.stop_pressed = [&] {
    if (pressed || run.session.state() != GetParam() || run.robot.clock - run.since < milliseconds(300))
      return false;
    return pressed = true;
  };
  run.tasks.decisions_to_map = GetParam() == S::Mapping ? 1000 : 10;
  double x_m = 0;
  run.interrupt = [&] {
    if (!pressed) x_m = run.robot.x_m();
    return false;
  };
  ASSERT_TRUE(run.drive(15));
  ASSERT_TRUE(pressed);
  const std::map<S, S> after = {{S::Idle, S::Idle},   {S::Teaching, S::Idle},     {S::Mapping, S::Mapping},
                                {S::Ready, S::Ready}, {S::Replaying, S::Stopped}, {S::Paused, S::Stopped},
                                {S::Done, S::Done},   {S::Stopped, S::Stopped}};
  EXPECT_EQ(run.session.state(), after.at(GetParam()));
  EXPECT_NEAR(run.robot.x_m(), x_m, 0.03) << "and the robot stands at once";
  run.expect_all_closed();
}

TEST_P(InEachState, QuitEndsTheSession) {
  Drive run(way_to(GetParam()) + PlannedInput::Step{GetParam(), 0.3, E::Quit});
  const auto end = run.drive();
  ASSERT_TRUE(end);
  EXPECT_TRUE(end->done);
  EXPECT_TRUE(run.finished);
  EXPECT_EQ(run.session.state(), S::Over);
  if (GetParam() == S::Replaying) {
    EXPECT_EQ(run.tasks.replays.back().reason, "the session was ended");
  }
  run.expect_all_closed();
}

TEST_P(InEachState, ASignalEndsTheSession) {
  Drive run(way_to(GetParam()));
  run.tasks.decisions_to_map = GetParam() == S::Mapping ? 1000 : 10;
  run.interrupt = [&] {
    return run.session.state() == GetParam() && run.last == GetParam() &&
           run.robot.clock - run.since > milliseconds(300);
  };
  const auto end = run.drive();
  ASSERT_TRUE(end);
  EXPECT_TRUE(end->interrupted);
  EXPECT_TRUE(run.finished);
  if (GetParam() == S::Replaying || GetParam() == S::Paused) {
    EXPECT_TRUE(run.tasks.replays.back().interrupted);
    EXPECT_EQ(run.tasks.replays.back().reason, "stopped by a signal");
  }
  run.expect_all_closed();
}

TEST_P(InEachState, ARobotThatDiesEndsTheSessionAndEverythingIsClosed) {
  Drive run(way_to(GetParam()));
  run.tasks.decisions_to_map = GetParam() == S::Mapping ? 1000 : 10;
  run.dies_in = GetParam();
  const auto end = run.drive();
  ASSERT_FALSE(end);
  EXPECT_EQ(end.error().message, "the robot's process ended");
  EXPECT_TRUE(run.finished);
  run.expect_all_closed();
}

TEST_P(InEachState, AnInputThatFailsEndsTheSession) {
  Drive run(way_to(GetParam()));
  run.tasks.decisions_to_map = GetParam() == S::Mapping ? 1000 : 10;
  run.input.fails_in = GetParam();
  const auto end = run.drive();
  ASSERT_FALSE(end);
  EXPECT_EQ(end.error().message, "the gamepad was unplugged");
  run.expect_all_closed();
}

TEST_P(InEachState, AGivenPoseStopsAReplayAndHasNoOtherEffect) {
  Drive run(way_to(GetParam()));
  run.input.pose_in = GetParam();
  const bool replays = GetParam() == S::Replaying || GetParam() == S::Paused;
  ASSERT_TRUE(run.drive(15));
  ASSERT_FALSE(run.tasks.words.empty());
  EXPECT_EQ(run.tasks.words[0].find("no effect") == std::string::npos, replays) << run.tasks.words[0];
  if (GetParam() == S::Replaying) {
    EXPECT_LT(run.robot.x_m(), 0.5) << "it was on its way";
  }
}

TEST_P(InEachState, ALostViewerMovesNothing) {
  test::TinyRobot robot;
  FakeTasks tasks;
  ViewerControl control = ViewerControl::Held;
  std::vector<ViewerOrder> orders;
  ViewerInput input(
      {.take_orders = [&] { return std::exchange(orders, {}); }, .control = [&] { return control; }},
      std::make_unique<PlannedInput>(way_to(GetParam())), [] { return std::unique_ptr<LapDriver>(); });
  OperatorSession session(input, tasks);
  tasks.decisions_to_map = GetParam() == S::Mapping ? 1000 : 10;
  std::optional<Duration> lost;
  std::optional<Duration> reached;
  double lost_at_m = 0;
  RobotListener listener = session.listener();
  listener.decide = [&, inner = listener.decide](Duration uptime, SensorTime now) {
    if (session.state() == GetParam() && !reached) reached = uptime;
    if (reached && !lost && uptime - *reached > milliseconds(500)) {
      control = ViewerControl::Lost;
      orders.push_back({.kind = ViewerOrder::Kind::Go});  // whoever pressed it has gone
      lost = uptime;
      lost_at_m = robot.x_m();
    }
    return inner(uptime, now);
  };
  RobotLoop loop(robot, robot, robot.pacing(), {}, {.timeout_s = 12});
  ASSERT_TRUE(loop.drive(listener));
  ASSERT_TRUE(lost);
  // The plan's stick is at the robot, so teaching goes on with it: somebody is there.
  if (GetParam() != S::Teaching) {
    EXPECT_NEAR(robot.x_m(), lost_at_m, 0.1);
  }
  EXPECT_EQ(session.state(), GetParam() == S::Replaying ? S::Paused : GetParam());
  (void)session.finish(false);
}

TEST(OperatorSession, ALostViewerWhoTaughtLeavesTheRobotStanding) {
  test::TinyRobot robot;
  FakeTasks tasks;
  ViewerControl control = ViewerControl::Held;
  std::vector<ViewerOrder> orders = {{.kind = ViewerOrder::Kind::Go}};
  ViewerInput input(
      {.take_orders = [&] { return std::exchange(orders, {}); }, .control = [&] { return control; }}, nullptr,
      [] { return std::unique_ptr<LapDriver>(); });
  OperatorSession session(input, tasks);
  double lost_at_m = 0;
  RobotListener listener = session.listener();
  listener.decide = [&, inner = listener.decide](Duration uptime, SensorTime now) {
    if (uptime < seconds(3)) orders.push_back({.kind = ViewerOrder::Kind::Velocity, .command = {0.3, 0}});
    if (uptime >= seconds(2) && control == ViewerControl::Held) {
      control = ViewerControl::Lost;
      lost_at_m = robot.x_m();
    }
    return inner(uptime, now);
  };
  RobotLoop loop(robot, robot, robot.pacing(), {}, {.timeout_s = 5});
  ASSERT_TRUE(loop.drive(listener));
  EXPECT_EQ(session.state(), S::Teaching);
  EXPECT_GT(lost_at_m, 0.4);
  EXPECT_NEAR(robot.x_m(), lost_at_m, 1e-9);
  ASSERT_TRUE(session.finish(true));
  EXPECT_EQ(tasks.laps_ended, 1);
}

}  // namespace
}  // namespace waymark
