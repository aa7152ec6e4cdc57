#include "waymark/cli/human_driver.hpp"

#include <chrono>
#include <thread>

#include <unistd.h>

#include "waymark/drivers/gamepad/gamepad.hpp"
#include "waymark/drivers/gamepad/stick_driver.hpp"
#include "waymark/drivers/keyboard/key_driver.hpp"
#include "waymark/drivers/keyboard/terminal_keys.hpp"

namespace waymark::cli {
namespace {

std::int64_t wall_ns() {
  const auto since_start = std::chrono::steady_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::nanoseconds>(since_start).count();
}

class AtTheKeys final : public HumanDriver {
 public:
  AtTheKeys(std::unique_ptr<TerminalKeys> keys, double speed_m_s)
      : keys_(std::move(keys)), driver_({.speed_m_s = speed_m_s}) {}

  std::string usage() const override {
    return "w a s d or arrows drive while they are held, space stops, q ends the lap";
  }

 protected:
  Result<DriverDecision> decide(Duration uptime, SensorTime /*now*/) override {
    const Result<std::string> typed = keys_->read();
    if (!typed) return tl::unexpected(typed.error());
    bytes_ += *typed;
    for (const DriverKey key : take_keys(bytes_)) driver_.press(key, uptime);
    const auto command = driver_.drive(uptime);
    return DriverDecision{.command = command.value_or(VelocityCommand{}), .done = !command};
  }

 private:
  std::unique_ptr<TerminalKeys> keys_;
  KeyDriver driver_;
  std::string bytes_;
};

class WithAGamepad final : public HumanDriver {
 public:
  WithAGamepad(std::unique_ptr<Gamepad> pad, double speed_m_s)
      : pad_(std::move(pad)), driver_({.speed_m_s = speed_m_s}) {}

  std::string usage() const override {
    return "hold the left shoulder; left stick speed, right stick turn, Y (triangle) ends the lap";
  }

 protected:
  Result<DriverDecision> decide(Duration /*uptime*/, SensorTime now) override {
    Result<GamepadState> state = pad_->poll(now);
    if (!state) return tl::unexpected(state.error());
    driver_.add(*state);
    const auto command = driver_.drive(now);
    return DriverDecision{
        .command = command.value_or(VelocityCommand{}), .done = !command, .pad = std::move(*state)};
  }

 private:
  std::unique_ptr<Gamepad> pad_;
  StickDriver driver_;
};

}  // namespace

Result<std::unique_ptr<HumanDriver>> HumanDriver::make(const std::string& name, double speed_m_s) {
  if (name == "gamepad") {
    auto pad = open_gamepad();
    if (!pad) return tl::unexpected(pad.error());
    return std::make_unique<WithAGamepad>(std::move(*pad), speed_m_s);
  }
  auto keys = TerminalKeys::open(STDIN_FILENO);
  if (!keys) return tl::unexpected(keys.error());
  return std::make_unique<AtTheKeys>(std::move(*keys), speed_m_s);
}

Result<DriverDecision> HumanDriver::drive(Duration uptime, SensorTime now) {
  if (start_ns_ == 0) start_ns_ = wall_ns() - uptime.count();
  const std::int64_t ahead_ns = start_ns_ + uptime.count() - wall_ns();
  if (ahead_ns > 0) std::this_thread::sleep_for(std::chrono::nanoseconds(ahead_ns));
  return decide(uptime, now);
}

}  // namespace waymark::cli
