#pragma once

#include <functional>
#include <string>

#include "waymark/drivers/dds/bus.hpp"
#include "waymark/drivers/process/command_repeat.hpp"

namespace waymark {

struct RelayOptions {
  std::string from = "/waymark/cmd_vel";
  std::string to = "/cmd_vel";
  bool stamped = false;  ///< both are TwistStamped
  CommandRepeatOptions repeat{};
};

/// The watchdog of a robot that does not stop by itself, to be run on that robot: passes velocity commands on
/// from one topic to another and publishes zero when none came for 0.25 s, until should_stop() says so; then
/// zero.
[[nodiscard]] Status relay_commands(Bus& bus, const RelayOptions& options,
                                    const std::function<bool()>& should_stop);

}  // namespace waymark
