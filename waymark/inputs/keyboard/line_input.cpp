#include "waymark/inputs/keyboard/line_input.hpp"

#include <charconv>
#include <cmath>
#include <optional>
#include <string_view>

#include <fmt/format.h>

#include "waymark/robots/watchdog/pipes.hpp"

namespace waymark {
namespace {

/// Parses "drive 0.3 -0.1"; empty for anything else.
std::optional<VelocityCommand> parse_drive(std::string_view line) {
  constexpr std::string_view kDrive = "drive ";
  if (!line.starts_with(kDrive)) return std::nullopt;
  const char* end = line.data() + line.size();
  VelocityCommand command;
  const auto speed = std::from_chars(line.data() + kDrive.size(), end, command.speed_m_s);
  if (speed.ec != std::errc() || speed.ptr == end || *speed.ptr != ' ') return std::nullopt;
  const auto turn = std::from_chars(speed.ptr + 1, end, command.yaw_rate_rad_s);
  if (turn.ec != std::errc() || turn.ptr != end) return std::nullopt;
  if (!std::isfinite(command.speed_m_s) || !std::isfinite(command.yaw_rate_rad_s)) return std::nullopt;
  return command;
}

}  // namespace

LineInput::LineInput(int descriptor) : descriptor_(descriptor) { never_wait(descriptor_); }

Result<OperatorRequest> LineInput::read(Duration uptime, SensorTime /*now*/, OperatorState state) {
  OperatorRequest request;
  std::string bytes;
  const Moved moved = read_some(descriptor_, bytes);
  lines_.add(bytes);
  while (const auto line = lines_.next()) {
    apply_line(line->text, uptime, state, request);
  }
  if (moved == Moved::Ended) request.events.push_back(OperatorEvent::Quit);
  constexpr Duration kHold = std::chrono::milliseconds(500);
  if (commanded_at_ && uptime - *commanded_at_ <= kHold) request.command = command_;
  return request;
}

void LineInput::apply_line(const std::string& line, Duration uptime, OperatorState state,
                           OperatorRequest& request) {
  using E = OperatorEvent;
  if (line == "go") request.events.push_back(E::Go);
  if (line == "stop") request.events.push_back(E::Stop);
  if (line == "quit") request.events.push_back(E::Quit);
  if (line == "go" || line == "stop") commanded_at_.reset();  // earlier commands end here
  if (line == "go" || line == "stop" || line == "quit" || line.empty()) return;
  const std::optional<VelocityCommand> command = parse_drive(line);
  if (!command) {
    // The previous command still ends after half a second.
    request.messages.push_back(
        fmt::format("invalid line '{}'; use go, stop, quit, or drive 0.3 -0.1", line.substr(0, 60)));
    return;
  }
  if (state != OperatorState::Teaching && *command != VelocityCommand{})
    request.events.push_back(E::StickMoved);
  command_ = *command;
  commanded_at_ = uptime;
}

}  // namespace waymark
