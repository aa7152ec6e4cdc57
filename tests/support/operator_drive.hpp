#pragma once

#include <algorithm>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/tiny_robot.hpp"
#include "waymark/runtime/operator_session.hpp"

/// An operator's session on the loop, with a simulated robot, counting tasks and scripted buttons.
namespace waymark::test {

using E = OperatorEvent;
using S = OperatorState;

/// Tasks that count recordings and maps.
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
    replayer_ = std::make_unique<Replayer>(tiny_replayer());
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
  void on_message(const std::string& sentence) override { words.push_back(sentence); }

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

/// Presses buttons by a plan, each after some time in a state; holds a stick and a gamepad all the time.
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
  std::optional<S> pose_in{};  ///< a pose is given all the time in this state

 private:
  std::vector<Step> plan_;
  std::size_t next_ = 0;
  S last_ = S::Over;
  Duration since_{};
};

using Plan = std::vector<PlannedInput::Step>;

/// The plan from the start to a state.
inline Plan way_to(S state) {
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

inline Plan operator+(Plan plan, const PlannedInput::Step& step) {
  plan.push_back(step);
  return plan;
}

inline const std::vector<S> kStates = {S::Idle,      S::Teaching, S::Mapping, S::Ready,
                                       S::Replaying, S::Paused,   S::Done,    S::Stopped};

inline std::string name_of(const ::testing::TestParamInfo<S>& info) {
  return std::string(to_string(info.param));
}

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
      if (dies_in == state && uptime - since > std::chrono::milliseconds(200)) robot.dies_after = robot.clock;
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
    EXPECT_EQ(fastest_elsewhere_m_s, 0) << "it moves only while teaching or replaying";
  }

  TinyRobot robot{};
  FakeTasks tasks{};
  PlannedInput input;
  std::function<bool()> stop_pressed{};
  std::function<bool()> interrupt{};
  std::optional<S> dies_in{};
  bool carried_back = false;  ///< to the start of the route, after each replay
  S last = S::Idle;
  Duration since{};
  double fastest_elsewhere_m_s = 0;
  Status finished{};
  OperatorSession session;
};

}  // namespace waymark::test
