#pragma once

#include <memory>
#include <string>

#include "waymark/base/error.hpp"
#include "waymark/inputs/keyboard/terminal_settings.hpp"

namespace waymark {

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
