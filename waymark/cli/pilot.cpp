#include "waymark/cli/pilot.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>

#include <fmt/format.h>
#include <unistd.h>

#include "waymark/base/suggest.hpp"
#include "waymark/cli/live_driver.hpp"
#include "waymark/cli/page_pilot.hpp"
#include "waymark/drivers/gamepad/gamepad.hpp"
#include "waymark/drivers/gamepad/stick_driver.hpp"
#include "waymark/drivers/keyboard/key_driver.hpp"
#include "waymark/drivers/keyboard/terminal_keys.hpp"
#include "waymark/drivers/watchdog/lines.hpp"
#include "waymark/drivers/watchdog/pipes.hpp"

namespace waymark::cli {
namespace {

using E = OperatorEvent;
using S = OperatorState;

class PadPilot final : public Pilot {
 public:
  PadPilot(std::unique_ptr<Gamepad> pad, double speed_m_s)
      : pad_(std::move(pad)),
        options_{.speed_m_s = speed_m_s, .finish_button = kNoButton},
        driver_(options_) {}

  Result<PilotAct> act(Duration /*uptime*/, SensorTime now, S /*state*/) override {
    Result<GamepadState> state = pad_->poll(now);
    if (!state) return tl::unexpected(state.error());
    PilotAct act;
    driver_.add(*state);
    if (const auto event = events_.add(*state)) act.events.push_back(*event);
    act.command = driver_.drive(now).value_or(VelocityCommand{});
    act.pad = std::move(*state);
    return act;
  }
  std::string usage() const override {
    return "Y (triangle) goes on, B (circle) stops, back ends; teaching: hold the left shoulder, sticks "
           "drive";
  }

 private:
  static constexpr int kNoButton = 31;
  std::unique_ptr<Gamepad> pad_;
  GamepadOptions options_;
  StickDriver driver_;
  OperatorPad events_{};
};

class KeyPilot final : public Pilot {
 public:
  KeyPilot(std::unique_ptr<TerminalKeys> keys, double speed_m_s)
      : keys_(std::move(keys)), driver_({.speed_m_s = speed_m_s}) {}

  Result<PilotAct> act(Duration uptime, SensorTime /*now*/, S state) override {
    const Result<std::string> typed = keys_->read();
    if (!typed) return tl::unexpected(typed.error());
    PilotAct act;
    for (const char key : *typed) {
      if (key == 'y' || key == 'Y') act.events.push_back(E::Go);
      if (key == 'b' || key == 'B') act.events.push_back(E::Stop);
    }
    bytes_ += *typed;
    for (const DriverKey key : take_keys(bytes_)) {
      if (key == DriverKey::Finish) {
        act.events.push_back(E::Quit);
      } else {
        if (state != S::Teaching) act.events.push_back(key == DriverKey::Stop ? E::Stop : E::StickMoved);
        driver_.press(key, uptime);
      }
    }
    act.command = driver_.drive(uptime).value_or(VelocityCommand{});
    return act;
  }
  std::string usage() const override {
    return "y goes on, b or space stops, q ends; teaching: w a s d or arrows drive while they are held";
  }
  OperatorButtons buttons() const override { return {"y", "b", "hold w a s d or arrows to drive"}; }

 private:
  std::unique_ptr<TerminalKeys> keys_;
  KeyDriver driver_;
  std::string bytes_;
};

/// A program: "go", "stop", "quit", "drive 0.3 -0.1" (metres a second, radians a second), a line each.
class LinePilot final : public Pilot {
 public:
  LinePilot() { never_wait(STDIN_FILENO); }

  Result<PilotAct> act(Duration uptime, SensorTime /*now*/, S state) override {
    PilotAct act;
    std::string bytes;
    const Moved moved = read_some(STDIN_FILENO, bytes);
    lines_.add(bytes);
    while (const auto line = lines_.next()) {
      obey(line->text, uptime, state, act);
    }
    if (moved == Moved::Ended) act.events.push_back(E::Quit);
    constexpr Duration kHold = std::chrono::milliseconds(500);
    if (uptime - told_ <= kHold) act.command = command_;  // a program that falls silent drives no more
    return act;
  }
  std::string usage() const override { return "lines: go, stop, quit, drive SPEED_M_S YAW_RATE_RAD_S"; }
  OperatorButtons buttons() const override {
    return {"'go'", "'stop'", "'drive SPEED_M_S YAW_RATE_RAD_S' twice a second and more drives"};
  }

