#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "waymark/base/error.hpp"
#include "waymark/base/time.hpp"
#include "waymark/robots/watchdog/robot_command.hpp"

namespace waymark {

/// A command on its way to the watchdog.
struct WireCommand {
  std::int64_t sequence = 0;  ///< counts up from 1
  Duration given{};           ///< when it was decided, by the machine's steady clock
  double speed_m_s = 0;
  double yaw_rate_rad_s = 0;
  std::int64_t step = 0;  ///< the step of a robot in lockstep that it answers; 0: none

  friend bool operator==(const WireCommand&, const WireCommand&) = default;
};

/// "command 12 8123456789 0.3 -0.1 0" and a line end.
[[nodiscard]] std::string wire_line(const WireCommand& command);
/// Fails on anything that wire_line() does not write, and on numbers that are not finite.
[[nodiscard]] Result<WireCommand> parse_wire_line(std::string_view line);

/// What the robot is told.
struct RobotOrder {
  std::int64_t sequence = 0;  ///< of the newest command that was fresh when it came
  double speed_m_s = 0;
  double yaw_rate_rad_s = 0;
  double age_s = 0;  ///< of the command when it is passed on
  std::int64_t step = 0;
  const char* reason = nullptr;  ///< of a stop that the watchdog decided; nothing when it passes a command on
};

/// The line for the robot's process (docs/formats/robot-process.md).
[[nodiscard]] std::string order_line(const RobotOrder& order);

struct CommandWatchOptions {
  Duration timeout = std::chrono::milliseconds(250);  ///< a command that is older does not drive
  Duration repeat = std::chrono::milliseconds(50);    ///< zero is sent so often
};

/// Decides what the robot is told: the newest command once, while it is fresh, and zero again and again when
/// there is none. Pure: `now` is the steady clock of WireCommand::given, and never goes back.
class CommandWatch {
 public:
  explicit CommandWatch(const CommandWatchOptions& options = {}) : options_(options) {}

  /// A command comes. False, and it is dropped, when it is older than the timeout, from the future, not
  /// finite, or not newer than the last one.
  bool offer(const WireCommand& command, Duration now);
  /// Nobody will give commands any more: zero from now on, whatever comes.
  void give_up() { given_up_ = true; }
  /// What is to be sent now; nothing when nothing is due. Sending nothing for as long as the robot does not
  /// read is safe: what is due is decided anew each time.
  [[nodiscard]] std::optional<RobotOrder> due(Duration now);
  /// When due() may have something to say at the latest.
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
  Duration farewell = std::chrono::milliseconds(500);   ///< zero is sent for so long when the driver is gone
  Duration patience = std::chrono::milliseconds(2000);  ///< the robot's process may take so long to end
};

/// The first argument of the watchdog's program when the program and the arguments of the robot follow,
/// instead of a command for the shell.
inline constexpr std::string_view kExec = "--exec";
/// The first argument where the robot is only listened to: RobotCommand::listen_only.
inline constexpr std::string_view kListen = "--listen";

/// Exit codes of the watchdog that the robot's process did not choose.
inline constexpr int kRobotClosedItsOutput = 124;  ///< its process went on, and was stopped and ended
inline constexpr int kRobotCannotStart = 125;

/// Starts `command`, passes its lines on to standard output and fresh commands from standard
/// input on to it, and ends when it has ended, or, after a farewell of zeros, when standard input ends or the
/// parent process is gone. Never waits for anybody: a robot that does not read gets the newest order when it
/// does; a driver that does not read loses the oldest lines. A robot that is only listened to gets no
/// velocity, neither zero. A robot that closes its standard output is stopped at once, whatever the driver
/// says, and ended. Gives the exit code of the robot's process, 128 + the signal that ended it, or one of the
/// above.
[[nodiscard]] int watch_robot(const RobotCommand& command, const WatchRobotOptions& options = {});

}  // namespace waymark
