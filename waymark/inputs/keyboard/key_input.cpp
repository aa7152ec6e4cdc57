#include "waymark/inputs/keyboard/key_input.hpp"

namespace waymark {

Result<DriverDecision> KeyLapDriver::drive(Duration uptime, SensorTime /*now*/) {
  const Result<std::string> typed = keys_->read();
  if (!typed) return tl::unexpected(typed.error());
  bytes_ += *typed;
  for (const DriverKey key : take_keys(bytes_)) driver_.press(key, uptime);
  const auto command = driver_.drive(uptime);
  return DriverDecision{.command = command.value_or(VelocityCommand{}), .done = !command};
}

Result<OperatorRequest> KeyInput::read(Duration uptime, SensorTime /*now*/, OperatorState state) {
  const Result<std::string> typed = keys_->read();
  if (!typed) return tl::unexpected(typed.error());
  using E = OperatorEvent;
  OperatorRequest request;
  for (const char key : *typed) {
    if (key == 'y' || key == 'Y') request.events.push_back(E::Go);
    if (key == 'b' || key == 'B') request.events.push_back(E::Stop);
  }
  bytes_ += *typed;
  for (const DriverKey key : take_keys(bytes_)) {
    if (key == DriverKey::Finish) {
      request.events.push_back(E::Quit);
      continue;
    }
    if (state != OperatorState::Teaching)
      request.events.push_back(key == DriverKey::Stop ? E::Stop : E::StickMoved);
    driver_.press(key, uptime);
  }
  request.command = driver_.drive(uptime).value_or(VelocityCommand{});
  return request;
}

}  // namespace waymark
