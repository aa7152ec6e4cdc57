#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "waymark/base/error.hpp"
#include "waymark/base/time.hpp"
#include "waymark/samples/robot_samples.hpp"

namespace waymark {

/// State of the operator's session (Martins and Ramos, "AprilTag-based Trajectory Tracking for the LIMOS
/// Robot": a person teaches with a gamepad, presses a button, and the robot repeats).
enum class OperatorState : std::uint8_t {
  Idle,      ///< no map yet
  Teaching,  ///< a person drives, and the lap is recorded
  Mapping,   ///< the lap is mapped; the robot is at standstill
  Ready,     ///< a route is available
  Replaying,
  Paused,   ///< a replay is paused; the robot is at standstill
  Done,     ///< the route was driven to its end
  Stopped,  ///< the replay was ended early; see reason()
  Over,     ///< the session has ended
};

/// Events of the session. Go is its main button: Y, or triangle.
enum class OperatorEvent : std::uint8_t {
  Go,
  Stop,            ///< B, or circle
  StickMoved,      ///< a person uses the sticks
  MapMade,         ///< the lap was mapped
  MapFailed,       ///< mapping failed
  ReplayFinished,  ///< the robot has reached the goal
  ReplayStopped,   ///< the replay was aborted, or refused to start
  Quit,
  Teach,  ///< teach another lap, whether or not there is a map
};

[[nodiscard]] std::string_view to_string(OperatorState state);
[[nodiscard]] std::string_view to_string(OperatorEvent event);

/// Action that the owner of the session takes next.
enum class OperatorAction : std::uint8_t {
  Nothing,
  StartLap,      ///< start recording
  FinishLap,     ///< end the recording and map the lap
  DropLap,       ///< end the recording without mapping it
  StartReplay,   ///< from the current position of the robot
  PauseReplay,   ///< the robot stops; the replay keeps its position on the route
  ResumeReplay,  ///< from the nearest point ahead
  EndReplay,
  Leave,  ///< end the current activity
};

struct OperatorOptions {
  Duration bounce = std::chrono::milliseconds(300);  ///< further presses of Go within this time are ignored
};

/// Names of the buttons in prompts.
struct OperatorButtons {
  std::string go = "Y (triangle)";
  std::string stop = "B (circle)";
  std::string drive = "hold the left shoulder and drive";
};

/// The operator's session as a state table. Pure: time is an argument; only commands that permit() returns
/// reach the robot.
class Operator {
 public:
  explicit Operator(const OperatorOptions& options = {}, OperatorState start = OperatorState::Idle)
      : options_(options), state_(start) {}

  /// Returns the action for an event, or an error that explains why the event has no effect now. `reason`:
  /// cause of MapFailed and ReplayStopped.
  Result<OperatorAction> handle(OperatorEvent event, Duration now, std::string reason = {});

  [[nodiscard]] OperatorState state() const { return state_; }
  [[nodiscard]] Duration since() const { return since_; }
  /// Why the last replay or mapping ended early; empty otherwise.
  [[nodiscard]] const std::string& reason() const { return reason_; }
  /// The operator's options now, in one line.
  [[nodiscard]] std::string prompt(const OperatorButtons& buttons = {}) const;

  /// The command that may be sent to the robot: the person's while teaching, the replay's while replaying,
  /// zero in every other state.
  [[nodiscard]] VelocityCommand permit(const VelocityCommand& person, const VelocityCommand& replay) const;

 private:
  OperatorOptions options_;
  OperatorState state_;
  Duration since_{};
  std::optional<Duration> last_go_{};
  std::string reason_{};
};

struct OperatorPadOptions {
  int go_button = 3;          ///< Y, or triangle (numbers: inputs/gamepad)
  int stop_button = 1;        ///< B, or circle
  int quit_button = 4;        ///< back
  double stick_motion = 0.3;  ///< deflection of a stick that counts as intended
};

/// Converts gamepad states to events: a button once when it is pressed, the sticks while they are deflected.
class OperatorPad {
 public:
  explicit OperatorPad(const OperatorPadOptions& options = {}) : options_(options) {}

  /// The event of this gamepad state; Stop has priority. The first state causes no event: a button that is
  /// already held when the session begins does not count.
  [[nodiscard]] std::optional<OperatorEvent> add(const GamepadState& pad);

 private:
  OperatorPadOptions options_;
  std::optional<GamepadState> last_{};
};

}  // namespace waymark
