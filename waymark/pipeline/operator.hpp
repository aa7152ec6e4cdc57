#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "waymark/base/error.hpp"
#include "waymark/base/time.hpp"
#include "waymark/samples/robot_samples.hpp"

namespace waymark {

/// The state of an operator's session (Martins and Ramos, "AprilTag-based Trajectory Tracking for the LIMOS
/// Robot": a person teaches with a gamepad, presses a button, and the robot repeats).
enum class OperatorState : std::uint8_t {
  Idle,      ///< there is no map yet
  Teaching,  ///< a person drives, and the lap is being recorded
  Mapping,   ///< the lap is being mapped while the robot stands still
  Ready,     ///< a route is available
  Replaying,
  Paused,   ///< a replay is paused, and the robot stands still
  Done,     ///< the route has been driven to its end
  Stopped,  ///< a replay ended early; see reason()
  Over,     ///< the session has ended
};

/// Events in a session. Go is the main button (Y or triangle).
enum class OperatorEvent : std::uint8_t {
  Go,
  Stop,            ///< B or circle
  StickMoved,      ///< a person is using the sticks
  MapMade,         ///< the lap has been mapped
  MapFailed,       ///< the lap could not be mapped
  ReplayFinished,  ///< the robot has reached the goal
  ReplayStopped,   ///< the replay was aborted or refused to start
  Quit,
  Teach,  ///< request to teach another lap, whether or not there is a map
};

[[nodiscard]] std::string_view to_string(OperatorState state);
[[nodiscard]] std::string_view to_string(OperatorEvent event);

/// The action that the owner of the session must take next.
enum class OperatorAction : std::uint8_t {
  Nothing,
  StartLap,      ///< start recording
  FinishLap,     ///< end the recording and map the lap
  DropLap,       ///< end the recording without mapping it
  StartReplay,   ///< start at the robot's current position
  PauseReplay,   ///< stop the robot; the replay keeps its position on the route
  ResumeReplay,  ///< continue from the nearest point ahead
  EndReplay,
  Leave,  ///< end the current activity
};

struct OperatorOptions {
  Duration bounce = std::chrono::milliseconds(300);  ///< Go is ignored if it is pressed again within this
                                                     ///< time
};

/// The names used for buttons in prompts.
struct OperatorButtons {
  std::string go = "Y (triangle)";
  std::string stop = "B (circle)";
  std::string drive = "hold the left shoulder and drive";
};

/// An operator's session as a state table. It has no side effects, and time is passed as an argument. Only
/// commands returned by permit() may reach the robot.
class Operator {
 public:
  explicit Operator(const OperatorOptions& options = {}, OperatorState start = OperatorState::Idle)
      : options_(options), state_(start) {}

  /// Returns the action for an event, or an error that explains why the event has no effect now. `reason` is
  /// the cause of MapFailed or ReplayStopped.
  Result<OperatorAction> handle(OperatorEvent event, Duration now, std::string reason = {});

  [[nodiscard]] OperatorState state() const { return state_; }
  [[nodiscard]] Duration since() const { return since_; }
  /// Why the last replay or mapping ended early; empty otherwise.
  [[nodiscard]] const std::string& reason() const { return reason_; }
  /// What the operator can do now, in one line.
  [[nodiscard]] std::string prompt(const OperatorButtons& buttons = {}) const;

  /// The command that may be sent to the robot: the person's command while teaching, the replay's command
  /// while replaying, and zero in every other state.
  [[nodiscard]] VelocityCommand permit(const VelocityCommand& person, const VelocityCommand& replay) const;

 private:
  OperatorOptions options_;
  OperatorState state_;
  Duration since_{};
  std::optional<Duration> last_go_{};
  std::string reason_{};
};

struct OperatorPadOptions {
  int go_button = 3;          ///< Y or triangle (for the numbers, see inputs/gamepad)
  int stop_button = 1;        ///< B or circle
  int quit_button = 4;        ///< back button
  double stick_motion = 0.3;  ///< deflection above which a stick is considered to be moved on purpose
};

/// Converts gamepad states to events: one event when a button is pressed, and events for the sticks as long
/// as they are deflected.
class OperatorPad {
 public:
  explicit OperatorPad(const OperatorPadOptions& options = {}) : options_(options) {}

  /// The event for this gamepad state; Stop takes precedence. The first state never causes an event, so a
  /// button that is already pressed when the session starts has no effect.
  [[nodiscard]] std::optional<OperatorEvent> add(const GamepadState& pad);

 private:
  OperatorPadOptions options_;
  std::optional<GamepadState> last_{};
};

}  // namespace waymark
