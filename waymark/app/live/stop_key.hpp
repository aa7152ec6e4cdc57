#pragma once

#include <memory>

#include "waymark/inputs/keyboard/terminal_keys.hpp"

namespace waymark {

/// The space bar of the terminal, which stops a drive whoever drives. Where standard input is no terminal, is
/// somebody else's, or this program is in the background, nothing is ever pressed.
class StopKey {
 public:
  /// `taken`: a driver reads the keys itself.
  explicit StopKey(bool taken);

  /// Since the last call; never waits.
  [[nodiscard]] bool pressed();
  [[nodiscard]] bool watched() const { return keys_ != nullptr; }

 private:
  std::unique_ptr<TerminalKeys> keys_{};
};

}  // namespace waymark
