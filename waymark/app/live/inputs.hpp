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

class LiveFeed;

/// The names of lap drivers: scripted, keyboard, gamepad.
[[nodiscard]] std::vector<std::string> lap_drivers();
/// Fails on a name that is none of them.
[[nodiscard]] Status check_lap_driver(const std::string& name);
/// Who drives a lap, by name; a person drives in real time. Fails on an unknown name, without a terminal,
/// without a pad, and for a script without a line to drive.
[[nodiscard]] Result<std::unique_ptr<LapDriver>> make_lap_driver(const std::string& name, double speed_m_s,
                                                                 const SimulatedSetup& setup);

/// The names of operator's inputs: gamepad, keyboard, lines, scripted, page.
[[nodiscard]] std::vector<std::string> operator_inputs();
/// An operator's buttons and sticks, by name. With viewers the page has the buttons as well, and a script
/// does not end the session; without them there is no "page". The setup outlives the input.
[[nodiscard]] Result<std::unique_ptr<OperatorInput>> make_operator_input(
    const std::string& name, double speed_m_s, const SimulatedSetup& setup,
    const std::optional<ViewerLink>& viewers = {});

/// The orders of a feed's viewers; the feed outlives the link. Nothing without a feed.
[[nodiscard]] std::optional<ViewerLink> viewer_link(LiveFeed* feed);

}  // namespace waymark
