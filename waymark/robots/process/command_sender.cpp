#include "waymark/robots/process/command_sender.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>

#include <poll.h>
#include <unistd.h>

#include <fmt/format.h>

#include "waymark/robots/watchdog/pipes.hpp"

namespace waymark {

void CommandRepeat::offer(const VelocityCommand& command, Duration now) {
  const bool finite = std::isfinite(command.speed_m_s) && std::isfinite(command.yaw_rate_rad_s);
  command_ = finite ? command : VelocityCommand{};
  given_ = now;
  fresh_ = true;
}

std::optional<VelocityCommand> CommandRepeat::due(Duration now) {
  if (now - given_ > options_.timeout) command_ = {};
  if (!fresh_ && published_ && now - *published_ < options_.period) return std::nullopt;
  fresh_ = false;
  published_ = now;
  return command_;
}

Duration CommandRepeat::wait(Duration now) const {
  if (fresh_ || !published_) return Duration(0);
  return std::clamp(*published_ + options_.period - now, Duration(0), options_.period);
}

Status SenderWatch::check_alone(const std::string& where, const std::string& who,
                                const std::string& start) const {
  if (listen_ == Duration(0) || commands_ < kMinCommandsOfDriver) return {};
  return fail(ErrorCode::InvalidArgument,
              fmt::format("another program commands this robot{}: {} commands in {:.1f} s",
                          who.empty() ? "" : ", " + who, commands_, to_seconds(listen_)),
              {.source = where},
              fmt::format("Stop it. If both are meant to drive: `robot=\"process:waymark {} "
                          "--share-commands\"` `robot_file=NAME`.",
                          start));
}

std::string name_of_this_process() {
  std::array<char, 65> host{};
  if (gethostname(host.data(), host.size() - 1) != 0) host[0] = '?';
  return fmt::format("waymark (process {} on {})", getpid(), host.data());
}

namespace {

constexpr int kFinalStops = 4;
constexpr Duration kFinalStopPeriod = std::chrono::milliseconds(20);

InputRole initial_role(const RobotWire& wire) {
  return wire.listen_only ? InputRole::Listens : InputRole::Unknown;
}

}  // namespace

InputRole role_after(InputRole role, const RobotOrderLine& order) {
  if (role != InputRole::Unknown) return role;
  if (order.kind == RobotOrderLine::Kind::Velocity) return InputRole::Drives;
  if (order.kind != RobotOrderLine::Kind::Hello) return role;
  return order.listen_only ? InputRole::Listens : InputRole::Drives;
}

CommandSender::CommandSender(std::function<void(const VelocityCommand&)> send, const RobotWire& wire,
                             InputRole role)
    : send_(std::move(send)),
      input_(wire.input),
      role_(role == InputRole::Unknown ? initial_role(wire) : role) {
  never_wait(input_);
  thread_ = std::thread([this] { run(); });
}

CommandSender::~CommandSender() {
  stop_ = true;
  thread_.join();
}

void CommandSender::run() {
  CommandRepeat repeat;
  LineSplitter lines;
  while (!stop_ && !ended_) {
    const auto command = repeat.due(steady_now());
    if (command && role_ == InputRole::Drives) send_(held_ ? VelocityCommand{} : *command);
    pollfd ready{input_, POLLIN, 0};
    const auto ms = std::chrono::ceil<std::chrono::milliseconds>(repeat.wait(steady_now())).count();
    (void)poll(&ready, 1, static_cast<int>(ms));
    std::string bytes;
    bool over = read_some(input_, bytes) == Moved::Ended;
    lines.add(bytes);
    while (const auto line = lines.next()) {
      const RobotOrderLine order = parse_order_line(line->text);
      role_ = role_after(role_, order);
      if (order.kind == RobotOrderLine::Kind::Bye) received_bye_ = over = true;
      if (order.kind == RobotOrderLine::Kind::Velocity) repeat.offer(order.command, steady_now());
    }
    if (over) break;
  }
  for (int i = 0; i < kFinalStops && role_ == InputRole::Drives; ++i) {
    send_({});
    std::this_thread::sleep_for(kFinalStopPeriod);
  }
  ended_ = true;
}

EarlyInput::EarlyInput(const RobotWire& wire) : input_(wire.input), role_(initial_role(wire)) {
  never_wait(input_);
}

bool EarlyInput::received_bye() {
  std::string bytes;
  (void)read_some(input_, bytes);
  lines_.add(bytes);
  bool bye = false;
  while (const auto line = lines_.next()) {
    const RobotOrderLine order = parse_order_line(line->text);
    role_ = role_after(role_, order);
    bye = bye || order.kind == RobotOrderLine::Kind::Bye;
  }
  return bye;
}

}  // namespace waymark
