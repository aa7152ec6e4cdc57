#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "waymark/base/fields.hpp"
#include "waymark/robots/dds/bus.hpp"
#include "waymark/robots/dds/discovery.hpp"
#include "waymark/robots/process/command_sender.hpp"

namespace waymark {

struct RelayOptions {
  std::string from = "/waymark/cmd_vel";
  std::string to = "/cmd_vel";
  bool stamped = false;  ///< whether both topics use TwistStamped
  CommandRepeatOptions repeat{};

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.from, JobField("from TOPIC", "Topic of the incoming commands"));
    visit(self.to, JobField("to TOPIC", "Command topic of the robot"));
    visit(self.stamped, JobField("stamped", "Both topics are TwistStamped instead of Twist"));
  }
};

struct RelayCounts {
  std::uint64_t received = 0;  ///< number of commands forwarded
  std::uint64_t ceased = 0;    ///< number of times that commands ceased and zero was published instead
};

/// Messages for the user at the start and at the end.
[[nodiscard]] std::string relay_start_text(const RelayOptions& options, int domain);
[[nodiscard]] std::string relay_end_text(const RelayCounts& counts);

/// Fails if a topic name is invalid or both topics are the same.
[[nodiscard]] Status check_relay(const RelayOptions& options);

/// DDS name of the topic on which the relay publishes.
[[nodiscard]] BusTopic relay_output(const RelayOptions& options);

/// Messages about problems that prevent commands from reaching the robot: a different type, incompatible
/// quality of service, no publisher, no subscriber, or another program that bypasses the relay. `others`
/// contains the endpoints of other participants.
[[nodiscard]] std::vector<std::string> relay_problems(const TopicUse& from, const TopicUse& to,
                                                      const std::vector<BusEndpoint>& others);

/// A watchdog to run on a robot that does not stop by itself. It forwards velocity commands from one topic to
/// another and publishes zero if none has arrived for 0.25 s. It runs until should_stop() returns true, then
/// publishes zero. Each problem is reported once, as soon as it is discovered.
[[nodiscard]] Result<RelayCounts> relay_commands(Bus& bus, const RelayOptions& options,
                                                 const std::function<void(const std::string&)>& report,
                                                 const std::function<bool()>& should_stop);

/// Joins the network and runs relay_commands() with a ZeroGuard. Must be called before this process starts
/// threads. Also reports the messages for the start and the end.
[[nodiscard]] Status run_relay(const RelayOptions& options, const BusOptions& network,
                               const std::function<void(const std::string&)>& report,
                               const std::function<bool()>& should_stop);

}  // namespace waymark
