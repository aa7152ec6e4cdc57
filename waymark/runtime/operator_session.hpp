#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "waymark/runtime/operator_input.hpp"
#include "waymark/runtime/replay_session.hpp"

namespace waymark {

/// The tasks of an operator's session that involve recordings and maps. Only take_map() blocks, until the map
/// is complete. An error ends the session unless stated otherwise.
class OperatorTasks {
 public:
  virtual ~OperatorTasks() = default;
  OperatorTasks(const OperatorTasks&) = delete;
  OperatorTasks& operator=(const OperatorTasks&) = delete;

  /// Starts recording a lap.
  [[nodiscard]] virtual Status start_lap() = 0;
  /// Adds a sample to the lap.
  [[nodiscard]] virtual Status add_to_lap(const Sample& sample) = 0;
  /// Closes the lap's recording.
  [[nodiscard]] virtual Status end_lap() = 0;

  /// Starts mapping the last lap on another thread. During mapping, the session sends zero to the robot 20
  /// times per second.
  [[nodiscard]] virtual Status start_map() = 0;
  /// Whether mapping has ended, either with or without a map.
  [[nodiscard]] virtual bool map_ended() const = 0;
  /// Installs the map; blocks until it is complete. An error explains why mapping failed; it does not end the
  /// session.
  [[nodiscard]] virtual Status take_map() = 0;
  /// Reads the map for replays. An error does not end the session.
  [[nodiscard]] virtual Status load_map() = 0;

  /// Starts a replay in the map; the returned session remains valid until end_replay().
  [[nodiscard]] virtual Result<ReplaySession*> start_replay() = 0;
  /// Closes the replay's recording.
  [[nodiscard]] virtual Status end_replay(const ReplayEnd& end) = 0;

  /// Called when the state changes; `session.prompt()` describes what the operator can do.
  virtual void on_state(const Operator& /*session*/, const OperatorButtons& /*buttons*/) {}
  /// Called before each decision, to inform viewers.
  virtual void on_decision(const Operator& /*session*/, const OperatorInput& /*input*/) {}
  /// Called with a message for the operator.
  virtual void on_message(const std::string& /*message*/) {}

 protected:
  OperatorTasks() = default;
};

/// Teaches, maps and replays with one button, by running the state table of `Operator` in the robot loop. The
/// robot moves only during teaching and replay.
class OperatorSession {
 public:
  /// The input and the tasks must outlive the session. If `has_map` is true, load_map() has already
  /// succeeded, and the session starts in the state ready. `stop_pressed` reports a stop that does not depend
  /// on the input, such as the space bar.
  OperatorSession(
      OperatorInput& input, OperatorTasks& tasks, bool has_map = false,
      std::function<bool()> stop_pressed = [] { return false; })
      : input_(input),
        tasks_(tasks),
        stop_pressed_(std::move(stop_pressed)),
        operator_({}, has_map ? OperatorState::Ready : OperatorState::Idle) {}

  /// Reports the initial state and its prompt.
  void begin() { tasks_.on_state(operator_, input_.buttons(operator_.state())); }
  Status receive(const Sample& sample);
  Result<DriverDecision> decide(Duration uptime, SensorTime now);
  /// Callbacks that let this session drive a robot; set should_stop to end the session from outside.
  [[nodiscard]] RobotListener listener();
  /// Call after the drive has ended. Ends any lap, replay or mapping still in progress. `interrupted` is true
  /// if a signal ended the drive.
  Status finish(bool interrupted);

  [[nodiscard]] OperatorState state() const { return operator_.state(); }
  /// The reason for the last stop or failure.
  [[nodiscard]] const std::string& reason() const { return operator_.reason(); }
  [[nodiscard]] int laps_taught() const { return laps_taught_; }
  /// Whether the last lap could not be mapped.
  [[nodiscard]] bool map_failed() const { return map_failed_; }

 private:
  void restart_from(const GivenPose& given);
  void notice_silence(Duration uptime);
  Status handle(OperatorEvent event, Duration uptime, std::string reason = {});
  Status act(OperatorAction action);
  Status start_lap();
  Status end_lap();
  Status map_lap();
  Status take_finished_map(Duration uptime);
  Status start_replay();
  Status end_replay(bool interrupted);
  Result<VelocityCommand> replay(Duration uptime, SensorTime now);

  OperatorInput& input_;
  OperatorTasks& tasks_;
  std::function<bool()> stop_pressed_;
  Operator operator_;
  bool lap_open_ = false;
  bool received_ = false;     ///< whether a sample from the robot has been received since the last decision
  Duration last_received_{};  ///< uptime at the last sample from the robot
  bool silence_reported_ = false;
  bool mapping_ = false;
  ReplaySession* replay_ = nullptr;
  int laps_taught_ = 0;
  bool map_failed_ = false;
};

}  // namespace waymark
