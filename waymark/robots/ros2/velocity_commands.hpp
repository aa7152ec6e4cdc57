#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <set>
#include <string>
#include <vector>

#include <sys/types.h>

#include "waymark/robots/dds/bus.hpp"
#include "waymark/robots/watchdog/pipes.hpp"
#include "waymark/samples/robot_samples.hpp"

namespace waymark {

/// A velocity command as CDR: geometry_msgs/msg/TwistStamped, or Twist, which has no stamp.
[[nodiscard]] std::vector<std::uint8_t> velocity_message(const StampedCommand& command, bool stamped);

/// The same with the time of this computer's clock as its stamp.
[[nodiscard]] std::vector<std::uint8_t> velocity_message_now(const VelocityCommand& command, bool stamped);

/// Publishes zero several times, 80 ms in all: a network that is left right after a message may never send
/// it.
[[nodiscard]] Status publish_zero(Bus& bus, std::size_t publisher, bool stamped);

/// A child process that publishes zero where this process publishes velocity commands and is killed: what a
/// program does at its end, it cannot do then, and many a robot obeys the last command for ever.
class ZeroGuard {
 public:
  /// Forks: to be called before this process has threads, which a bus begins. The child joins the network
  /// by these options (node: "waymark_zero_guard") once something is to be guarded. It is not reached by
  /// Ctrl-C, and ends with this process. `say`: called in the child when it has published zero, with what it
  /// did.
  [[nodiscard]] static Result<ZeroGuard> start(BusOptions options,
                                               const std::function<void(const std::string&)>& say);
  ZeroGuard(ZeroGuard&&) noexcept = default;
  ZeroGuard& operator=(ZeroGuard&&) = delete;
  ZeroGuard(const ZeroGuard&) = delete;
  ZeroGuard& operator=(const ZeroGuard&) = delete;
  /// Nothing is guarded any more: this process published its own zero.
  ~ZeroGuard();

  /// From now on velocity commands are published on this topic, of Twist or TwistStamped.
  void guard(const BusTopic& topic);

 private:
  ZeroGuard(pid_t child, Descriptor pipe) : child_(child), pipe_(std::move(pipe)) {}

  pid_t child_;
  Descriptor pipe_;
  std::set<std::string> guarded_{};
};

}  // namespace waymark
