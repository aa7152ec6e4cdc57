#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "waymark/runtime/operator_input.hpp"
#include "waymark/runtime/replay_session.hpp"

namespace waymark {

/// What an operator's session asks of whoever keeps recordings and maps. Nothing here waits but take_map()
/// before its map is there; an error ends the session unless said otherwise.
class OperatorTasks {
 public:
  virtual ~OperatorTasks() = default;
  OperatorTasks(const OperatorTasks&) = delete;
  OperatorTasks& operator=(const OperatorTasks&) = delete;

  /// Begins to record a lap.
  [[nodiscard]] virtual Status start_lap() = 0;
  /// A sample of the lap.
  [[nodiscard]] virtual Status add_to_lap(const Sample& sample) = 0;
  /// Closes the recording of the lap.
  [[nodiscard]] virtual Status end_lap() = 0;

  /// Begins to make a map of the lap that ended last, on a thread of its own: meanwhile the robot is sent
  /// zero twenty times a second.
  [[nodiscard]] virtual Status start_map() = 0;
  /// Whether the map was made, or cannot be.
  [[nodiscard]] virtual bool map_ended() const = 0;
  /// Puts the map in its place; waits for it. An error says why there is none, and the session goes on.
  [[nodiscard]] virtual Status take_map() = 0;
  /// Reads the map that replays are to use. An error as of take_map().
  [[nodiscard]] virtual Status load_map() = 0;

  /// Begins a replay in the map; the session stays valid until end_replay().
  [[nodiscard]] virtual Result<ReplaySession*> start_replay() = 0;
  /// Closes the recording of the replay.
  [[nodiscard]] virtual Status end_replay(const ReplayEnd& end) = 0;

  /// The state changed: what the operator may do now is in `session.prompt()`.
  virtual void on_state(const Operator& /*session*/, const OperatorButtons& /*buttons*/) {}
  /// Before each decision: for viewers.
  virtual void on_decision(const Operator& /*session*/, const OperatorInput& /*input*/) {}
  /// A sentence for the operator.
  virtual void on_words(const std::string& /*words*/) {}

 protected:
  OperatorTasks() = default;
};

/// Teach, map, replay, with one button: the table of `Operator` on the loop. The robot moves only while it is
/// taught or replays.
class OperatorSession {
 public:
  /// Input and tasks outlive the session. `has_map`: load_map() has succeeded already, and the session begins
  /// with ready. `stop_pressed`: a stop that is nobody's input, such as the space bar.
  OperatorSession(
      OperatorInput& input, OperatorTasks& tasks, bool has_map = false,
      std::function<bool()> stop_pressed = [] { return false; })
      : input_(input),
        tasks_(tasks),
        stop_pressed_(std::move(stop_pressed)),
        operator_({}, has_map ? OperatorState::Ready : OperatorState::Idle) {}

  /// Says how to begin.
  void begin() { tasks_.on_state(operator_, input_.buttons(operator_.state())); }
  Status receive(const Sample& sample);
  Result<DriverDecision> decide(Duration uptime, SensorTime now);
  /// This session as what drives a robot: add to it who may stop it.
  [[nodiscard]] RobotListener listener();
  /// Ends what has begun, however the drive ended: laps, replays, maps. `interrupted`: by a signal.
  Status finish(bool interrupted);

  [[nodiscard]] OperatorState state() const { return operator_.state(); }
  /// Of the last stop or failure.
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
  bool received_ = false;     ///< a sample of the robot since the last decision
  Duration last_received_{};  ///< uptime
  bool silence_reported_ = false;
  bool mapping_ = false;
  ReplaySession* replay_ = nullptr;
  int laps_taught_ = 0;
  bool map_failed_ = false;
};

}  // namespace waymark
