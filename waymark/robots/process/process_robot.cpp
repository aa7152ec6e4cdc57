#include "waymark/robots/process/process_robot.hpp"

#include <algorithm>
#include <chrono>

#include <fmt/format.h>

#include "waymark/base/message_text.hpp"

namespace waymark {

Result<std::unique_ptr<ProcessRobot>> ProcessRobot::start(const RobotCommand& command,
                                                          const ProcessRobotOptions& options) {
  auto wire = WatchedProcess::start(command, options.watchdog);
  if (!wire) return tl::unexpected(wire.error());
  std::unique_ptr<ProcessRobot> robot(new ProcessRobot(std::move(*wire), command, options.cameras));
  constexpr Duration kSlice = std::chrono::milliseconds(100);
  constexpr Duration kQuiet = std::chrono::seconds(1);
  const Duration began = steady_now();
  const Duration deadline = began + options.hello_within;
  bool notified = false;
  while (steady_now() < deadline) {
    if (options.should_stop())
      return fail(ErrorCode::Unreadable, "stopped before the robot's hello",
                  {.source = "process:" + command.text()});
    if (!notified && steady_now() - began > kQuiet) {
      options.on_waiting(
          fmt::format("waiting for the robot's hello, up to {:g} s", to_seconds(options.hello_within)));
      notified = true;
    }
    const auto message = robot->next_message(std::min(kSlice, deadline - steady_now()));
    if (!message) return tl::unexpected(message.error());
    if (!*message) continue;
    if (const auto* hello = std::get_if<RobotHello>(&**message)) {
      robot->hello_ = *hello;
      return robot;
    }
  }
  return fail(ErrorCode::Unreadable,
              fmt::format("no hello from the robot within {:g} s", to_seconds(options.hello_within)),
              {.source = "process:" + command.text()},
              "The first line must be {\"type\":\"hello\",…}. Does the robot flush standard output?");
}

/// Adds the robot's last log line to the error if it was the newest message, because it explains why the
/// process ended.
Error ProcessRobot::with_last_log(Error error) const {
  if (last_log_.empty()) return error;
  error.message += "; its last message: " + printable(last_log_);
  error.hint.clear();
  return error;
}

Result<std::optional<RobotMessage>> ProcessRobot::next_message(Duration timeout) {
  if (waiting_.empty()) {
    auto lines = wire_->read(timeout);
    if (!lines) return tl::unexpected(with_last_log(lines.error()));
    const Duration now = steady_now();
    for (Line& line : *lines) waiting_.push_back({std::move(line), now});
  }
  if (waiting_.empty()) return std::optional<RobotMessage>();
  const Arrived arrived = std::move(waiting_.front());
  waiting_.pop_front();
  auto message = reader_.read(arrived.line);
  if (!message || !*message) return message;
  const auto* log = std::get_if<RobotLog>(&**message);
  last_log_ = log != nullptr ? log->text : std::string();
  if (const auto* sample = std::get_if<Sample>(&**message)) {
    clock_.receive(stamp_of(*sample), arrived.at);
    newest_ = std::max(newest_.value_or(stamp_of(*sample)), stamp_of(*sample));
  }
  if (const auto* step = std::get_if<RobotStep>(&**message)) step_ = *step;
  return message;
}

Result<std::optional<RobotEvent>> ProcessRobot::next(Duration timeout) {
  const auto queued = [this]() -> std::optional<RobotEvent> {
    if (texts_.empty()) return std::nullopt;
    RobotText text{std::move(texts_.front())};
    texts_.pop_front();
    return text;
  };
  if (auto text = queued()) return text;
  auto message = next_message(timeout);
  if (!message) return tl::unexpected(message.error());
  for (std::string& warning : reader_.take_warnings()) texts_.push_back(std::move(warning));
  if (!*message) return queued();
  if (const auto* log = std::get_if<RobotLog>(&**message))
    return std::optional<RobotEvent>(RobotText{log->text});
  if (const auto* step = std::get_if<RobotStep>(&**message))
    return std::optional<RobotEvent>(CommandRequest{step->stamp});
  if (auto* sample = std::get_if<Sample>(&**message)) return std::optional<RobotEvent>(std::move(*sample));
  return queued();  // the hello was repeated
}

Status ProcessRobot::command(const VelocityCommand& command) {
  return wire_->send(command.speed_m_s, command.yaw_rate_rad_s, hello_.lockstep ? step_.step : 0);
}

std::optional<SensorTime> ProcessRobot::now() const {
  if (hello_.lockstep) return step_.step > 0 ? std::optional(step_.stamp) : std::nullopt;
  return hello_.simulated_time ? newest_ : clock_.at(steady_now());
}

}  // namespace waymark
