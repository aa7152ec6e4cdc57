#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "waymark/base/error.hpp"
#include "waymark/base/time.hpp"
#include "waymark/samples/robot_samples.hpp"

namespace waymark {

/// Where the operator's session is (Martins and Ramos, "AprilTag-based Trajectory Tracking for the LIMOS
/// Robot": a person teaches with a pad, presses a button, and the robot repeats).
enum class OperatorState : std::uint8_t {
  Idle,      ///< nothing is known yet
  Teaching,  ///< a person drives, everything is recorded
  Mapping,   ///< the lap becomes a map and a route; the robot stands
  Ready,     ///< there is a route
  Replaying,
  Paused,   ///< of a replay; the robot stands
  Done,     ///< the route was driven to its end
  Stopped,  ///< the replay was ended before; why is in reason()
  Over,     ///< nobody goes on
};

/// What may happen. Go is the one button of the session: Y, or the triangle.
enum class OperatorEvent : std::uint8_t {
  Go,
  Stop,            ///< B, or the circle
  StickMoved,      ///< somebody reaches for the sticks
  MapMade,         ///< the lap was mapped
  MapFailed,       ///< it could not be
  ReplayFinished,  ///< the robot is at its goal
  ReplayStopped,   ///< the replay gave up, or refused to start
  Quit,
  Teach,  ///< another lap is asked for, whether there is a map or not
};

[[nodiscard]] std::string_view to_string(OperatorState state);
[[nodiscard]] std::string_view to_string(OperatorEvent event);

/// What whoever runs the session has to do now.
enum class OperatorAction : std::uint8_t {
  Nothing,
  StartLap,      ///< begin to record
  FinishLap,     ///< end the recording and map it
  DropLap,       ///< end the recording; it is not mapped
  StartReplay,   ///< from where the robot stands
  PauseReplay,   ///< the robot stands, the replay keeps its place
  ResumeReplay,  ///< from the nearest forward point
  EndReplay,
  Leave,  ///< end whatever runs
};

struct OperatorOptions {
  Duration bounce = std::chrono::milliseconds(300);  ///< Go counts once in that time
};

/// What the person in charge calls the buttons.
struct OperatorButtons {
  std::string go = "Y (triangle)";
  std::string stop = "B (circle)";
  std::string drive = "hold the left shoulder and drive";
};

/// The operator's session as a table: what each event does in each state. Pure: time is an argument, and
/// nothing here moves a robot but permit().
class Operator {
 public:
  explicit Operator(const OperatorOptions& options = {}, OperatorState start = OperatorState::Idle)
      : options_(options), state_(start) {}

  /// What to do about the event; an error says in words why it does nothing now. `reason`: of an event that
  /// tells why (MapFailed, ReplayStopped).
  Result<OperatorAction> handle(OperatorEvent event, Duration now, std::string reason = {});

  [[nodiscard]] OperatorState state() const { return state_; }
  [[nodiscard]] Duration since() const { return since_; }
  /// Why the last replay or map ended as it did; empty when all is well.
  [[nodiscard]] const std::string& reason() const { return reason_; }
  /// What a person can do now, in one line.
  [[nodiscard]] std::string prompt(const OperatorButtons& buttons = {}) const;

  /// The command that may reach the robot: the person's while teaching, the replay's while replaying, and
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
  int go_button = 3;          ///< Y, the triangle (numbers: inputs/gamepad)
  int stop_button = 1;        ///< B, the circle
  int quit_button = 4;        ///< back
  double stick_motion = 0.3;  ///< a stick that is so far off its middle is meant
};

/// Turns what a pad shows into events: a button once when it is pressed, the sticks for as long as they are
/// off their middle.
class OperatorPad {
 public:
  explicit OperatorPad(const OperatorPadOptions& options = {}) : options_(options) {}

  /// The event of this state of the pad; Stop before the others. Nothing from the very first state: a button
  /// that is held when the session begins is not pressed.
  [[nodiscard]] std::optional<OperatorEvent> add(const GamepadState& pad);

 private:
  OperatorPadOptions options_;
  std::optional<GamepadState> last_{};
};

}  // namespace waymark
