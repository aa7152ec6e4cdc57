#include "waymark/robots/wire/simulation_watch.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace waymark {

bool SimulationWatch::silent(Duration now) const {
  return newest_odometry_ && now - *newest_odometry_ > options_.silent;
}

bool SimulationWatch::ended(Duration now) const {
  return newest_odometry_ &&
         now - std::max(*newest_odometry_, clock_.value_or(*newest_odometry_)) > options_.ended;
}

std::string SimulationWatch::take_reports(Duration now, bool drives) {
  const bool is_silent = silent(now);
  if (is_silent == was_silent_) return {};
  was_silent_ = is_silent;
  if (!is_silent) return drives ? "odometry is back: commands are sent again" : "odometry is back";
  // Uses half the time, because clock and odometry stop at about the same time when the simulation ends.
  const bool clock_runs = clock_ && now - *clock_ <= options_.silent / 2;
  return fmt::format("no odometry for {:.2f} s{}; {}", to_seconds(now - *newest_odometry_),
                     drives ? ": sending zero until it is back" : "",
                     clock_runs ? "the simulation still publishes its clock: is it paused?"
                                : "the simulation publishes no clock and may have ended");
}

}  // namespace waymark
