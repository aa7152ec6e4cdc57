#pragma once

#include <optional>
#include <string>

#include "waymark/base/time.hpp"

namespace waymark {

struct SimulationWatchOptions {
  Duration silent = std::chrono::milliseconds(220);  ///< time without odometry after which the robot is held
  Duration ended = std::chrono::seconds(5);  ///< time without odometry and clock after which it has ended
};

/// Detects whether a simulation is running, is paused or has ended. Pure: `now` is a steady clock.
class SimulationWatch {
 public:
  explicit SimulationWatch(const SimulationWatchOptions& options = {}) : options_(options) {}

  /// To be called for new odometry.
  void odometry(Duration now) { newest_odometry_ = now; }
  /// To be called for each clock message; the simulation also publishes the clock while paused.
  void clock(Duration now) { clock_ = now; }
  /// Starts over, for example after this program itself has been busy.
  void reset() { newest_odometry_.reset(); }
  /// Whether the robot must be held because odometry is missing. False before the first odometry.
  [[nodiscard]] bool silent(Duration now) const;
  /// Whether odometry and clock have both been missing for `options.ended`. False before the first odometry.
  [[nodiscard]] bool ended(Duration now) const;
  /// A message about the change since the last call; empty if nothing has changed. `drives`: whether commands
  /// are sent to the robot.
  [[nodiscard]] std::string take_reports(Duration now, bool drives = true);

 private:
  SimulationWatchOptions options_;
  std::optional<Duration> newest_odometry_{};
  std::optional<Duration> clock_{};
  bool was_silent_ = false;
};

}  // namespace waymark
