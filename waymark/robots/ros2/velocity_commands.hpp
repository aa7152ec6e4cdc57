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

/// A velocity command in CDR: geometry_msgs/msg/TwistStamped, or Twist, which has no timestamp.
[[nodiscard]] std::vector<std::uint8_t> velocity_message(const StampedCommand& command, bool stamped);

/// velocity_message() with the current time on this computer's clock as the timestamp.
[[nodiscard]] std::vector<std::uint8_t> velocity_message_now(const VelocityCommand& command, bool stamped);

/// Publishes zero four times over 80 ms, because a message published just before leaving the network may be
/// lost.
[[nodiscard]] Status publish_zero(Bus& bus, std::size_t publisher, bool stamped);

/// A child process that publishes zero on this process's command topics if this process is killed. A killed
/// program cannot stop the robot itself, and many robots keep executing the last command.
class ZeroGuard {
 public:
  /// Forks, so it must be called before this process starts threads, as a bus does. On the first call of
  /// guard(), the child joins the network with these options (node "waymark_zero_guard"). It ignores Ctrl-C
  /// and ends with this process. `report` is called in the child with a message once it has published zero.
  [[nodiscard]] static Result<ZeroGuard> start(BusOptions options,
                                               const std::function<void(const std::string&)>& report);
  ZeroGuard(ZeroGuard&&) noexcept = default;
  ZeroGuard& operator=(ZeroGuard&&) = delete;
  ZeroGuard(const ZeroGuard&) = delete;
  ZeroGuard& operator=(const ZeroGuard&) = delete;
  /// Ends the child without publishing, because this process has published zero itself.
  ~ZeroGuard();

  /// To be called before velocity commands (Twist or TwistStamped) are published on this topic.
  void guard(const BusTopic& topic);

 private:
  ZeroGuard(pid_t child, Descriptor pipe) : child_(child), pipe_(std::move(pipe)) {}

  pid_t child_;
  Descriptor pipe_;
  std::set<std::string> guarded_{};
};

}  // namespace waymark
