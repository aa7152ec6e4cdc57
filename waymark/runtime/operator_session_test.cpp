// Tests an operator's session from start to end, including tasks and inputs that fail.
#include "waymark/runtime/operator_session.hpp"

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/golden_page.hpp"
#include "tests/support/operator_drive.hpp"
#include "waymark/runtime/viewer_input.hpp"

namespace waymark {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using test::Drive;
using test::E;
using test::FakeTasks;
using test::kStates;
using test::name_of;
using test::operator+;
using test::Plan;
using test::PlannedInput;
using test::S;
using test::way_to;

TEST(OperatorSession, TeachesMapsReplaysPausesAndStops) {
  Drive run({{S::Idle, 0.5, E::Go},
             {S::Teaching, 1, E::Go},
             {S::Ready, 0.5, E::Go},
             {S::Replaying, 1.5, E::Go},
             {S::Paused, 3, E::Go},
             {S::Done, 0.5, E::Go},
             {S::Replaying, 1, E::StickMoved},
             {S::Stopped, 0.5, E::Go},
             {S::Replaying, 1, E::Stop},
             {S::Stopped, 0.5, E::Quit}});
  run.carried_back = true;
  const auto end = run.drive(60);
  ASSERT_TRUE(end && end->done) << (end ? "" : to_string(end.error()));
  ASSERT_TRUE(run.finished);
  EXPECT_TRUE(run.input.finished());
  EXPECT_EQ(run.tasks.states,
            (std::vector<std::string>{"idle", "teaching", "mapping", "ready", "replaying", "paused",
                                      "replaying", "done", "replaying", "stopped", "replaying", "stopped"}));
  EXPECT_EQ(run.session.state(), S::Over);
  EXPECT_EQ(run.session.laps_taught(), 1);
  EXPECT_FALSE(run.session.map_failed());
  run.expect_all_closed();
  ASSERT_EQ(run.tasks.replays.size(), 3U);
  EXPECT_TRUE(run.tasks.replays[0].finished);
  testing::expect_on_page("session", run.tasks.replays[1].reason);
  testing::expect_on_page("session", run.tasks.replays[2].reason);
  EXPECT_GT(run.robot.fastest_m_s, 0.1);
}

TEST(OperatorSession, RecordsTheLapAndTheGamepadOnlyWhileTeaching) {
  Drive run(way_to(S::Mapping) + PlannedInput::Step{S::Ready, 1, E::Quit});
  ASSERT_TRUE(run.drive());
  EXPECT_NEAR(run.tasks.pads, 20, 2) << "20 per second";
  EXPECT_NEAR(run.tasks.lap_samples, 4 * 20, 8) << "odometry, tags, commands, gamepad";
  EXPECT_EQ(run.tasks.decisions, static_cast<int>(to_seconds(run.robot.clock) * 20));
}

TEST(OperatorSession, ReportsASilentRobotOnceWhileTeaching) {
  Drive run({{S::Idle, 5, E::Go}, {S::Teaching, 1000, E::Quit}});
  const auto decide_for = [&](double from_s, double to_s, bool heard) {
    for (double t = from_s; t < to_s; t += 0.05) {
      const SensorTime now(Duration(static_cast<std::int64_t>(t * 1e9)));
      if (heard) {
        ASSERT_TRUE(run.session.receive(Odometry{.stamp = now}));
      }
      ASSERT_TRUE(run.session.receive(StampedCommand{.stamp = now}))
          << "commands are not samples of the robot";
      ASSERT_TRUE(run.session.receive(GamepadState{.stamp = now}));
      ASSERT_TRUE(run.session.decide(now.time_since_epoch(), now));
    }
  };
  decide_for(0, 4.9, false);
  EXPECT_TRUE(run.tasks.words.empty()) << "teaching has not begun";
  decide_for(4.9, 10, true);
  EXPECT_EQ(run.session.state(), S::Teaching);
  EXPECT_TRUE(run.tasks.words.empty());
  decide_for(10, 11.9, false);
  EXPECT_TRUE(run.tasks.words.empty());
  decide_for(11.9, 20, false);
  ASSERT_EQ(run.tasks.words.size(), 1U);
  testing::expect_on_page("session", run.tasks.words[0]);
  decide_for(20, 21, true);
  decide_for(21, 24, false);
  EXPECT_EQ(run.tasks.words.size(), 2U) << "reported again after another sample";
}

TEST(OperatorSession, DropsALapWithoutMappingIt) {
  Drive run(way_to(S::Teaching) + PlannedInput::Step{S::Teaching, 1, E::Stop} +
            PlannedInput::Step{S::Idle, 0.5, E::Quit});
  ASSERT_TRUE(run.drive());
  EXPECT_EQ(run.tasks.laps_ended, 1);
  EXPECT_EQ(run.tasks.maps_begun, 0);
  EXPECT_EQ(run.session.laps_taught(), 0);
  run.expect_all_closed();
}

TEST(OperatorSession, StartsWithAnExistingMap) {
  Drive run({{S::Ready, 0.5, E::Go}, {S::Done, 0.5, E::Quit}}, true);
  ASSERT_TRUE(run.drive());
  EXPECT_EQ(run.tasks.states, (std::vector<std::string>{"ready", "replaying", "done"}));
  EXPECT_EQ(run.tasks.maps_loaded, 0) << "already loaded";
}

TEST(OperatorSession, AnotherLapCanBeTaughtWithAMap) {
  Drive run({{S::Ready, 0.5, E::Teach}, {S::Teaching, 1, E::Go}, {S::Ready, 0.5, E::Quit}}, true);
  ASSERT_TRUE(run.drive());
  EXPECT_TRUE(run.input.finished());
  EXPECT_EQ(run.tasks.states, (std::vector<std::string>{"ready", "teaching", "mapping", "ready"}));
  EXPECT_EQ(run.session.laps_taught(), 1);
  EXPECT_EQ(run.tasks.maps_loaded, 1) << "the new map";
  run.expect_all_closed();
}

TEST(OperatorSession, StaysStoppedWhileMapping) {
  Drive run(way_to(S::Mapping) + PlannedInput::Step{S::Ready, 0.5, E::Quit});
  run.tasks.decisions_to_map = 200;  // decisions in ten seconds
  ASSERT_TRUE(run.drive());
  EXPECT_GT(to_seconds(run.robot.clock), 10);
  EXPECT_EQ(run.tasks.maps_loaded, 1);
  run.expect_all_closed();
}

TEST(OperatorSession, AFailedMapIsReportedAndAnotherLapCanBeTaught) {
  for (const char* task : {"take_map", "load_map"}) {
    Drive run(way_to(S::Mapping) + PlannedInput::Step{S::Idle, 0.5, E::Go} +
              PlannedInput::Step{S::Teaching, 0.5, E::Go} + PlannedInput::Step{S::Idle, 0.5, E::Quit});
    run.tasks.fails = task;
    ASSERT_TRUE(run.drive());
    EXPECT_TRUE(run.finished);
    EXPECT_TRUE(run.session.map_failed());
    EXPECT_EQ(run.session.laps_taught(), 2);
    EXPECT_NE(run.session.reason().find(std::string(task) + " failed"), std::string::npos)
        << run.session.reason();
    run.expect_all_closed();
  }
}

TEST(OperatorSession, WaitsForAnUnfinishedMapAtTheEnd) {
  Drive run(way_to(S::Mapping) + PlannedInput::Step{S::Mapping, 0.2, E::Quit});
  run.tasks.decisions_to_map = 1000;
  ASSERT_TRUE(run.drive());
  EXPECT_EQ(run.tasks.maps_taken, 1);
  Drive failed(way_to(S::Mapping) + PlannedInput::Step{S::Mapping, 0.2, E::Quit});
  failed.tasks.decisions_to_map = 1000;
  failed.tasks.fails = "take_map";
  ASSERT_TRUE(failed.drive());
  EXPECT_FALSE(failed.finished);
}

TEST(OperatorSession, AFailedTaskEndsTheSessionWithZero) {
  const std::map<std::string, S> where = {{"start_lap", S::Idle},     {"add_to_lap", S::Teaching},
                                          {"end_lap", S::Teaching},   {"start_map", S::Teaching},
                                          {"start_replay", S::Ready}, {"end_replay", S::Paused}};
  for (const auto& [task, state] : where) {
    Drive run(way_to(S::Paused) + PlannedInput::Step{S::Paused, 0.5, E::Stop});
    run.tasks.fails = task;
    const auto end = run.drive();
    ASSERT_FALSE(end) << task;
    EXPECT_EQ(end.error().message, task + " failed");
    EXPECT_EQ(run.robot.last(), VelocityCommand{}) << task;
    EXPECT_EQ(run.tasks.laps_ended, run.tasks.laps_begun - (task == "start_lap" ? 1 : 0)) << task;
  }
}

TEST(OperatorSession, AFailedCameraEndsTheReplayButNotTheSession) {
  Drive run(way_to(S::Replaying) + PlannedInput::Step{S::Stopped, 0.5, E::Go} +
            PlannedInput::Step{S::Done, 0.5, E::Quit});
  run.carried_back = true;
  run.robot.camera_silent = {seconds(4), seconds(7)};
  ASSERT_TRUE(run.drive(40));
  ASSERT_EQ(run.tasks.replays.size(), 2U);
  EXPECT_TRUE(run.tasks.replays[0].given_up);
  EXPECT_FALSE(run.tasks.replays[0].reason.empty());
  EXPECT_TRUE(run.tasks.replays[1].finished) << run.tasks.replays[1].reason;
  run.expect_all_closed();
}

TEST(OperatorSession, ReportsButtonsWithoutEffectButNotSticks) {
  Drive run(Plan{{S::Idle, 0.5, E::Stop}, {S::Idle, 0.6, E::StickMoved}, {S::Idle, 0.7, E::Quit}});
  ASSERT_TRUE(run.drive());
  ASSERT_EQ(run.tasks.words.size(), 1U);
  testing::expect_on_page("session", run.tasks.words.front());
}

// Tests every way out of each state of an operator's session, and each fault in each state.

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
  EXPECT_NEAR(run.robot.x_m(), x_m, 0.03) << "the robot stops immediately";
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
    testing::expect_on_page("session", run.tasks.replays.back().reason);
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
    testing::expect_on_page("session", run.tasks.replays.back().reason);
  }
  run.expect_all_closed();
}

