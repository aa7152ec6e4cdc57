#pragma once

#include <string>
#include <utility>
#include <vector>

namespace waymark {

/// What is started to be the robot: a command that a user wrote for the shell, or a program of ours with its
/// arguments, which no shell reads.
struct RobotCommand {
  std::string shell{};               ///< /bin/sh -c
  std::vector<std::string> words{};  ///< the program's path and its arguments; empty: `shell` counts
  bool listen_only = false;          ///< somebody else drives: its process is heard, and told no velocity

  RobotCommand() = default;
  // NOLINTNEXTLINE(google-explicit-constructor): a text is a command for the shell
  RobotCommand(std::string text) : shell(std::move(text)) {}
  // NOLINTNEXTLINE(google-explicit-constructor)
  RobotCommand(const char* text) : shell(text) {}
  explicit RobotCommand(std::vector<std::string> program) : words(std::move(program)) {}

  [[nodiscard]] bool empty() const { return shell.empty() && words.empty(); }
  /// For messages and recordings.
  [[nodiscard]] std::string text() const {
    std::string all = shell;
    for (const std::string& word : words) all += (all.empty() ? "" : " ") + word;
    return all;
  }
};

}  // namespace waymark
