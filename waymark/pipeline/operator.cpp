#include "waymark/pipeline/operator.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <fmt/format.h>

namespace waymark {
namespace {

using S = OperatorState;
using E = OperatorEvent;
using A = OperatorAction;

struct Transition {
  S from;
  E event;
  S to;
  A action;
};

/// All permitted transitions; any other event is refused.
constexpr std::array kTransitions{
    Transition{S::Idle, E::Go, S::Teaching, A::StartLap},
    Transition{S::Idle, E::Teach, S::Teaching, A::StartLap},
    Transition{S::Ready, E::Teach, S::Teaching, A::StartLap},
    Transition{S::Done, E::Teach, S::Teaching, A::StartLap},
    Transition{S::Stopped, E::Teach, S::Teaching, A::StartLap},
    Transition{S::Teaching, E::Go, S::Mapping, A::FinishLap},
    Transition{S::Teaching, E::Stop, S::Idle, A::DropLap},
    Transition{S::Teaching, E::StickMoved, S::Teaching, A::Nothing},  // the sticks drive the robot during
                                                                      // teaching
    Transition{S::Mapping, E::MapMade, S::Ready, A::Nothing},
    Transition{S::Mapping, E::MapFailed, S::Idle, A::Nothing},
    Transition{S::Ready, E::Go, S::Replaying, A::StartReplay},
    Transition{S::Replaying, E::Go, S::Paused, A::PauseReplay},
    Transition{S::Replaying, E::Stop, S::Stopped, A::EndReplay},
    Transition{S::Replaying, E::StickMoved, S::Stopped, A::EndReplay},
    Transition{S::Replaying, E::ReplayFinished, S::Done, A::EndReplay},
    Transition{S::Replaying, E::ReplayStopped, S::Stopped, A::EndReplay},
    Transition{S::Paused, E::Go, S::Replaying, A::ResumeReplay},
    Transition{S::Paused, E::Stop, S::Stopped, A::EndReplay},
    Transition{S::Done, E::Go, S::Replaying, A::StartReplay},
    Transition{S::Stopped, E::Go, S::Replaying, A::StartReplay},
};

std::string usual_reason(E event) {
  if (event == E::Stop) return "stopped by the operator";
  if (event == E::StickMoved) return "stopped: a stick was moved";
  return {};
}

/// Explains why an event has no effect in a state.
std::string refusal(S state, E event) {
  if (state == S::Over) return "the session has ended";
  if (event == E::Go && state == S::Mapping) return "mapping is in progress: wait";
  if (event == E::Stop && state == S::Mapping)
    return "the robot is stopped, and mapping is in progress: wait";
  if (event == E::Stop) return "the robot is already stopped";
  if (event == E::StickMoved) return "sticks drive only while teaching";
  return fmt::format("'{}' has no effect while {}", to_string(event), to_string(state));
}

bool pressed(const GamepadState& pad, int button) {
  const auto i = static_cast<std::size_t>(button);
  return i < pad.buttons.size() && pad.buttons[i] != 0;
}

}  // namespace

std::string_view to_string(OperatorState state) {
  constexpr std::array<std::string_view, 9> kWords{"idle",   "teaching", "mapping", "ready", "replaying",
                                                   "paused", "done",     "stopped", "over"};
  return kWords[static_cast<std::size_t>(state)];
}

std::string_view to_string(OperatorEvent event) {
  constexpr std::array<std::string_view, 9> kWords{
      "go",   "stop", "stick moved", "map made", "map failed", "replay finished", "replay stopped",
      "quit", "teach"};
  return kWords[static_cast<std::size_t>(event)];
}

Result<OperatorAction> Operator::handle(OperatorEvent event, Duration now, std::string reason) {
  if (event == E::Quit && state_ != S::Over) {
    state_ = S::Over;
    since_ = now;
    return A::Leave;
  }
  if (event == E::Go) {
    const bool bounced = last_go_ && now - *last_go_ < options_.bounce;
    last_go_ = now;
    if (bounced) return fail(ErrorCode::InvalidArgument, "the button bounced: the second press is ignored");
  }
  const auto* const found = std::ranges::find_if(
      kTransitions, [&](const Transition& t) { return t.from == state_ && t.event == event; });
  if (found == kTransitions.end()) return fail(ErrorCode::InvalidArgument, refusal(state_, event));
  if (found->to != state_) {
    state_ = found->to;
    since_ = now;
    reason_ = reason.empty() ? usual_reason(event) : std::move(reason);
  }
  return found->action;
}

std::string Operator::prompt(const OperatorButtons& buttons) const {
  const auto& [go, stop, drive] = buttons;
  switch (state_) {
    case S::Idle:
      return go + ": teach a lap";
    case S::Teaching:
      return fmt::format("{}; {}: end the lap; {}: discard it", drive, go, stop);
    case S::Mapping:
      return "mapping in progress, the robot is stopped";
    case S::Ready:
      return go + ": replay the lap";
    case S::Replaying:
      return fmt::format("{}: pause; {}: stop, as does driving", go, stop);
    case S::Paused:
      return fmt::format("{}: resume; {}: stop", go, stop);
    case S::Done:
    case S::Stopped:
      return go + ": replay again";
    case S::Over:
      break;
  }
  return {};
}

VelocityCommand Operator::permit(const VelocityCommand& person, const VelocityCommand& replay) const {
  if (state_ == S::Teaching) return person;
  if (state_ == S::Replaying) return replay;
  return {};
}

std::optional<OperatorEvent> OperatorPad::add(const GamepadState& pad) {
  const std::optional<GamepadState> before = std::exchange(last_, pad);
  const auto newly = [&](int button) { return pressed(pad, button) && before && !pressed(*before, button); };
  if (newly(options_.stop_button)) return E::Stop;
  if (newly(options_.quit_button)) return E::Quit;
  if (newly(options_.go_button)) return E::Go;
  // Uses only the four stick axes, because the rest position of triggers depends on the gamepad.
  constexpr std::size_t kStickAxes = 4;
  for (std::size_t i = 0; i < std::min(kStickAxes, pad.axes.size()); ++i) {
    if (!(std::abs(pad.axes[i]) < options_.stick_motion)) return E::StickMoved;  // NaN is treated as motion
  }
  return std::nullopt;
}

}  // namespace waymark
