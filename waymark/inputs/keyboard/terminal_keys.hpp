#pragma once

#include <memory>
#include <string>

#include <termios.h>

#include "waymark/base/error.hpp"

namespace waymark {

/// The settings that a terminal had before keys were read from it.
struct TerminalSettings {
  int descriptor = -1;
  bool is_terminal = false;
  termios before{};
};
[[nodiscard]] TerminalSettings terminal_settings(int descriptor);

/// Restores the settings unless the program runs in the background. May be called from a signal handler.
void restore_terminal(const TerminalSettings& settings);

/// A terminal in raw mode: keys arrive immediately and are not echoed; Ctrl-C works as usual. The destructor
/// restores the settings.
class TerminalKeys {
 public:
  /// Fails if `descriptor` is not a terminal.
  static Result<std::unique_ptr<TerminalKeys>> open(int descriptor);
  ~TerminalKeys();
  TerminalKeys(const TerminalKeys&) = delete;
  TerminalKeys& operator=(const TerminalKeys&) = delete;

  /// The bytes typed since the last call; does not block. Fails if the terminal has been closed.
  [[nodiscard]] Result<std::string> read();

 private:
  explicit TerminalKeys(const TerminalSettings& saved);

  TerminalSettings saved_;
};

}  // namespace waymark
