#pragma once

#include <string>
#include <utility>
#include <vector>

namespace waymark {

/// The command that starts a robot: either a shell command from the user, or a program with arguments that
/// bypass the shell.
struct RobotCommand {
  std::string shell{};               ///< command for /bin/sh -c
  std::vector<std::string> words{};  ///< path of the program and its arguments; if empty, `shell` is used
  bool listen_only = false;  ///< whether another program drives, so that this process receives no velocity

  RobotCommand() = default;
  // NOLINTNEXTLINE(google-explicit-constructor): a text is a command for the shell
  RobotCommand(std::string text) : shell(std::move(text)) {}
  // NOLINTNEXTLINE(google-explicit-constructor)
  RobotCommand(const char* text) : shell(text) {}
  explicit RobotCommand(std::vector<std::string> program) : words(std::move(program)) {}

  [[nodiscard]] bool empty() const { return shell.empty() && words.empty(); }
  /// The command line, as used in messages and recordings.
  [[nodiscard]] std::string text() const {
    std::string all = shell;
    for (const std::string& word : words) all += (all.empty() ? "" : " ") + word;
    return all;
  }
};

}  // namespace waymark
