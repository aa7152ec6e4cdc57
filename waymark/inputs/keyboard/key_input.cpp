#include "waymark/inputs/keyboard/key_input.hpp"

#include <cmath>

namespace waymark {
namespace {

constexpr char kEscape = '\x1b';

std::optional<DriverKey> letter(char byte) {
  switch (byte) {
    case 'w':
    case 'W':
      return DriverKey::Forward;
    case 's':
    case 'S':
      return DriverKey::Back;
    case 'a':
    case 'A':
      return DriverKey::Left;
    case 'd':
    case 'D':
      return DriverKey::Right;
    case ' ':
      return DriverKey::Stop;
    case 'q':
    case 'Q':
      return DriverKey::Finish;
    default:
      return std::nullopt;
  }
}

/// The arrow key whose sequence ends in this byte, such as A in ESC [ A or ESC O A.
std::optional<DriverKey> arrow(char byte) {
  switch (byte) {
    case 'A':
      return DriverKey::Forward;
    case 'B':
      return DriverKey::Back;
    case 'C':
      return DriverKey::Right;
    case 'D':
      return DriverKey::Left;
    default:
      return std::nullopt;
  }
}

bool ends_sequence(char byte) { return byte >= '@' && byte <= '~'; }

}  // namespace

std::vector<DriverKey> take_keys(std::string& bytes) {
  std::vector<DriverKey> keys;
  std::size_t at = 0;
  while (at < bytes.size()) {
    if (bytes[at] != kEscape) {
      if (const auto key = letter(bytes[at])) keys.push_back(*key);
      ++at;
      continue;
    }
    if (at + 1 == bytes.size()) {  // Escape alone, because the bytes of an arrow key arrive together
      keys.push_back(DriverKey::Finish);
      ++at;
      continue;
    }
    if (bytes[at + 1] != '[' && bytes[at + 1] != 'O') {
      at += 2;
      continue;
    }
    std::size_t end = at + 2;
    while (end < bytes.size() && !ends_sequence(bytes[end])) ++end;
    if (end == bytes.size()) break;  // the rest has not arrived yet
    if (const auto key = arrow(bytes[end])) keys.push_back(*key);
    at = end + 1;
  }
  bytes.erase(0, at);
  constexpr std::size_t kMaxSequence = 32;
  if (bytes.size() > kMaxSequence) bytes.clear();
  return keys;
}

void KeyDriver::press(DriverKey key, Duration now) {
  last_key_ = now;
  switch (key) {
    case DriverKey::Forward:
    case DriverKey::Back:
      forward_ = key == DriverKey::Forward ? 1 : -1;
      left_ = 0;
      break;
    case DriverKey::Left:
    case DriverKey::Right:
      left_ = key == DriverKey::Left ? 1 : -1;
      last_turn_ = now;
      break;
    case DriverKey::Stop:
      forward_ = left_ = 0;
      break;
    case DriverKey::Finish:
      finished_ = true;
      break;
  }
}

std::optional<VelocityCommand> KeyDriver::drive(Duration now) const {
  if (finished_) return std::nullopt;
  const auto held = [&](const std::optional<Duration>& since) {
    return since && now - *since <= Duration(std::llround(options_.hold_s * 1e9));
  };
  if (!held(last_key_)) return VelocityCommand{};
  const double left = held(last_turn_) ? left_ : 0;
  return VelocityCommand{options_.speed_m_s * forward_, options_.yaw_rate_rad_s * left};
}

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
