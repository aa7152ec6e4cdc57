#pragma once

#include <functional>
#include <set>
#include <string>

#include <sys/types.h>

#include "waymark/robots/dds/bus.hpp"
#include "waymark/robots/watchdog/pipes.hpp"

namespace waymark {

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
