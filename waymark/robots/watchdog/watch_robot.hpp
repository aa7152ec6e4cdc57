#pragma once

#include <string>
#include <string_view>

#include "waymark/robots/watchdog/command_watch.hpp"
#include "waymark/robots/watchdog/robot_command.hpp"

namespace waymark {

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
