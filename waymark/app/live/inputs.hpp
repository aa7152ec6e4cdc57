#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "waymark/inputs/keyboard/terminal_keys.hpp"
#include "waymark/robots/simulated/simulated_lap.hpp"
#include "waymark/runtime/operator_input.hpp"
#include "waymark/runtime/viewer_input.hpp"

namespace waymark {

/// The space bar of the terminal, which stops a drive, whichever driver is used. It is ignored if standard
/// input is not a terminal or is read by another driver, and while this program is in the background.
class StopKey {
 public:
  /// `taken`: a driver reads the keys.
  explicit StopKey(bool taken);

  /// Whether the key was pressed since the last call; does not block.
  [[nodiscard]] bool pressed();
  [[nodiscard]] bool watched() const { return keys_ != nullptr; }

 private:
  std::unique_ptr<TerminalKeys> keys_{};
};

class LiveFeed;

/// The names of lap drivers: scripted, keyboard, gamepad.
[[nodiscard]] std::vector<std::string> lap_drivers();
/// Fails on an unknown name.
[[nodiscard]] Status check_lap_driver(const std::string& name);
/// Makes a lap driver by name; drivers operated by a person run in real time. Fails on an unknown name, on a
/// missing terminal or gamepad, and for a script in a world without a path.
[[nodiscard]] Result<std::unique_ptr<LapDriver>> make_lap_driver(const std::string& name, double speed_m_s,
                                                                 const SimulatedSetup& setup);

/// The names of operator inputs: gamepad, keyboard, lines, scripted, page.
[[nodiscard]] std::vector<std::string> operator_inputs();
/// Makes an operator input by name. With viewers, the page has the buttons as well, and a script does not end
/// the session. "page" requires viewers. The setup must outlive the input.
[[nodiscard]] Result<std::unique_ptr<OperatorInput>> make_operator_input(
    const std::string& name, double speed_m_s, const SimulatedSetup& setup,
    const std::optional<ViewerLink>& viewers = {});

/// A link to the orders of the feed's viewers, which the feed must outlive. Nothing without a feed.
[[nodiscard]] std::optional<ViewerLink> viewer_link(LiveFeed* feed);

}  // namespace waymark
