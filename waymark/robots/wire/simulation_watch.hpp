#pragma once

#include <optional>
#include <string>

#include "waymark/base/time.hpp"

namespace waymark {

struct SimulationWatchOptions {
  Duration silent = std::chrono::milliseconds(220);  ///< without odometry: the robot is held
  Duration ended = std::chrono::seconds(5);          ///< without odometry and clock: the simulation ended
};

/// Watches that a simulation runs. Pure: `now` is a steady clock.
class SimulationWatch {
 public:
  explicit SimulationWatch(const SimulationWatchOptions& options = {}) : options_(options) {}

  /// New odometry came.
  void odometry(Duration now) { heard_ = now; }
  /// The clock of the simulation came, which it does while it is paused, too.
  void clock(Duration now) { clock_ = now; }
  /// Begins anew: this program was busy itself.
  void forget() { heard_.reset(); }
  /// Whether the robot must be held because nothing was heard of it. False before the first odometry.
  [[nodiscard]] bool silent(Duration now) const;
  /// Whether neither odometry nor clock came for long. False before the first odometry.
  [[nodiscard]] bool ended(Duration now) const;
  /// What changed since the last call, in words; empty: nothing. `drives`: commands are sent to the robot.
  [[nodiscard]] std::string take_words(Duration now, bool drives = true);

 private:
  SimulationWatchOptions options_;
  std::optional<Duration> heard_{};
  std::optional<Duration> clock_{};
  bool was_silent_ = false;
};

}  // namespace waymark
