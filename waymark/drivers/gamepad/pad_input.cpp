#include "waymark/drivers/gamepad/pad_input.hpp"

#include <utility>

namespace waymark {

Result<DriverDecision> PadLapDriver::drive(Duration /*uptime*/, SensorTime now) {
  Result<GamepadState> state = pad_->poll(now);
  if (!state) return tl::unexpected(state.error());
  driver_.add(*state);
  const auto command = driver_.drive(now);
  return DriverDecision{
      .command = command.value_or(VelocityCommand{}), .done = !command, .pad = std::move(*state)};
}

Result<OperatorRequest> PadInput::read(Duration /*uptime*/, SensorTime now, OperatorState /*state*/) {
  Result<GamepadState> state = pad_->poll(now);
  if (!state) return tl::unexpected(state.error());
  OperatorRequest request;
  driver_.add(*state);
  if (const auto event = events_.add(*state)) request.events.push_back(*event);
  request.command = driver_.drive(now).value_or(VelocityCommand{});
  request.pad = std::move(*state);
  return request;
}

}  // namespace waymark
