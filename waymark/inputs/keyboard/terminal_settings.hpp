#pragma once

#include <termios.h>

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

}  // namespace waymark
