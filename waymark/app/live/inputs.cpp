#include "waymark/app/live/inputs.hpp"

#include <algorithm>
#include <string>
#include <utility>

#include <unistd.h>

#include <fmt/format.h>

#include "waymark/base/message_text.hpp"
#include "waymark/inputs/gamepad/pad_input.hpp"
#include "waymark/inputs/keyboard/key_input.hpp"
#include "waymark/inputs/keyboard/line_input.hpp"
#include "waymark/robots/simulated/script_driver.hpp"
#include "waymark/runtime/operator_input.hpp"
#include "waymark/runtime/viewer_input.hpp"
#include "waymark/server/live_feed.hpp"

namespace waymark {
namespace {

/// A background process that changes the terminal settings is stopped by SIGTTOU, which would stop the robot
/// as well.
bool in_foreground() {
  const pid_t group = tcgetpgrp(STDIN_FILENO);
  return group < 0 || group == getpgrp();
}

}  // namespace

StopKey::StopKey(bool taken) {
  if (taken || !in_foreground()) return;
  auto keys = TerminalKeys::open(STDIN_FILENO);
  if (keys) keys_ = std::move(*keys);
}

bool StopKey::pressed() {
  if (!keys_ || !in_foreground()) return false;
  const Result<std::string> typed = keys_->read();
  return typed && typed->find(' ') != std::string::npos;
}

namespace {

tl::unexpected<Error> no_driver(const std::string& name, const std::vector<std::string>& known) {
  return fail(ErrorCode::InvalidArgument, fmt::format("unknown driver '{}'", name), {.key = "driver"},
              suggestion(name, known));
}

Result<std::unique_ptr<OperatorInput>> make_input(const std::string& name, double speed_m_s,
                                                  const SimulatedSetup& setup, bool stays) {
  if (name == "gamepad") {
    auto pad = open_gamepad();
    if (!pad) return tl::unexpected(pad.error());
    return std::make_unique<PadInput>(std::move(*pad), speed_m_s);
  }
  if (name == "keyboard") {
    auto keys = TerminalKeys::open(STDIN_FILENO);
    if (!keys) return tl::unexpected(keys.error());
    return std::make_unique<KeyInput>(std::move(*keys), speed_m_s);
  }
  if (name == "lines") return std::make_unique<LineInput>(STDIN_FILENO);
  if (name != "scripted") return no_driver(name, operator_inputs());
  auto driver = ScriptDriver::make(setup, speed_m_s);
  if (!driver) return tl::unexpected(driver.error());
  return std::make_unique<ScriptInput>(std::move(*driver), stays);
}

}  // namespace

std::vector<std::string> lap_drivers() { return {"scripted", "keyboard", "gamepad"}; }

Status check_lap_driver(const std::string& name) {
  const std::vector<std::string> drivers = lap_drivers();
  return std::ranges::find(drivers, name) != drivers.end() ? Status() : no_driver(name, drivers);
}

Result<std::unique_ptr<LapDriver>> make_lap_driver(const std::string& name, double speed_m_s,
                                                   const SimulatedSetup& setup) {
  if (name == "scripted") return ScriptDriver::make(setup, speed_m_s);
  if (name == "gamepad") {
    auto pad = open_gamepad();
    if (!pad) return tl::unexpected(pad.error());
    return in_real_time(std::make_unique<PadLapDriver>(std::move(*pad), speed_m_s));
  }
  if (name != "keyboard") return no_driver(name, lap_drivers());
  auto keys = TerminalKeys::open(STDIN_FILENO);
  if (!keys) return tl::unexpected(keys.error());
  return in_real_time(std::make_unique<KeyLapDriver>(std::move(*keys), speed_m_s));
}

std::vector<std::string> operator_inputs() { return {"gamepad", "keyboard", "lines", "scripted", "page"}; }

Result<std::unique_ptr<OperatorInput>> make_operator_input(const std::string& name, double speed_m_s,
                                                           const SimulatedSetup& setup,
                                                           const std::optional<ViewerLink>& viewers) {
  if (!viewers && name == "page")
    return fail(ErrorCode::InvalidArgument, "the driver 'page' requires `view`", {.key = "driver"},
                "Add `view`, or choose another driver.");
  if (!viewers) return make_input(name, speed_m_s, setup, false);
  std::unique_ptr<OperatorInput> other;
  ViewerInput::MakeScript script = [] { return std::unique_ptr<LapDriver>(); };
  if (name == "page") {  // on request, a script drives along the path in the world, if there is one
    script = [speed_m_s, &setup] {
      auto driver = ScriptDriver::make(setup, speed_m_s);
      return driver ? std::move(*driver) : std::unique_ptr<LapDriver>();
    };
  } else {
    auto made = make_input(name, speed_m_s, setup, true);
    if (!made) return made;
    other = std::move(*made);
  }
  return std::make_unique<ViewerInput>(*viewers, std::move(other), std::move(script));
}

std::optional<ViewerLink> viewer_link(LiveFeed* feed) {
  if (feed == nullptr) return std::nullopt;
  return ViewerLink{.take_orders = [feed] { return feed->take_orders(); },
                    .control = [feed] { return feed->control(); },
                    .labels = feed->labels()};
}

}  // namespace waymark
