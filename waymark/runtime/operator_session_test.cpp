// An operator's session on the loop, with a robot that is a few lines, tasks that only count, and buttons
// that are a script: each state left by each way out of it, and each fault in each state.
#include "waymark/runtime/operator_session.hpp"

#include <algorithm>
#include <map>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/tiny_robot.hpp"
#include "waymark/runtime/viewer_input.hpp"

namespace waymark {
namespace {

using E = OperatorEvent;
using S = OperatorState;
using std::chrono::milliseconds;
using std::chrono::seconds;

/// Recordings and maps that are numbers.
class FakeTasks final : public OperatorTasks {
 public:
  Status start_lap() override {
    ++laps_begun;
    return refuse("start_lap");
  }
  Status add_to_lap(const Sample& sample) override {
    ++lap_samples;
    pads += std::holds_alternative<GamepadState>(sample) ? 1 : 0;
    return refuse("add_to_lap");
  }
  Status end_lap() override {
    ++laps_ended;
    return refuse("end_lap");
  }
  Status start_map() override {
    ++maps_begun;
    asked_for_map_ = 0;
    return refuse("start_map");
  }
  bool map_ended() const override { return ++asked_for_map_ > decisions_to_map; }
  Status take_map() override {
    ++maps_taken;
    return refuse("take_map");
  }
  Status load_map() override {
    ++maps_loaded;
    return refuse("load_map");
  }
  Result<ReplaySession*> start_replay() override {
    if (Status status = refuse("start_replay"); !status) return tl::unexpected(status.error());
    replayer_ = std::make_unique<Replayer>(test::tiny_replayer());
    session_ =
        std::make_unique<ReplaySession>(*replayer_, ReplayListener{}, ReplaySessionOptions{.give_up_s = 1.5});
    ++replays_begun;
    return session_.get();
  }
  Status end_replay(const ReplayEnd& end) override {
    replays.push_back(end);
    session_.reset();
    return refuse("end_replay");
  }
  void on_state(const Operator& session, const OperatorButtons& /*buttons*/) override {
    states.emplace_back(to_string(session.state()));
  }
  void on_decision(const Operator& /*session*/, const OperatorInput& /*input*/) override { ++decisions; }
  void on_words(const std::string& sentence) override { words.push_back(sentence); }

  std::string fails{};  ///< the task that fails
  int decisions_to_map = 10;
  int laps_begun = 0, laps_ended = 0, lap_samples = 0, pads = 0, decisions = 0;
  int maps_begun = 0, maps_taken = 0, maps_loaded = 0, replays_begun = 0;
  std::vector<ReplayEnd> replays{};
  std::vector<std::string> states{};
  std::vector<std::string> words{};

 private:
  [[nodiscard]] Status refuse(const std::string& task) const {
    return task == fails ? Status(fail(ErrorCode::Unwritable, task + " failed")) : Status();
  }
  mutable int asked_for_map_ = 0;
  std::unique_ptr<Replayer> replayer_{};
  std::unique_ptr<ReplaySession> session_{};
};

/// Presses what the plan says, each after some time in a state; holds a stick all the time, and a pad.
class PlannedInput final : public OperatorInput {
 public:
  struct Step {
    S state;
    double after_s;
    E event;
  };
  explicit PlannedInput(std::vector<Step> plan) : plan_(std::move(plan)) {}

  Result<OperatorRequest> read(Duration uptime, SensorTime now, S state) override {
    if (state != last_) since_ = uptime;
    last_ = state;
    OperatorRequest request{.command = {0.2, 0}, .pad = GamepadState{.stamp = now}};
    if (pose_in == state) request.pose = GivenPose{};
    if (fails_in == state) return fail(ErrorCode::Unreadable, "the gamepad was unplugged");
    if (next_ < plan_.size() && plan_[next_].state == state &&
        to_seconds(uptime - since_) >= plan_[next_].after_s)
      request.events.push_back(plan_[next_++].event);
    return request;
  }
  std::string usage() const override { return "a plan"; }
  [[nodiscard]] bool finished() const { return next_ == plan_.size(); }

  std::optional<S> fails_in{};
  std::optional<S> pose_in{};  ///< somebody says where the robot is, all the time

 private:
  std::vector<Step> plan_;
  std::size_t next_ = 0;
  S last_ = S::Over;
  Duration since_{};
};

using Plan = std::vector<PlannedInput::Step>;

/// What leads to a state, from the beginning.
Plan way_to(S state) {
  const Plan way = {
      {S::Idle, 0.5, E::Go}, {S::Teaching, 1, E::Go}, {S::Ready, 0.5, E::Go}, {S::Replaying, 1.5, E::Go}};
  const std::map<S, std::size_t> steps = {{S::Idle, 0},      {S::Teaching, 1}, {S::Mapping, 2}, {S::Ready, 2},
                                          {S::Replaying, 3}, {S::Paused, 4},   {S::Done, 3}};
  if (state == S::Stopped) {
    Plan stopped = way_to(S::Replaying);
    stopped.push_back({S::Replaying, 1, E::Stop});
    return stopped;
  }
  return {way.begin(), way.begin() + static_cast<std::ptrdiff_t>(steps.at(state))};
}

Plan operator+(Plan plan, const PlannedInput::Step& step) {
  plan.push_back(step);
  return plan;
}

const std::vector<S> kStates = {S::Idle,      S::Teaching, S::Mapping, S::Ready,
                                S::Replaying, S::Paused,   S::Done,    S::Stopped};

std::string name_of(const testing::TestParamInfo<S>& info) { return std::string(to_string(info.param)); }

/// A session on the loop.
struct Drive {
  explicit Drive(Plan plan, bool has_map = false)
      : input(std::move(plan)),
        session(input, tasks, has_map, [this] { return stop_pressed && stop_pressed(); }) {}

