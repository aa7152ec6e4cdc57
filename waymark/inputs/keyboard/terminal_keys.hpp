#pragma once

#include <memory>
#include <string>

#include <termios.h>

#include "waymark/base/error.hpp"

namespace waymark {

/// How a terminal was set before keys were read from it.
struct TerminalSettings {
  int descriptor = -1;
  bool is_terminal = false;
  termios before{};
};
[[nodiscard]] TerminalSettings terminal_settings(int descriptor);

/// Sets it as it was. May be called by a signal handler; a program in the background leaves its terminal
/// alone.
void put_back(const TerminalSettings& settings);

/// A terminal in raw mode: keys come at once and are not shown; Ctrl-C stays what it is. The destructor puts
/// everything back.
class TerminalKeys {
 public:
  /// Fails when `descriptor` is not a terminal.
  static Result<std::unique_ptr<TerminalKeys>> open(int descriptor);
  ~TerminalKeys();
  TerminalKeys(const TerminalKeys&) = delete;
  TerminalKeys& operator=(const TerminalKeys&) = delete;

  /// What was typed since the last call; never waits. Fails when the terminal is gone.
  [[nodiscard]] Result<std::string> read();

 private:
  explicit TerminalKeys(const TerminalSettings& saved);

  TerminalSettings saved_;
};

}  // namespace waymark
