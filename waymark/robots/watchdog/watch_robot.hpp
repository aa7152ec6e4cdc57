#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "waymark/base/error.hpp"
#include "waymark/base/time.hpp"
#include "waymark/robots/watchdog/robot_command.hpp"

namespace waymark {

/// A command sent to the watchdog.
struct WireCommand {
  std::int64_t sequence = 0;  ///< counts up from 1
  Duration given{};           ///< time of the decision, on the computer's steady clock
  double speed_m_s = 0;
  double yaw_rate_rad_s = 0;
  std::int64_t step = 0;  ///< the step that it answers, if the robot is in lockstep; otherwise 0

  friend bool operator==(const WireCommand&, const WireCommand&) = default;
};

/// Formats a command as "command 12 8123456789 0.3 -0.1 0" with a newline.
[[nodiscard]] std::string wire_line(const WireCommand& command);
/// Fails on anything that wire_line() would not write, and on non-finite numbers.
[[nodiscard]] Result<WireCommand> parse_wire_line(std::string_view line);

/// An order sent to the robot.
struct RobotOrder {
  std::int64_t sequence = 0;  ///< number of the newest command that was fresh on arrival
  double speed_m_s = 0;
  double yaw_rate_rad_s = 0;
  double age_s = 0;  ///< age of the command when it is forwarded
  std::int64_t step = 0;
  const char* reason = nullptr;  ///< reason for a stop by the watchdog; null for a forwarded command
};

/// The line for the robot's process (docs/formats/robot-process.md).
[[nodiscard]] std::string order_line(const RobotOrder& order);

struct CommandWatchOptions {
  Duration timeout = std::chrono::milliseconds(250);  ///< maximum age of a forwarded command
  Duration repeat = std::chrono::milliseconds(50);    ///< period of repeated zeros
};

/// Decides which orders the robot receives: the newest command once while it is fresh, otherwise repeated
/// zeros. Pure: `now` is the steady clock used for WireCommand::given and must not decrease.
class CommandWatch {
 public:
  explicit CommandWatch(const CommandWatchOptions& options = {}) : options_(options) {}

  /// To be called for each command. Returns false and drops the command if it is older than the timeout, from
  /// the future, non-finite, or not newer than the last one.
  bool offer(const WireCommand& command, Duration now);
  /// To be called when the driver has disconnected. From then on, zero is sent and any further commands are
  /// dropped.
  void give_up() { given_up_ = true; }
  /// The order to send now; `nullopt` if none is due. To be called only when the robot can read, because the
  /// order depends on the time of the call.
  [[nodiscard]] std::optional<RobotOrder> due(Duration now);
  /// The latest time at which due() must be called again.
  [[nodiscard]] Duration next(Duration now) const;

 private:
  [[nodiscard]] bool fresh(Duration now) const {
    return !given_up_ && newest_.sequence > 0 && now - newest_.given <= options_.timeout;
  }

  CommandWatchOptions options_;
  WireCommand newest_{};
  bool passed_on_ = true;
  bool given_up_ = false;
  std::optional<Duration> last_zero_{};
};

struct WatchRobotOptions {
  CommandWatchOptions watch{};
  Duration farewell = std::chrono::milliseconds(500);   ///< how long zero is sent once the driver is gone
  Duration patience = std::chrono::milliseconds(2000);  ///< maximum time for the robot process to end
};

/// First argument of the watchdog program if a program and its arguments follow instead of a shell command.
inline constexpr std::string_view kExec = "--exec";
/// First argument for RobotCommand::listen_only.
inline constexpr std::string_view kListen = "--listen";

/// Exit codes of the watchdog itself, not of the robot process.
inline constexpr int kRobotClosedItsOutput = 124;  ///< its process continued, so it was stopped and ended
inline constexpr int kRobotCannotStart = 125;

/// Starts `command`, forwards its lines to standard output, and fresh commands from standard input to it.
/// Returns when the robot process has ended, or, after a phase of zeros, when standard input ends or the
/// parent process has gone. It never blocks: a robot that stops reading receives the newest order when it
/// reads again; a driver that does not read loses the oldest lines. With listen_only, the robot receives no
/// velocity, not even zero. A robot that closes its standard output is stopped and its process is ended
/// immediately, whatever the commands. Returns the exit code of the robot process, 128 + the signal that
/// ended it, or one of the codes above.
[[nodiscard]] int watch_robot(const RobotCommand& command, const WatchRobotOptions& options = {});

}  // namespace waymark
