#include "waymark/drivers/process/command_sender.hpp"

#include <string>
#include <utility>

#include <poll.h>

#include "waymark/drivers/process/robot_messages.hpp"
#include "waymark/drivers/watchdog/pipes.hpp"

namespace waymark {
namespace {

constexpr int kFarewells = 4;
constexpr Duration kFarewell = std::chrono::milliseconds(20);

}  // namespace

CommandSender::CommandSender(std::function<void(const VelocityCommand&)> send, const RobotWire& wire)
    : send_(std::move(send)), input_(wire.input), listen_only_(wire.listen_only) {
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
    if (command && !listen_only_) send_(held_ ? VelocityCommand{} : *command);
    pollfd ready{input_, POLLIN, 0};
    const auto ms = std::chrono::ceil<std::chrono::milliseconds>(repeat.wait(steady_now())).count();
    (void)poll(&ready, 1, static_cast<int>(ms));
    std::string bytes;
    bool over = read_some(input_, bytes) == Moved::Ended;
    lines.add(bytes);
    while (const auto line = lines.next()) {
      const RobotOrderLine order = parse_order_line(line->text);
      if (order.kind == RobotOrderLine::Kind::Bye) said_bye_ = over = true;
      if (order.kind == RobotOrderLine::Kind::Velocity) repeat.offer(order.command, steady_now());
    }
    if (over) break;
  }
  for (int i = 0; i < kFarewells && !listen_only_; ++i) {
    send_({});
    std::this_thread::sleep_for(kFarewell);
  }
  ended_ = true;
}

EarlyInput::EarlyInput(int input) : input_(input) { never_wait(input_); }

bool EarlyInput::said_bye() {
  std::string bytes;
  (void)read_some(input_, bytes);
  lines_.add(bytes);
  bool bye = false;
  while (const auto line = lines_.next())
    bye = bye || parse_order_line(line->text).kind == RobotOrderLine::Kind::Bye;
  return bye;
}

}  // namespace waymark