 private:
  void obey(const std::string& line, Duration uptime, S state, PilotAct& act) {
    constexpr std::string_view kDrive = "drive ";
    if (line == "go") act.events.push_back(E::Go);
    if (line == "stop") act.events.push_back(E::Stop);
    if (line == "quit") act.events.push_back(E::Quit);
    if (line == "go" || line == "stop" || line == "quit" || line.empty()) return;
    VelocityCommand command;
    const char* end = line.data() + line.size();
    bool understood = line.starts_with(kDrive);
    if (understood) {
      const auto speed = std::from_chars(line.data() + kDrive.size(), end, command.speed_m_s);
      understood = speed.ec == std::errc() && speed.ptr != end && *speed.ptr == ' ';
      if (understood) {
        const auto turn = std::from_chars(speed.ptr + 1, end, command.yaw_rate_rad_s);
        understood = turn.ec == std::errc() && turn.ptr == end;
      }
    }
    if (!understood || !std::isfinite(command.speed_m_s) || !std::isfinite(command.yaw_rate_rad_s)) {
      // A robot that drives on what was said before the slip goes no further than that held anyway.
      act.words.push_back(fmt::format("this line says nothing: '{}'. Known: go, stop, quit, drive 0.3 -0.1",
                                      line.substr(0, 60)));
      return;
    }
    if (state != S::Teaching && command != VelocityCommand{}) act.events.push_back(E::StickMoved);
    command_ = command;
    told_ = uptime;
  }

  LineSplitter lines_{1024};
  VelocityCommand command_{};
  Duration told_{};
};

/// Knows the way: teaches the world's line once and lets the robot repeat it.
class ScriptPilot final : public Pilot {
 public:
  ScriptPilot(std::unique_ptr<LiveDriver> driver, bool stays) : driver_(std::move(driver)), stays_(stays) {}

  Result<PilotAct> act(Duration uptime, SensorTime now, S state) override {
    PilotAct act;
    const bool settled = uptime - pressed_ >= std::chrono::milliseconds(500);
    if (state == S::Teaching) {
      const Result<DriverDecision> decision = driver_->drive(uptime, now);
      if (!decision) return tl::unexpected(decision.error());
      act.command = decision->command;
      if (decision->done) act.events.push_back(E::Go);
    } else if (settled && !taught_ && state == S::Idle) {
      act.events.push_back(E::Go);
      taught_ = true;
    } else if (settled && state == S::Ready && !replayed_) {
      act.events.push_back(E::Go);
      replayed_ = true;
    } else if (!stays_ && (state == S::Done || state == S::Stopped || (taught_ && state == S::Idle))) {
      act.events.push_back(E::Quit);
    }
    if (!act.events.empty()) pressed_ = uptime;
    return act;
  }
  void hear(const Sample& sample) override { driver_->hear(sample); }
  std::string usage() const override { return "a script drives the world's line and presses the button"; }
  bool is_person() const override { return false; }

 private:
  std::unique_ptr<LiveDriver> driver_;
  bool stays_;
  bool taught_ = false;
  bool replayed_ = false;
  Duration pressed_{};
};

Result<std::unique_ptr<Pilot>> make_pilot(const std::string& name, double speed_m_s,
                                          const SimulatedStage& stage, bool stays) {
  if (name == "gamepad") {
    auto pad = open_gamepad();
    if (!pad) return tl::unexpected(pad.error());
    return std::make_unique<PadPilot>(std::move(*pad), speed_m_s);
  }
  if (name == "keyboard") {
    auto keys = TerminalKeys::open(STDIN_FILENO);
    if (!keys) return tl::unexpected(keys.error());
    return std::make_unique<KeyPilot>(std::move(*keys), speed_m_s);
  }
  if (name == "lines") return std::make_unique<LinePilot>();
  if (name != "scripted")
    return fail(ErrorCode::InvalidArgument, fmt::format("there is no driver '{}'", name), {.key = "--driver"},
                suggestion(name, pilots()));
  auto driver = LiveDriver::make(name, speed_m_s, stage);
  if (!driver) return tl::unexpected(driver.error());
  return std::make_unique<ScriptPilot>(std::move(*driver), stays);
}

}  // namespace

std::vector<std::string> pilots() { return {"gamepad", "keyboard", "lines", "scripted", "page"}; }

std::unique_ptr<Pilot> pilot_with_pad(std::unique_ptr<Gamepad> pad, double speed_m_s) {
  return std::make_unique<PadPilot>(std::move(pad), speed_m_s);
}

Result<std::unique_ptr<Pilot>> Pilot::make(const std::string& name, double speed_m_s,
                                           const SimulatedStage& stage, LiveFeed* feed) {
  if (feed == nullptr && name == "page")
    return fail(ErrorCode::InvalidArgument, "nobody sees the page", {.key = "--driver"},
                "Add --view, or name another driver.");
  if (feed == nullptr) return make_pilot(name, speed_m_s, stage, false);
  std::unique_ptr<Pilot> other;
  PagePilot::MakeScript script = [] { return std::unique_ptr<LiveDriver>(); };
  if (name == "page") {  // where the line is known a script drives it on request
    script = [speed_m_s, &stage] {
      auto driver = LiveDriver::make("scripted", speed_m_s, stage);
      return driver ? std::move(*driver) : std::unique_ptr<LiveDriver>();
    };
  } else {
    auto made = make_pilot(name, speed_m_s, stage, true);
    if (!made) return made;
    other = std::move(*made);
  }
  return std::make_unique<PagePilot>(*feed, std::move(other), std::move(script));
}

}  // namespace waymark::cli
