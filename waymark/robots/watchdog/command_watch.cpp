#include "waymark/robots/watchdog/command_watch.hpp"

#include <charconv>
#include <cmath>

#include <fmt/format.h>

namespace waymark {
namespace {

constexpr std::string_view kWord = "command ";

template <class Number>
bool take(std::string_view& text, Number& value) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc()) return false;
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  if (!text.empty() && text.front() != ' ') return false;
  if (!text.empty()) text.remove_prefix(1);
  return true;
}

}  // namespace

std::string wire_line(const WireCommand& command) {
  return fmt::format("{}{} {} {} {} {}\n", kWord, command.sequence, command.given.count(), command.speed_m_s,
                     command.yaw_rate_rad_s, command.step);
}

Result<WireCommand> parse_wire_line(std::string_view line) {
  WireCommand command;
  std::int64_t given_ns = 0;
  std::string_view rest = line;
  const bool ours = rest.starts_with(kWord);
  if (ours) rest.remove_prefix(kWord.size());
  const bool read = ours && take(rest, command.sequence) && take(rest, given_ns) &&
                    take(rest, command.speed_m_s) && take(rest, command.yaw_rate_rad_s) &&
                    take(rest, command.step) && rest.empty() && line.back() != ' ';
  if (!read || !std::isfinite(command.speed_m_s) || !std::isfinite(command.yaw_rate_rad_s))
    return fail(ErrorCode::Unreadable, fmt::format("this is no command: '{}'", line.substr(0, 80)));
  command.given = Duration(given_ns);
  return command;
}

std::string order_line(const RobotOrder& order) {
  std::string line =
      fmt::format(R"({{"type":"velocity","sequence":{},"speed_m_s":{},"yaw_rate_rad_s":{},"age_s":{:.6f})",
                  order.sequence, order.speed_m_s, order.yaw_rate_rad_s, order.age_s);
  if (order.step != 0) line += fmt::format(R"(,"step":{})", order.step);
  if (order.reason != nullptr) line += fmt::format(R"(,"stop":"{}")", order.reason);
  return line + "}\n";
}

bool CommandWatch::offer(const WireCommand& command, Duration now) {
  const bool finite = std::isfinite(command.speed_m_s) && std::isfinite(command.yaw_rate_rad_s);
  if (!finite || command.sequence <= newest_.sequence || command.given > now) return false;
  if (now - command.given > options_.timeout || given_up_) return false;
  newest_ = command;
  passed_on_ = false;
  return true;
}

std::optional<RobotOrder> CommandWatch::due(Duration now) {
  if (fresh(now)) {
    if (passed_on_) return std::nullopt;
    passed_on_ = true;
    last_zero_.reset();
    return RobotOrder{.sequence = newest_.sequence,
                      .speed_m_s = newest_.speed_m_s,
                      .yaw_rate_rad_s = newest_.yaw_rate_rad_s,
                      .age_s = to_seconds(now - newest_.given),
                      .step = newest_.step};
  }
  if (last_zero_ && now - *last_zero_ < options_.repeat) return std::nullopt;
  last_zero_ = now;
  passed_on_ = true;
  const char* reason = given_up_               ? "whoever drives is gone"
                       : newest_.sequence == 0 ? "no command yet"
                                               : "no fresh command";
  return RobotOrder{.sequence = newest_.sequence, .reason = reason};
}

Duration CommandWatch::next(Duration now) const {
  if (fresh(now)) return passed_on_ ? newest_.given + options_.timeout + Duration(1) : now;
  return last_zero_ ? *last_zero_ + options_.repeat : now;
}

}  // namespace waymark
