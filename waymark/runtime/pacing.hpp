#pragma once

#include <functional>

#include "waymark/base/time.hpp"

namespace waymark {

/// The time a drive goes by.
struct Pacing {
  /// Never goes back.
  std::function<Duration()> clock;
  /// The robot's time stands still until each of its requests is answered: commands are decided when it asks,
  /// every picture is searched for tags, and the clock counts from when the robot was switched on. Otherwise
  /// commands are decided as time passes, and only the newest picture counts.
  bool lockstep = false;
};

/// By the steady clock of this computer.
[[nodiscard]] Pacing real_time();
/// By the clock of a robot that waits for its commands.
[[nodiscard]] Pacing lockstep_time(std::function<Duration()> robots_clock);

}  // namespace waymark