TEST_P(InEachState, AFailedRobotEndsTheSessionAndClosesEverything) {
  Drive run(way_to(GetParam()));
  run.tasks.decisions_to_map = GetParam() == S::Mapping ? 1000 : 10;
  run.dies_in = GetParam();
  const auto end = run.drive();
  ASSERT_FALSE(end);
  EXPECT_EQ(end.error().message, "the robot's process ended");
  EXPECT_TRUE(run.finished);
  run.expect_all_closed();
}

TEST_P(InEachState, AFailedInputEndsTheSession) {
  Drive run(way_to(GetParam()));
  run.tasks.decisions_to_map = GetParam() == S::Mapping ? 1000 : 10;
  run.input.fails_in = GetParam();
  const auto end = run.drive();
  ASSERT_FALSE(end);
  EXPECT_EQ(end.error().message, "the gamepad was unplugged");
  run.expect_all_closed();
}

TEST_P(InEachState, AGivenPosePausesAReplayAndHasNoOtherEffect) {
  Drive run(way_to(GetParam()));
  run.input.pose_in = GetParam();
  ASSERT_TRUE(run.drive(15));
  ASSERT_FALSE(run.tasks.words.empty());
  testing::expect_on_page("session", run.tasks.words[0]);
  if (GetParam() == S::Replaying) {
    EXPECT_LT(run.robot.x_m(), 0.5) << "it was stopped while driving";
  }
}

TEST_P(InEachState, ALostViewerCausesNoMotion) {
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
      orders.push_back({.kind = ViewerOrder::Kind::Go});  // sent by the viewer that has left
      lost = uptime;
      lost_at_m = robot.x_m();
    }
    return inner(uptime, now);
  };
  RobotLoop loop(robot, robot, robot.pacing(), {}, {.timeout_s = 12});
  ASSERT_TRUE(loop.drive(listener));
  ASSERT_TRUE(lost);
  // In this test plan the stick at the robot is used, so a person is present and teaching continues.
  if (GetParam() != S::Teaching) {
    EXPECT_NEAR(robot.x_m(), lost_at_m, 0.1);
  }
  EXPECT_EQ(session.state(), GetParam() == S::Replaying ? S::Paused : GetParam());
  (void)session.finish(false);
}

TEST(OperatorSession, TheRobotStopsIfTheTeachingViewerIsLost) {
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
