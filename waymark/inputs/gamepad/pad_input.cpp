#include "waymark/inputs/gamepad/pad_input.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace waymark {
namespace {

double axis(const GamepadState& state, int index, double dead_zone) {
  const auto i = static_cast<std::size_t>(index);
  if (i >= state.axes.size() || !std::isfinite(state.axes[i])) return 0;
  const double value = std::clamp(static_cast<double>(state.axes[i]), -1.0, 1.0);
  // Continuous, because it is 0 at the edge of the dead zone.
  const double beyond = std::max(0.0, std::abs(value) - dead_zone) / (1 - dead_zone);
  return std::copysign(beyond, value);
}

bool pressed(const GamepadState& state, int index) {
  const auto i = static_cast<std::size_t>(index);
  return i < state.buttons.size() && state.buttons[i] != 0;
}

}  // namespace

void StickDriver::add(const GamepadState& state) {
  state_ = state;
  finished_ = finished_ || pressed(state, options_.finish_button);
}

std::optional<VelocityCommand> StickDriver::drive(SensorTime now) const {
  if (finished_) return std::nullopt;
  const bool silent = !state_ || now - state_->stamp > Duration(std::llround(options_.silence_s * 1e9));
  if (silent || !pressed(*state_, options_.dead_man_button)) return VelocityCommand{};
  return VelocityCommand{options_.speed_m_s * axis(*state_, options_.speed_axis, options_.dead_zone),
                         options_.yaw_rate_rad_s * axis(*state_, options_.yaw_axis, options_.dead_zone)};
}

HeldPad::Poll HeldPad::poll(SensorTime now) {
  Poll found{.state = {.stamp = now}};
  auto state = pad_->poll(now);
  found.there = state.has_value();
  if (there_ && !found.there)
    found.messages.emplace_back(
        "the gamepad was unplugged: the robot is stopped until it is plugged in again");
  if (!there_ && found.there) {
    found.messages.emplace_back(
        "the gamepad is connected again: release the left shoulder button once, then hold it to drive");
    shown_.reset();
    let_go_ = false;
  }
  there_ = found.there;
  if (!state) return found;
  const auto button = static_cast<std::size_t>(dead_man_button_);
  let_go_ = let_go_ || button >= state->buttons.size() || state->buttons[button] == 0;
  if (let_go_) found.state = std::move(*state);
  return found;
}

void HeldPad::show(const PadSignal& signal) {
  if (!there_ || shown_ == signal) return;
  shown_ = signal;
  pad_->show(signal);
}

PadSignal signal_of(OperatorState state) {
  using S = OperatorState;
  constexpr Duration kShort = std::chrono::milliseconds(200);
  constexpr Duration kLong = std::chrono::milliseconds(600);
  switch (state) {
    case S::Teaching:
      return {.light_rgb = {0, 0, 255}};
    case S::Mapping:
      return {.light_rgb = {128, 0, 128}};
    case S::Ready:
      return {.light_rgb = {255, 255, 255}};
    case S::Replaying:
      return {.light_rgb = {0, 255, 0}};
    case S::Paused:
      return {.light_rgb = {255, 128, 0}, .rumble = 0.5, .rumble_for = kLong};
    case S::Done:
      return {.light_rgb = {255, 255, 255}, .rumble = 0.5, .rumble_for = kShort};
    case S::Stopped:
      return {.light_rgb = {255, 0, 0}, .rumble = 1, .rumble_for = kLong};
    case S::Idle:
    case S::Over:
      return {};
  }
  return {};
}

Result<DriverDecision> PadLapDriver::drive(Duration /*uptime*/, SensorTime now) {
  HeldPad::Poll held = pad_.poll(now);
  pad_.show(signal_of(OperatorState::Teaching));
  driver_.add(held.state);
  const auto command = driver_.drive(now);
  return DriverDecision{.command = command.value_or(VelocityCommand{}),
                        .done = !command,
                        .pad = held.there ? std::optional(std::move(held.state)) : std::nullopt,
                        .messages = std::move(held.messages)};
}

Result<OperatorRequest> PadInput::read(Duration uptime, SensorTime now, OperatorState state) {
  constexpr Duration kRepeatPause = std::chrono::milliseconds(400);  // two presses within 0.3 s count as one
  HeldPad::Poll held = pad_.poll(now);
  pad_.show(signal_of(state));
  OperatorRequest request{.messages = std::move(held.messages)};
  driver_.add(held.state);
  if (const auto event = events_.add(held.state)) request.events.push_back(*event);
  const bool asks = !held.there && state == OperatorState::Replaying;
  if (asks && (!pause_asked_ || uptime - *pause_asked_ >= kRepeatPause)) {
    request.events.push_back(OperatorEvent::Go);  // pauses a replay
    pause_asked_ = uptime;
  }
  request.command = driver_.drive(now).value_or(VelocityCommand{});
  if (held.there) request.pad = std::move(held.state);
  return request;
}

}  // namespace waymark
