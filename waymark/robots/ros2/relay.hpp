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
  bool stamped = false;  ///< both are TwistStamped
  CommandRepeatOptions repeat{};

  template <class Self, class Visitor>
  static void fields(Self& self, Visitor&& visit) {
    visit(self.from, JobField("from TOPIC", "Topic the commands come on"));
    visit(self.to, JobField("to TOPIC", "Topic the robot listens to"));
    visit(self.stamped, JobField("stamped", "Both topics are TwistStamped instead of Twist"));
  }
};

struct RelayCounts {
  std::uint64_t received = 0;  ///< commands, passed on
  std::uint64_t ceased = 0;    ///< times that they ceased, and zero was published in their place
};

/// For people: what it does, and in the end what it did.
[[nodiscard]] std::string words_of(const RelayOptions& options, int domain);
[[nodiscard]] std::string words_of(const RelayCounts& counts);

/// Fails where both topics are one.
[[nodiscard]] Status check_relay(const RelayOptions& options);

/// The topic on which it publishes, as DDS names it.
[[nodiscard]] BusTopic relay_output(const RelayOptions& options);

/// What keeps commands from their way from publisher to robot, in words: topics of another type or with
/// qualities of service that exclude ours, nobody who publishes or listens, somebody who commands the robot
/// past the relay. `others`: endpoints of other participants.
[[nodiscard]] std::vector<std::string> relay_problems(const TopicUse& from, const TopicUse& to,
                                                      const std::vector<BusEndpoint>& others);

/// The watchdog of a robot that does not stop by itself, to be run on that robot: passes velocity commands on
/// from one topic to another and publishes zero when none came for 0.25 s, until should_stop() says so; then
/// zero. Each problem is said once, as soon as discovery shows it.
[[nodiscard]] Result<RelayCounts> relay_commands(Bus& bus, const RelayOptions& options,
                                                 const std::function<void(const std::string&)>& say,
                                                 const std::function<bool()>& should_stop);

/// The same on a network that it joins, with a ZeroGuard: to be called before this process has
/// threads. What it does, and in the end what it did, is said.
[[nodiscard]] Status run_relay(const RelayOptions& options, const BusOptions& network,
                               const std::function<void(const std::string&)>& say,
                               const std::function<bool()>& should_stop);

}  // namespace waymark
