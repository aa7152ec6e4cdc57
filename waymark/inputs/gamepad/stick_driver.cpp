#include "waymark/inputs/gamepad/stick_driver.hpp"

#include <algorithm>
#include <cmath>

namespace waymark {
namespace {

double axis(const GamepadState& state, int index, double dead_zone) {
  const auto i = static_cast<std::size_t>(index);
  if (i >= state.axes.size() || !std::isfinite(state.axes[i])) return 0;
  const double value = std::clamp(static_cast<double>(state.axes[i]), -1.0, 1.0);
  // From 0 at the edge of the dead zone, so that nothing jumps there.
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

}  // namespace waymark
