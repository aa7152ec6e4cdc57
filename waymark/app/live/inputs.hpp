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

/// The space bar of the terminal, which stops a drive regardless of the driver in use. It is ignored if
/// standard input is not a terminal or is read by a driver, and while this program is in the background.
class StopKey {
 public:
  /// `taken` is true if a driver reads the keys.
  explicit StopKey(bool taken);

  /// Whether the key has been pressed since the last call. Does not block.
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
/// Creates a lap driver by name. Drivers operated by a person run in real time. Fails if the name is unknown,
/// if there is no terminal or gamepad, or if a script is requested in a world without a path.
[[nodiscard]] Result<std::unique_ptr<LapDriver>> make_lap_driver(const std::string& name, double speed_m_s,
                                                                 const SimulatedSetup& setup);

/// The names of the operator inputs: gamepad, keyboard, lines, scripted, page.
[[nodiscard]] std::vector<std::string> operator_inputs();
/// Creates an operator input by name. If there are viewers, the page shows the buttons as well, and a script
/// does not end the session. "page" requires viewers. The setup must outlive the input.
[[nodiscard]] Result<std::unique_ptr<OperatorInput>> make_operator_input(
    const std::string& name, double speed_m_s, const SimulatedSetup& setup,
    const std::optional<ViewerLink>& viewers = {});

/// Connects to the orders from the feed's viewers; the feed must outlive the result. `nullopt` if there is no
/// feed.
[[nodiscard]] std::optional<ViewerLink> viewer_link(LiveFeed* feed);

}  // namespace waymark