  Result<RobotLoopEnd> drive(double timeout_s = 20) {
    RobotLoop loop(robot, robot, robot.pacing(), {}, {.timeout_s = timeout_s});
    RobotListener listener = session.listener();
    listener.decide = [this, inner = listener.decide](Duration uptime, SensorTime now) {
      auto decision = inner(uptime, now);
      const S state = session.state();
      if (carried_back && (state == S::Done || state == S::Stopped)) robot.place({});
      if (decision && state != S::Teaching && state != S::Replaying)
        fastest_elsewhere_m_s = std::max(fastest_elsewhere_m_s, std::abs(decision->command.speed_m_s));
      if (state != last) since = uptime;
      last = state;
      if (dies_in == state && uptime - since > milliseconds(200)) robot.dies_after = robot.clock;
      return decision;
    };
    listener.should_stop = [this] { return interrupt && interrupt(); };
    session.begin();
    auto end = loop.drive(listener);
    finished = session.finish(end && end->interrupted);
    return end;
  }
  void expect_all_closed() const {
    EXPECT_EQ(tasks.laps_ended, tasks.laps_begun);
    EXPECT_EQ(tasks.maps_taken, tasks.maps_begun);
    EXPECT_EQ(static_cast<int>(tasks.replays.size()), tasks.replays_begun);
    EXPECT_EQ(robot.last(), VelocityCommand{});
    EXPECT_EQ(fastest_elsewhere_m_s, 0) << "it moves while it is taught or replays, and never else";
  }

  test::TinyRobot robot{};
  FakeTasks tasks{};
  PlannedInput input;
  std::function<bool()> stop_pressed{};
  std::function<bool()> interrupt{};
  std::optional<S> dies_in{};
  bool carried_back = false;  ///< to the begin of the route, after each replay
  S last = S::Idle;
  Duration since{};
  double fastest_elsewhere_m_s = 0;
  Status finished{};
  OperatorSession session;
};

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
  EXPECT_EQ(run.tasks.replays[1].reason, "stopped: a stick was moved");
  EXPECT_EQ(run.tasks.replays[2].reason, "stopped by the operator");
  EXPECT_GT(run.robot.fastest_m_s, 0.1);
}

TEST(OperatorSession, RecordsTheLapAndWhatIsHeldInHandWhileItIsTaughtAndOnlyThen) {
  Drive run(way_to(S::Mapping) + PlannedInput::Step{S::Ready, 1, E::Quit});
  ASSERT_TRUE(run.drive());
  EXPECT_NEAR(run.tasks.pads, 20, 2) << "a second, twenty times a second";
  EXPECT_NEAR(run.tasks.lap_samples, 4 * 20, 8) << "odometry, tags, commands, the pad";
  EXPECT_EQ(run.tasks.decisions, static_cast<int>(to_seconds(run.robot.clock) * 20));
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

TEST(OperatorSession, BeginsWithAMapThatIsThere) {
  Drive run({{S::Ready, 0.5, E::Go}, {S::Done, 0.5, E::Quit}}, true);
  ASSERT_TRUE(run.drive());
  EXPECT_EQ(run.tasks.states, (std::vector<std::string>{"ready", "replaying", "done"}));
  EXPECT_EQ(run.tasks.maps_loaded, 0) << "it is loaded";
}

TEST(OperatorSession, StandsForAsLongAsAMapTakes) {
  Drive run(way_to(S::Mapping) + PlannedInput::Step{S::Ready, 0.5, E::Quit});
  run.tasks.decisions_to_map = 200;  // ten seconds
  ASSERT_TRUE(run.drive());
  EXPECT_GT(to_seconds(run.robot.clock), 10);
  EXPECT_EQ(run.tasks.maps_loaded, 1);
  run.expect_all_closed();
}

TEST(OperatorSession, AMapThatFailsIsSaidAndAnotherLapMayBeTaught) {
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

TEST(OperatorSession, AnUnfinishedMapIsWaitedForWhenTheSessionEnds) {
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

TEST(OperatorSession, ATaskThatFailsEndsTheSessionWithZero) {
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

TEST(OperatorSession, ACameraThatStopsEndsTheReplayAndNotTheSession) {
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

TEST(OperatorSession, SaysWhyAButtonDoesNothingButNotOfSticks) {
  Drive run(Plan{{S::Idle, 0.5, E::Stop}, {S::Idle, 0.6, E::StickMoved}, {S::Idle, 0.7, E::Quit}});
  ASSERT_TRUE(run.drive());
  EXPECT_EQ(run.tasks.words, std::vector<std::string>{"the robot stands already"});
}

class InEachState : public testing::TestWithParam<S> {};
INSTANTIATE_TEST_SUITE_P(OperatorSession, InEachState, testing::ValuesIn(kStates), name_of);

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
  EXPECT_EQ(run.tasks.words.empty(), replays);
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
